"""How the `magfold` command tells its user what went wrong."""

from __future__ import annotations

from collections.abc import Generator
from contextlib import contextmanager

import typer


@contextmanager
def errors_in_one_line() -> Generator[None]:
    """Tell what the user got wrong on one line of stderr and end with exit code 2."""
    try:
        yield
    except (ValueError, OSError, ImportError) as error:
        message = "; ".join(str(error).splitlines())
        typer.echo(f"error: {message}", err=True)
        raise typer.Exit(2) from None
