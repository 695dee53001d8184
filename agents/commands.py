"""Options, a progress bar, tables and error messages that this package's commands share."""

import threading
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import contextmanager
from typing import Annotated

import typer
from rich import box, console, progress, table

from magfold_env.cli import options
from magfold_env.files import pip_install


def _once(param: typer.CallbackParam, texts: list[str] | None) -> list[str] | None:
    """Return an option's items unchanged; refuse a key that is set twice."""
    options.refuse_repeated(param.opts[0], texts or [])
    return texts


EnvConfig = Annotated[str, typer.Option(help="Training settings that define the environment.")]
EnvChanges = Annotated[
    list[str] | None,
    typer.Option(
        callback=_once, help="Change to an environment setting, KEY=VALUE, such as targets=n8."
    ),
]
Draws = Annotated[int, typer.Option(min=1, help="Episodes per target.")]
Processes = Annotated[int, typer.Option(min=1, help="Number of parallel processes.")]
Assignments = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        callback=_once,
        help="Any other setting, e.g. learner.gamma=0.9.",
    ),
]


def run_command(main: Callable[..., None]) -> None:
    """Run a command whose help and messages look like those of `magfold`."""
    threading.excepthook = _leave_to_the_command
    options.application_of(main)()


def _leave_to_the_command(ended: threading.ExceptHookArgs) -> None:
    """Print the error that ended a thread, unless it is a file error, which the command reports."""
    if not issubclass(ended.exc_type, OSError):
        threading.__excepthook__(ended)


@contextmanager
def needing(extras: str) -> Generator[None]:
    """Let errors about missing modules name the package's extras that may provide them."""
    try:
        yield
    except ModuleNotFoundError as error:
        raise ImportError(f"{error}; install it, {pip_install(extras)}") from None


def progress_bar() -> progress.Progress:
    """Return a progress bar on stderr that also shows a note."""
    return progress.Progress(
        progress.TextColumn("{task.description}"),
        progress.BarColumn(),
        progress.TextColumn("{task.completed:.0f}/{task.total:.0f}"),
        progress.TextColumn("{task.fields[note]}"),
        progress.TimeElapsedColumn(),
        progress.TimeRemainingColumn(),
        console=console.Console(stderr=True),
    )


def text_table(title: str, rows: Sequence[Mapping[str, str]]) -> table.Table:
    """Return a table of `rows`, whose keys are the headings; intervals are on a second line."""
    shown = table.Table(title=title, box=box.SIMPLE_HEAD, padding=(0, 1), show_edge=False)
    cells = [[cell.replace(" (", "\n(") for cell in row.values()] for row in rows]
    for k, name in enumerate(rows[0]):
        # Headings may wrap; cells may not.
        width = max(len(line) for row in cells for line in row[k].splitlines() or [""])
        shown.add_column(name, justify="right" if k else "left", min_width=width if k else None)
    for row in cells:
        shown.add_row(*row)
    return shown
