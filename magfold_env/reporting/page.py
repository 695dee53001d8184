"""Self-contained HTML pages of results, with texts, tables, pictures and playable motions."""

import struct
from base64 import b64encode
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any, Literal, NamedTuple

import jinja2

from magfold_env.files import write_text
from magfold_env.reporting.plotting import DPI
from magfold_env.reporting.tables import Table, cell_text

Tone = Literal["good", "bad", "plain"]

PNG_START = b"\x89PNG\r\n\x1a\n"
CSS_DPI = 96


class Picture(NamedTuple):
    """A PNG file, which becomes part of the page, and its caption."""

    path: Path
    caption: str = ""

    @property
    def content(self) -> bytes:
        """Content of the file, which must be a PNG file."""
        content = self.path.read_bytes()
        if not content.startswith(PNG_START):
            raise ValueError(f"{self.path}: is not a picture; must be a PNG file")
        return content

    @property
    def base64(self) -> str:
        """Content of the file as Base64 text."""
        return b64encode(self.content).decode("ascii")

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in CSS pixels, 96 per inch."""
        width, height = struct.unpack(">II", self.content[16:24])  # of the first chunk, IHDR
        return round(width * CSS_DPI / DPI), round(height * CSS_DPI / DPI)


class Entries(NamedTuple):
    """Short texts, each with a short label."""

    texts: Mapping[str, str]


class Points(NamedTuple):
    """A list of sentences."""

    sentences: Sequence[str]


class Verdict(NamedTuple):
    """The verdict of a comparison in one word, and a sentence that explains it."""

    word: str
    sentence: str
    tone: Tone = "plain"
    more: Sequence[str] = ()
    """Further sentences, one per line, in a collapsed block."""


class Frame(NamedTuple):
    """A self-contained page that is embedded in another page."""

    title: str
    page: str


class Details(NamedTuple):
    """Collapsible blocks below a summary."""

    summary: str
    blocks: Sequence["Block"]
    group: str = ""
    """Name of a group of collapsible blocks, only one of which is open at a time."""
    unfolded: bool = False
    """Whether the block is open at first."""


Block = str | Picture | Entries | Points | Verdict | Table | Frame | Details
"""A part of a section. Plain text becomes a paragraph; Markup is inserted as HTML."""


class Section(NamedTuple):
    """A part of the page with a heading, listed in the page's contents."""

    title: str
    blocks: Sequence[Block]


class Page(NamedTuple):
    """A page with leading blocks, sections, and the origin of its numbers."""

    title: str
    sections: Sequence[Section]
    lead: Sequence[Block] = ()
    provenance: Mapping[str, str] = {}
    """Facts such as machine, versions and commit, which are shown at the end."""


def write_page(page: Page, path: str | Path) -> None:
    """Write a page to one file, through a temporary file.

    Raises
    ------
    FileNotFoundError
        If a picture, or the file's folder, does not exist.
    ValueError
        If a picture is not a PNG file.
    """
    write_text(path, render(page))


def render(page: Page) -> str:
    """Return a page as HTML text with embedded pictures; see `write_page`."""
    return _template().render(page=page)


def fragment(blocks: Sequence[Block]) -> str:
    """Return blocks as HTML without a page around them, for notebooks."""
    module: Any = _template().make_module({"page": Page("", ())})
    return str(module.show(blocks)).strip()


@cache
def _template() -> jinja2.Template:
    environment: Any = jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).parent),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    environment.globals["cell_text"] = cell_text
    return environment.get_template("page.html")
