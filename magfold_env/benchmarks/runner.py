"""Run the parts of a benchmark with a progress bar and report them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
from rich.progress import Progress as Bar

from magfold_env.reporting import machine, plotting, tables
from magfold_env.reporting.tables import Measurement, Progress, Row

FILE_WIDTH = 110  # of the report where it is not written to a terminal


def _nothing() -> None:
    pass


@dataclass(frozen=True)
class Part:
    """What can be measured by itself."""

    measure: Callable[[bool, Progress], Measurement]
    """Takes whether to measure less, and what is told how far it is."""
    draw: Callable[[list[Row]], Any] | None = None
    """Turns the rows into a matplotlib figure."""
    check: Callable[[], object] = _nothing
    """Raises ImportError if something is missing that it cannot do without."""


def run(
    name: str, parts: Mapping[str, Part], only: Sequence[str], quick: bool, out: Path | None
) -> None:
    """Measure, print, and write tables and diagrams.

    Parameters
    ----------
    name
        Of the benchmark, and of its JSON file.
    parts
        What can be measured, by name.
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
    unknown = [each for each in only if each not in parts]
    if unknown:
        raise ValueError(
            f"--only: {unknown[0]!r} is not allowed; must be one of {', '.join(parts)}"
        )
    chosen = list(only) or list(parts)
    try:
        for each in chosen:
            parts[each].check()
        if out is not None:
            plotting.figure_class()
    except ImportError as error:
        raise ValueError(str(error)) from error
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
    system = machine.describe()
    measured = {each: measure(each, parts[each], quick) for each in chosen}
    console = report_console()
    tables.show(console, system, measured)
    if out is not None:
        written = tables.write(out, name, system, measured)
        for each, found in measured.items():
            written += draw(each, parts[each], found, out)
        for path in written:
            console.print(f"written: {path}", highlight=False)


def report_console() -> Console:
    """Return the console of a report, wide enough where it is a file."""
    console = Console()
    return console if console.is_terminal else Console(width=FILE_WIDTH)


def measure(name: str, part: Part, quick: bool) -> Measurement:
    """Measure one part; the bar is on stderr and vanishes with it."""
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

        return part.measure(quick, progress)


def draw(name: str, part: Part, found: Measurement, folder: Path) -> list[Path]:
    """Draw a part's diagram, if it has one, and return the files written."""
    if part.draw is None or not found.rows:
        return []
    path = folder / f"{name}.png"
    plotting.save_figure(part.draw(found.rows), path)
    return [path]
