"""How the commands of this package tell their user what went wrong."""

from collections.abc import Generator
from contextlib import contextmanager

import typer
from rich.console import Console
from rich.text import Text


@contextmanager
def errors_told(*kinds: type[Exception], extras: str = "") -> Generator[None]:
    """Tell what the user got wrong on stderr and end with exit code 1.

    Parameters
    ----------
    *kinds : type
        What is the user's to mend; all other errors pass.
    extras : str
        What to install if a module is missing; without it that error passes too.
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
    Console(stderr=True).print(Text.assemble(("error: ", "red"), message))
    raise typer.Exit(1)
