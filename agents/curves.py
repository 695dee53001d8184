"""Learning curves of training runs: ``python -m agents.curves NAME=RUN,RUN,... ...``.

Runs of one name differ in the seed. The curves show the success of training episodes, with random
actions and averaged over parts of the run, and of validations, with the most probable actions.
Lines are medians over the seeds; bands and bars extend from the worst to the best.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from agents.commands import reported_errors, run_command
from agents.training.folder import RunInfo
from magfold_env.cli import options
from magfold_env.envs.chains.arrays import Floats
from magfold_env.files import write_text
from magfold_env.reporting.plotting import COLOURS, legend_below, panels, save_figure

TRAINING, VALIDATION = "rollout/success_rate", "validation/success_rate"
PARTS = 30
"""Number of parts of a run over which success in training is averaged."""

MILLION = 1_000_000


@dataclass(frozen=True)
class Curve:
    """Success over the steps of some runs."""

    steps: Floats
    """Environment steps, (k,)."""
    success: Floats
    """Success of each run, (runs, k)."""

    @property
    def spread(self) -> tuple[Floats, Floats, Floats]:
        """The worst, the median and the best run, (k,) each."""
        low, high = self.success.min(axis=0), self.success.max(axis=0)
        return low, np.median(self.success, axis=0), high


def series(run: Path) -> dict[str, Floats]:
    """Return the steps and values, (k, 2), of both series in a run's TensorBoard files.

    Raises
    ------
    ValueError
        If it is not the folder of a training run, or contains no values yet.
    """
    if RunInfo.read(run) is None:
        raise ValueError(f"{run}: is not the folder of a training run")
    events = EventAccumulator(str(run), size_guidance={"scalars": 0}).Reload()
    known = events.Tags()["scalars"]
    for name in (TRAINING, VALIDATION):
        if name not in known:
            raise ValueError(f"{run}: has no {name} yet")
    return {
        name: np.array([(each.step, each.value) for each in events.Scalars(name)], dtype=float)
        for name in (TRAINING, VALIDATION)
    }


def training_curve(found: Sequence[Floats]) -> Curve:
    """Return success in training, averaged over equal parts of the common steps of all runs."""
    edges = np.linspace(0.0, min(table[-1, 0] for table in found), PARTS + 1)
    means = [
        [
            table[(table[:, 0] > low) & (table[:, 0] <= high), 1].mean()
            for low, high in pairwise(edges)
        ]
        for table in (_filled(table, edges) for table in found)
    ]
    return Curve(0.5 * (edges[1:] + edges[:-1]), np.array(means))


def validation_curve(found: Sequence[Floats]) -> Curve:
    """Return the success of the common validations of all runs."""
    count = min(map(len, found))
    return Curve(found[0][:count, 0], np.array([table[:count, 1] for table in found]))


def _filled(table: Floats, edges: Floats) -> Floats:
    """Return a series with one value at the end of every part: the last one before it."""
    at = np.maximum(np.searchsorted(table[:, 0], edges[1:], side="right") - 1, 0)
    return np.concatenate([table, np.stack([edges[1:], table[at, 1]], axis=1)])


def draw(path: Path, found: Mapping[str, tuple[Curve, Curve]]) -> None:
    """Write a picture of the curves of training and of validation, by name."""
    title = "Lines: actions drawn, in training; dots: the most probable"
    figure, (axis,) = panels(1, title, width=7.6, height=4.4)
    most = max(training.steps[-1] for training, _ in found.values())
    unit, named = (1e-6, "millions") if most > MILLION else (1e-3, "thousands")
    for k, (name, (training, validation)) in enumerate(found.items()):
        colour = COLOURS[(k + 1) % len(COLOURS)]
        low, middle, high = (100.0 * each for each in training.spread)
        axis.plot(unit * training.steps, middle, color=colour, linewidth=1.6, label=name)
        axis.fill_between(unit * training.steps, low, high, color=colour, alpha=0.18, linewidth=0)
        low, middle, high = (100.0 * each for each in validation.spread)
        axis.errorbar(
            unit * validation.steps, middle, yerr=[middle - low, high - middle], fmt="o",
            markersize=4, capsize=2, linewidth=1.0, color=colour,
        )  # fmt: skip
    axis.set_xlabel(f"environment steps [{named}]")
    axis.set_ylabel("success [%]")
    legend_below(figure, axis)
    save_figure(figure, path)


def parse(text: str) -> tuple[str, list[Path]]:
    """Return the name and the runs in ``NAME=RUN,RUN,...``.

    Raises
    ------
    ValueError
        If the text has a different form.
    """
    name, separator, runs = text.partition("=")
    if not (name and separator and all(runs.split(","))):
        raise ValueError(f"{text!r} is not allowed; must be NAME=RUN,RUN,…, a run for each seed")
    return name, [Path(run) for run in runs.split(",")]


def main(
    runs: Annotated[list[str], typer.Argument(help="NAME=RUN,RUN,..., a folder for each seed.")],
    output: Annotated[Path, typer.Option(help="The picture; its numbers lie beside it.")] = Path(
        "runs/curves.png"
    ),
) -> None:
    """Draw learning curves of training runs."""
    with reported_errors(ValueError):
        found: dict[str, tuple[Curve, Curve]] = {}
        for name, folders in map(parse, runs):
            tables = [series(folder) for folder in folders]
            found[name] = (
                training_curve([table[TRAINING] for table in tables]),
                validation_curve([table[VALIDATION] for table in tables]),
            )
        content: dict[str, Any] = {
            name: {
                kind: {"steps": curve.steps.tolist(), "success": curve.success.tolist()}
                for kind, curve in zip(("training", "validation"), curves, strict=True)
            }
            for name, curves in found.items()
        }
        output.parent.mkdir(parents=True, exist_ok=True)
        draw(output, found)
        write_text(output.with_suffix(".json"), json.dumps(content) + "\n")
    options.say_written(output, output.with_suffix(".json"))


if __name__ == "__main__":
    run_command(main)
