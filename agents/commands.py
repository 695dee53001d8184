"""What the commands of this package share: options, a bar of progress, how errors are reported."""

from collections.abc import Generator
from contextlib import contextmanager
from typing import Annotated

import typer
from rich import console, progress, text

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
