"""The directive `moving-picture`, which animates the examples when the site is built.

Its argument names a program in ``docs/examples``. The program assigns a `Fold` to ``fold`` or an
environment to ``env``, and writes a page that plays it. The site shows a GIF that links to this
page, and the program in a block that opens on request. With the option ``values``, the program
runs once for each value, which replaces that of its only constant, such as ``WORD = "LRLLL"``.
Pictures and pages are cached until the program or the package changes.
"""

import ast
import contextlib
import hashlib
import html
import io
import re
import shutil
import tempfile
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from docutils import nodes
from docutils.parsers.rst import directives
from PIL import Image
from sphinx.application import Sphinx
from sphinx.util import logging
from sphinx.util.docutils import SphinxDirective

from magfold_env.envs.chain_env import ChainEnv
from magfold_env.files import replacing
from magfold_env.fold import Fold
from magfold_env.render import save_gif
from magfold_env.render.frames import write_gif

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "docs" / "examples"
RUNS = ROOT / "runs"
CACHE = RUNS / "moving-pictures"
FOLDER = "_moving"

SMALL = (320, 240)  # [px] width and height
LARGE = (640, 480)
FRAMES = (90, 60, 40, 20)  # of an episode: the first number for which a GIF has at most
BYTES = 1_000_000
FPS = 15

_log = logging.getLogger(__name__)


class MovingPicture(SphinxDirective):
    """Directive that shows animations of an example program."""

    required_arguments = 1
    option_spec = {"values": directives.unchanged, "small": directives.flag}  # noqa: RUF012

    def run(self) -> list[nodes.Node]:
        """Return the nodes of one figure for each run of the program."""
        path = EXAMPLES / f"{self.arguments[0]}.py"
        self.env.note_dependency(str(path))
        program = path.read_text("utf-8")
        if values := self.options.get("values", "").split():
            programs = [(with_value(program, value), value) for value in values]
        else:
            programs = [(program, ast.get_docstring(ast.parse(program)) or "")]
        return [node for each in programs for node in self._figure(*each)]

    def _figure(self, program: str, title: str) -> Iterator[nodes.Node]:
        size = SMALL if "small" in self.options else LARGE
        name = made(program, size)
        shown = self.env.metadata[self.env.docname]
        shown["moving"] = f"{shown.get('moving', '')} {name}"
        up = "../" * self.env.docname.count("/")
        told = html.escape(re.sub(r"`(.*?)`", r"\1", title), quote=True)
        where = f"{up}{FOLDER}/{name}"
        width, height = size
        caption = re.sub(r"`(.*?)`", r"<code>\1</code>", html.escape(title))
        yield nodes.raw(
            "",
            f'<figure class="moving"><a href="{where}.html"><img src="{where}.gif" alt="{told}" '
            f'width="{width}" height="{height}" loading="lazy"></a>'
            f'<figcaption>{caption} <a href="{where}.html" aria-label="play: {told}">Play it</a>'
            "</figcaption><details><summary>the program</summary>",
            format="html",
        )
        yield nodes.literal_block(program, program, language="python")
        yield nodes.raw("", "</details></figure>", format="html")


def with_value(program: str, value: str) -> str:
    """Return a program in which the only constant has another value."""
    changed, count = re.subn(r'(?m)^([A-Z]+) = ".*"$', rf'\1 = "{value}"', program)
    if count != 1:
        raise ValueError(f"values: {value!r}: the program has {count} constants; must be one")
    return changed


def made(program: str, size: tuple[int, int]) -> str:
    """Return the name of a program's picture and page in the cache, which are made if missing."""
    name = hashlib.sha256(f"{program}{size}{package_digest()}".encode()).hexdigest()[:16]
    picture, page = CACHE / f"{name}.gif", CACHE / f"{name}.html"
    if not (picture.is_file() and page.is_file()):
        _log.info("running an example: %s", program.splitlines()[0])
        CACHE.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory() as folder:
            space, written = run(program, Path(folder))
            draw(space, picture, size)
            with replacing(page) as temporary:
                shutil.copyfile(written, temporary)
    return name


def run(program: str, folder: Path) -> tuple[dict[str, Any], Path]:
    """Run a program in a folder, and return its variables and the path of the page it wrote."""
    (folder / "configs").symlink_to(ROOT / "configs")
    space: dict[str, Any] = {"__name__": "__main__"}
    with contextlib.chdir(folder), contextlib.redirect_stdout(io.StringIO()):
        exec(compile(program, "example", "exec"), space)
    (page,) = folder.glob("*.html")
    return space, page


def draw(space: dict[str, Any], path: Path, size: tuple[int, int]) -> None:
    """Draw the fold or the episode among a program's variables as a GIF."""
    fold, env = space.get("fold"), space.get("env")
    if isinstance(fold, Fold):
        save_gif(fold, path, fps=FPS, seconds=3.0, hold=1.5, size=size)
        return
    assert env is not None
    assert isinstance(env.unwrapped, ChainEnv)
    frames: Sequence[Any] = env.render()
    for count in FRAMES:
        chosen = np.unique(np.linspace(0, len(frames) - 1, count).round().astype(int))
        images = [Image.fromarray(frames[k]).resize(size, Image.Resampling.LANCZOS) for k in chosen]
        write_gif(images, path, round(1000 / FPS), 1500)
        if path.stat().st_size <= BYTES:
            break


@cache
def package_digest() -> str:
    """Return a hash of all files that pictures and pages depend on."""
    digest = hashlib.sha256(Path(__file__).read_bytes())
    for path in sorted([*ROOT.glob("magfold_env/**/*"), *ROOT.glob("configs/**/*")]):
        if path.is_file() and "__pycache__" not in path.parts:
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def _copy(app: Sphinx, failed: Exception | None) -> None:
    """Copy the pictures and pages that the site shows, and remove others from the cache."""
    if failed is not None or app.builder.format != "html":
        return
    target = Path(app.outdir) / FOLDER
    shutil.rmtree(target, ignore_errors=True)
    target.mkdir()
    shown = (page.get("moving", "").split() for page in app.env.metadata.values())
    wanted = {f"{name}.{kind}" for name in set().union(*shown) for kind in ("gif", "html")}
    for each in wanted:
        shutil.copyfile(CACHE / each, target / each)
    for path in CACHE.iterdir():
        if path.name not in wanted:
            path.unlink()


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the directive `moving-picture`."""
    app.add_directive("moving-picture", MovingPicture)
    app.connect("build-finished", _copy)
    return {"parallel_read_safe": False}
