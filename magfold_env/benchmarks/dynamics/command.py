"""Run the parts of the dynamics benchmark with a progress bar and report them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
from rich.progress import Progress as Bar

from magfold_env.benchmarks import machine
from magfold_env.benchmarks.dynamics import (
    chain_scaling,
    contact_scenes,
    features,
    figures,
    report,
    restarts,
    smooth,
)
from magfold_env.benchmarks.dynamics.part import Part, Progress
from magfold_env.benchmarks.dynamics.runge_kutta import dop853

FILE_WIDTH = 110  # of the report where it is not written to a terminal

Runner = Callable[[bool, Progress], Part]

PARTS: dict[str, Runner] = {
    "scaling": chain_scaling.run,
    "smooth": smooth.run,
    "restarts": restarts.run,
    "contact": contact_scenes.run,
    "features": features.run,
}


def run(only: Sequence[str], quick: bool, out: Path | None) -> None:
    """Measure, print, and write tables and diagrams.

    Parameters
    ----------
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
    unknown = [name for name in only if name not in PARTS]
    if unknown:
        raise ValueError(
            f"--only: {unknown[0]!r} is not allowed; must be one of {', '.join(PARTS)}"
        )
    chosen = list(only) or list(PARTS)
    try:
        if {"smooth", "restarts"} & set(chosen):
            dop853()
        if out is not None:
            figures.figure_class()
    except ImportError as error:
        raise ValueError(str(error)) from error
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
    system = machine.describe()
    parts = [_run_part(name, quick) for name in chosen]
    console = Console()
    if not console.is_terminal:
        console = Console(width=FILE_WIDTH)
    report.show(console, system, parts)
    if out is not None:
        written = report.write(out, system, parts)
        for part in parts:
            written += figures.draw(part, out)
        for path in written:
            console.print(f"written: {path}", highlight=False)


def _run_part(name: str, quick: bool) -> Part:
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

        return PARTS[name](quick, progress)
