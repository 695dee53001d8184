"""What `magfold paper` does: reproduce, with a progress bar, and show what agrees."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from magfold_env.paper.page import Done, overview
from magfold_env.paper.run import NUMBERS, PAGE, run
from magfold_env.reporting.plotting import figure_class
from magfold_env.reporting.tables import rich_table

FILE_WIDTH = 150  # of what is said where it is not written to a terminal


def reproduce(only: Sequence[str], quick: bool, out: Path) -> None:
    """Measure, write and show.

    Raises
    ------
    ValueError
        If a part is not known, or the folder holds another version's parts.
    ImportError
        If the extra `render` is not installed.
    """
    import magfold_env.render  # noqa: F401, PLC0415  # pyright: ignore[reportUnusedImport]

    figure_class()
    console = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Progress(
        *columns, console=console, transient=True, disable=not console.is_terminal
    ) as bar:
        task = bar.add_task("", total=1.0)

        def progress(share: float, what: str) -> None:
            bar.update(task, completed=share, description=what)

        done = run(only, quick, out, progress)
    _show(done, out)


def _show(done: Sequence[Done], out: Path) -> None:
    """Print what disagrees, how many statements agree, and where the rest is."""
    console = Console()
    if not console.is_terminal:
        console = Console(width=FILE_WIDTH)
    for each in done:
        for claim in each.claims:
            if claim.holds is False:
                text = f"• {each.part.name}: {claim.stated} Here: {claim.found}"
                console.print(escape(text), highlight=False)
    console.print(rich_table(overview(done)))
    for path in (out / PAGE, out / NUMBERS):
        console.print(f"written: {path}", highlight=False, soft_wrap=True)
    console.print(f"pictures and tables of numbers: {out}", highlight=False, soft_wrap=True)
