"""The parts of every benchmark, and how to measure, draw and run them.

Descriptions of the parts are in `descriptions.toml`.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from magfold_bench import (
    design,
    episodes,
    fold_peers,
    folds,
    ground_states,
    idealisations,
    overhead,
    scaling,
    skipping,
    tables,
    work_precision,
)
from magfold_bench.laws import experiment
from magfold_bench.magnets import accuracy, peers
from magfold_bench.tables import Measurement, Progress, Row
from magfold_env.cli import options
from magfold_env.files import write_text
from magfold_env.reporting import machine, plotting
from magfold_env.reporting.tables import to_csv


@dataclass(frozen=True)
class Part:
    """A part that can be measured on its own."""

    measure: Callable[[bool, Progress], Measurement]
    """Measures the part; the arguments are whether to measure less, and a `Progress` function."""
    draw: Callable[[list[Row]], Any] | None = None
    """Turns the rows into a matplotlib figure."""


BENCHMARKS: dict[str, dict[str, Part]] = {
    "whole": {
        "work-precision": Part(work_precision.run, work_precision.DIAGRAM.draw),
        "skipping": Part(skipping.run),
    },
    "dynamics": {
        "scaling": Part(scaling.run, scaling.draw),
        "folds": Part(folds.folds),
        "peers": Part(fold_peers.run),
        "first-use": Part(folds.first_use),
    },
    "magnets": {
        "accuracy": Part(accuracy.run, accuracy.DIAGRAM.draw),
        "peers": Part(peers.run, peers.DIAGRAM.draw),
    },
    "energy": {"ground-states": Part(ground_states.run)},
    "predict": {
        "experiment": Part(experiment.run, experiment.draw_experiment),
        "idealisations": Part(idealisations.run),
    },
    "design": {"targets": Part(design.targets)},
    "env": {
        "episodes": Part(episodes.run, episodes.DIAGRAM.draw),
        "overhead": Part(overhead.run, overhead.DIAGRAM.draw),
    },
}
"""Parts by benchmark, in the order of the suite's report."""


def run(name: str, only: Sequence[str], quick: bool, out: Path | None) -> None:
    """Measure and print a benchmark's parts named in `only`, or all, and write their results.

    CSV, JSON and PNG files are written into the folder ``out``, unless it is None.
    """
    chosen = tables.chosen(BENCHMARKS[name], only)
    if out is not None:
        plotting.figure_class()  # fails before the long work if matplotlib is missing
        out.mkdir(parents=True, exist_ok=True)
    system = machine.describe()
    measured = {each: measure(each, part, quick) for each, part in chosen.items()}
    tables.show(options.wide_console(), system, measured)
    if out is not None:
        found = ((each, part, measured[each]) for each, part in chosen.items())
        written = [path for each in found for path in write(*each, out)]
        write_text(out / f"{name}.json", tables.to_json(system, measured))
        options.say_written(*written, out / f"{name}.json")


def measure(name: str, part: Part, quick: bool) -> Measurement:
    """Measure one part, with a progress bar on stderr that vanishes at the end."""
    with options.progress_of(1.0) as tell:
        return part.measure(quick, lambda share, what: tell(share, f"{name}: {what}"))


def write(name: str, part: Part, found: Measurement, folder: Path) -> list[Path]:
    """Write a part's rows and its diagram, if there are any, and return the files."""
    if not found.rows:
        return []
    written = [folder / f"{name}.csv"]
    write_text(written[0], to_csv(found.rows))
    if part.draw is not None:
        written.append(folder / f"{name}.png")
        plotting.save_figure(part.draw(found.rows), written[1])
    return written
