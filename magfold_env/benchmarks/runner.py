"""Run the parts of a benchmark with a progress bar and report them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
from rich.progress import Progress as Bar

from magfold_env.reporting import machine, plotting, tables
from magfold_env.reporting.plotting import Drawing
from magfold_env.reporting.tables import Measurement, Progress


@dataclass(frozen=True)
class Description:
    """One part in plain words: a title, and some sentences to each question."""

    title: str
    measured: str
    """What was measured."""
    how: str
    """How, and against what."""
    meaning: str
    """What the result means to someone who uses the package."""
    missing: str
    """What it does not cover."""


FILE_WIDTH = 110  # of the report where it is not written to a terminal

Runner = Callable[[bool, Progress], Measurement]


def _nothing(chosen: Sequence[str]) -> None:
    pass


@dataclass(frozen=True)
class Benchmark:
    """Parts that can be measured one by one."""

    name: str
    """Also the name of its JSON file."""
    parts: Mapping[str, Runner]
    drawings: Mapping[str, Drawing]
    """Diagrams, by part."""
    check: Callable[[Sequence[str]], object] = _nothing
    """Raises ImportError if something is missing that the chosen parts cannot do without."""
    about: Mapping[str, Description] = field(default_factory=dict[str, Description])
    """What is said about each part."""


def run(benchmark: Benchmark, only: Sequence[str], quick: bool, out: Path | None) -> None:
    """Measure, print, and write tables and diagrams.

    Parameters
    ----------
    benchmark
        What can be measured.
    only
        Names of the parts to measure; all if empty.
    quick
        Whether to measure less, with fewer repeats: to see that it works, not to quote.
    out
        Folder for CSV, JSON and PNG files, made if need be; None writes nothing.

    Raises
    ------
    ValueError
        If a part is not known, or an extra that is needed is not installed.
    """
    known = benchmark.parts
    unknown = [name for name in only if name not in known]
    if unknown:
        raise ValueError(
            f"--only: {unknown[0]!r} is not allowed; must be one of {', '.join(known)}"
        )
    chosen = list(only) or list(known)
    try:
        benchmark.check(chosen)
        if out is not None:
            plotting.figure_class()
    except ImportError as error:
        raise ValueError(str(error)) from error
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
    system = machine.describe()
    parts = [run_part(name, known[name], quick) for name in chosen]
    console = Console()
    if not console.is_terminal:
        console = Console(width=FILE_WIDTH)
    tables.show(console, system, parts)
    if out is not None:
        written = tables.write(out, benchmark.name, system, parts)
        for part in parts:
            written += plotting.draw(part, benchmark.drawings, out)
        for path in written:
            console.print(f"written: {path}", highlight=False)


def run_part(name: str, runner: Runner, quick: bool) -> Measurement:
    """Run one part; the bar is on stderr and vanishes with it."""
    columns = (TextColumn("{task.fields[part]}"), BarColumn(), TextColumn("{task.description}"))
    console = Console(stderr=True)
    with Bar(
        *columns,
        TimeElapsedColumn(),
        console=console,
        transient=True,
        disable=not console.is_terminal,
    ) as bar:
        task = bar.add_task("", total=1.0, part=name)

        def progress(share: float, what: str) -> None:
            bar.update(task, completed=share, description=what)

        return runner(quick, progress)
