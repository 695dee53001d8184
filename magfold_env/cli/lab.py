"""`magfold lab`: change chains by hand and watch them fold in a browser."""

import base64
import json
import shutil
import webbrowser
from pathlib import Path
from typing import Annotated

import typer

from magfold_env.cli import options
from magfold_env.files import replacing
from magfold_env.scene import Scene, load_scene


def lab(
    scene: Annotated[
        str | None,
        typer.Argument(
            help="Shipped scene or YAML file to begin with; a shipped chain if left out."
        ),
    ] = None,
    *,
    out: Annotated[
        Path | None, typer.Option(help="Folder to write the page to, instead of opening it.")
    ] = None,
) -> None:
    """Open the laboratory in a browser: turn poles, drag friction and speed, and watch chains fold.

    The laboratory is one self-contained file. In a checkout, it is compiled on first use.
    """
    with options.errors_in_one_line((RuntimeError,)):
        options.check_folder("--out", out)
        link = "" if scene is None else link_of(load_scene(scene))
        # Only this command needs these imports.
        from magfold_env.browser import build  # noqa: PLC0415

        page = build.page()
        if out is not None:
            out.mkdir(parents=True, exist_ok=True)
            source, page = page, out / build.PAGE
            with replacing(page) as temporary:
                shutil.copyfile(source, temporary)
            options.say_written(page)
            if link:
                typer.echo(f"open {page.absolute().as_uri()}{link}")
        elif not webbrowser.open(page.as_uri() + link):
            typer.echo(f"no browser was found here; open {page.as_uri()}{link}")


def link_of(scene: Scene) -> str:
    """Return the fragment of the laboratory's URL (``#`` and text) that opens a scene there.

    If the page cannot show a scene, it displays an error that names the key.
    """
    given = scene.model_dump(mode="json", exclude_defaults=True)
    text = json.dumps({"scene": given, "wanted": ""}).encode()
    return "#" + base64.urlsafe_b64encode(text).decode().rstrip("=")
