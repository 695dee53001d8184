"""`magfold lab`: set chains by hand and watch them fold, in a browser."""

import shutil
import webbrowser
from pathlib import Path
from typing import Annotated

import typer

from magfold_env.cli import options


def lab(
    out: Annotated[
        Path | None, typer.Option(help="Folder to write the page to, instead of opening it.")
    ] = None,
) -> None:
    """Open the laboratory in a browser: turn poles, drag friction and speed, watch it fold.

    The laboratory is one self-contained file. In a checkout, it is compiled on first use.
    """
    with options.errors_in_one_line((RuntimeError, ValueError, OSError, ImportError)):
        if out is not None:
            options.check_folder("--out", out)
        # Only this command needs these imports.
        from magfold_env.browser import build  # noqa: PLC0415

        page = build.page()
        if out is not None:
            out.mkdir(parents=True, exist_ok=True)
            page = Path(shutil.copy(page, out / build.PAGE))
            options.say_written(page)
        elif not webbrowser.open(page.as_uri()):
            typer.echo(f"no browser was found here; open {page}")
