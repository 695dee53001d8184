"""What the commands of this package share: options, a bar of progress, tables, errors."""

from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
from typing import Annotated

import typer
from rich import box, console, progress, table, text

EnvConfig = Annotated[str, typer.Option(help="Training settings that give the environment.")]
EnvChanges = Annotated[
    list[str] | None,
    typer.Option(help="Change of an environment setting, KEY=VALUE, such as targets=n8."),
]
Assignments = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Any other setting: learner.gamma=0.9."),
]


@contextmanager
def reported_errors(*kinds: type[Exception], extras: str = "") -> Generator[None]:
    """Tell what the user got wrong on stderr and end with exit code 1.

    The `kinds` of errors are the user's to mend, and so is a missing module if it comes with
    `extras`, which are told then; all others pass.
    """
    try:
        yield
    except kinds as error:
        message = str(error)
    except ModuleNotFoundError as error:
        if not extras:
            raise
        message = f"{error}; it comes with {extras}"
    else:
        return
    # Not as markup: messages hold brackets of their own.
    console.Console(stderr=True).print(text.Text.assemble(("error: ", "red"), message))
    raise typer.Exit(1)


def progress_bar() -> progress.Progress:
    """Return a bar that has room for a rate of success."""
    return progress.Progress(
        progress.TextColumn("{task.description}"),
        progress.BarColumn(),
        progress.TextColumn("{task.completed:.0f}/{task.total:.0f}"),
        progress.TextColumn("{task.fields[note]}"),
        progress.TimeElapsedColumn(),
        progress.TimeRemainingColumn(),
    )


def text_table(title: str, rows: Sequence[Mapping[str, str]]) -> table.Table:
    """Return a table of rows with the same keys, which head the columns; intervals have a line."""
    shown = table.Table(title=title, box=box.SIMPLE_HEAD, padding=(0, 1), show_edge=False)
    cells = [[cell.replace(" (", "\n(") for cell in row.values()] for row in rows]
    first, *others = rows[0]
    shown.add_column(first, overflow="fold")
    for k, name in enumerate(others, start=1):
        # Headings may be broken, cells not.
        width = max(len(line) for row in cells for line in row[k].splitlines() or [""])
        shown.add_column(name, justify="right", min_width=width)
    for row in cells:
        shown.add_row(*row)
    return shown
