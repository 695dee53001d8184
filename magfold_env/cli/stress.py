"""What `magfold stress` does: try cases, or a scene again, and show what was found."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from magfold_env.scene import load_scene
from magfold_env.stress import campaign, report
from magfold_env.stress.laws import check
from magfold_env.stress.tally import Tally

FILE_WIDTH = 150  # of the tables where they are not written to a terminal


def try_cases(
    cases: int, seed: int, only: Sequence[str], workers: int, minutes: float | None, out: Path
) -> bool:
    """Run a campaign with a progress bar on stderr; returns whether every law was kept."""
    console = Console(stderr=True)
    columns = (
        TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()
    )  # fmt: skip
    with Progress(
        *columns, console=console, transient=True, disable=not console.is_terminal
    ) as bar:
        task = bar.add_task("", total=cases)

        def progress(tally: Tally) -> None:
            said = f"{len(tally.failures)} break a law"
            bar.update(task, completed=tally.cases, description=said)

        tally = campaign.run(
            cases, seed, only, workers=workers, minutes=minutes, out=out, progress=progress
        )
    shown = _console()
    for table in (report.kinds_table(tally), report.laws_table(tally)):
        shown.print(table)
    for path in report.write(tally, out):
        shown.print(f"written: {path}", highlight=False, soft_wrap=True)
    if tally.failures:
        shown.print(f"failing scenes: {out / 'failures'}", highlight=False, soft_wrap=True)
    return not tally.failures


def try_again(path: Path) -> bool:
    """Judge the scene in a file; returns whether it keeps every law."""
    verdict = check(load_scene(path))
    _console().print(report.verdict_table(path.name, verdict))
    return not verdict.broken


def _console() -> Console:
    console = Console()
    return console if console.is_terminal else Console(width=FILE_WIDTH)
