"""One self-contained HTML page for results: prose, tables, pictures, pages that play something.

Nothing comes from elsewhere.
"""

import html
import re
from base64 import b64encode
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from string import Template
from typing import Literal

from magfold_env.files import write_text
from magfold_env.reporting.tables import Table, cell_text

Tone = Literal["good", "bad", "plain"]

PNG_START = b"\x89PNG\r\n\x1a\n"


@dataclass(frozen=True)
class Picture:
    """A PNG file, which becomes part of the page, and what to say below it."""

    path: Path
    caption: str = ""


@dataclass(frozen=True)
class Entries:
    """Short texts, each with a word or two in front of it."""

    texts: Mapping[str, str]


@dataclass(frozen=True)
class Points:
    """A list of sentences."""

    sentences: Sequence[str]


@dataclass(frozen=True)
class Verdict:
    """What a comparison came to, in a word, and the sentence that says why."""

    word: str
    sentence: str
    tone: Tone = "plain"
    more: Sequence[str] = ()
    """Further sentences, each a line of its own."""


@dataclass(frozen=True)
class Folded:
    """Pages that are whole in themselves, by what is said of each; one at a time is unfolded."""

    pages: Mapping[str, str]


Block = str | Picture | Entries | Points | Verdict | Table | Folded
"""What a section is made of; a plain text is a paragraph."""


@dataclass(frozen=True)
class Section:
    """A part of the page with a heading, listed in the page's contents."""

    title: str
    blocks: Sequence[Block]


@dataclass(frozen=True)
class Page:
    """A page: an introduction, sections, and how its numbers were made."""

    title: str
    sections: Sequence[Section]
    lead: Sequence[Block] = ()
    provenance: Mapping[str, str] = field(default_factory=dict[str, str])
    """Machine, versions, commit and the like, shown at the end."""


def write_page(page: Page, path: str | Path) -> None:
    """Write a page to one file, under a temporary name first.

    Raises
    ------
    FileNotFoundError
        If a picture, or the file's folder, does not exist.
    ValueError
        If a picture is not a PNG file.
    """
    write_text(path, render(page))


def render(page: Page) -> str:
    """Return a page as HTML text, its pictures inside; see `write_page`."""
    names = [f"s{k}-{_slug(section.title)}" for k, section in enumerate(page.sections, start=1)]
    named = list(zip(names, page.sections, strict=True))
    contents = "".join(f'<li><a href="#{n}">{_escaped(s.title)}</a></li>' for n, s in named)
    template = Path(__file__).with_suffix(".html").read_text(encoding="utf-8")
    folded = any(isinstance(block, Folded) for s in page.sections for block in s.blocks)
    return Template(template).substitute(
        title=_escaped(page.title),
        # What is unfolded has its page's own scripts, and is bound to this page's policy too.
        scripts="; script-src 'unsafe-inline'; frame-src 'self'" if folded else "",
        lead=_blocks(page.lead),
        contents=f"<nav><ol>{contents}</ol></nav>" if len(page.sections) > 1 else "",
        sections="\n".join(
            f'<section id="{n}">\n<h2>{_escaped(s.title)}</h2>\n{_blocks(s.blocks)}\n</section>'
            for n, s in named
        ),
        provenance=f"<section>\n<h2>How it was made</h2>\n{_entries(page.provenance)}\n</section>"
        if page.provenance
        else "",
    )


def _blocks(blocks: Sequence[Block]) -> str:
    return "\n".join(_block(block) for block in blocks)


def _block(block: Block) -> str:  # noqa: PLR0911 - one a kind of block
    match block:
        case str():
            return f"<p>{_escaped(block)}</p>"
        case Picture():
            return _picture(block)
        case Entries():
            return _entries(block.texts)
        case Points():
            items = "".join(f"<li>{_escaped(text)}</li>" for text in block.sentences)
            return f"<ul>{items}</ul>"
        case Verdict():
            badge = f'<strong class="badge">{_escaped(block.word)}</strong>'
            more = "".join(f"<p>{_escaped(text)}</p>" for text in block.more)
            first = f"<p>{badge} {_escaped(block.sentence)}</p>"
            return f'<div class="verdict {block.tone}">{first}{more}</div>'
        case Table():
            return _table(block)
        case Folded():
            return _folded(block)


def _picture(picture: Picture) -> str:
    content = picture.path.read_bytes()
    if not content.startswith(PNG_START):
        raise ValueError(f"{picture.path}: is not a picture; must be a PNG file")
    data = b64encode(content).decode("ascii")
    caption = _escaped(picture.caption)
    below = f"<figcaption>{caption}</figcaption>" if caption else ""
    image = f'<img alt="{caption}" src="data:image/png;base64,{data}">'
    return f"<figure>{image}{below}</figure>"


def _entries(texts: Mapping[str, str]) -> str:
    items = (f"<dt>{_escaped(k)}</dt><dd>{_escaped(text)}</dd>" for k, text in texts.items())
    return f"<dl>{''.join(items)}</dl>"


def _table(table: Table) -> str:
    """Return a table; a column is ranged right if its first cell is a number."""
    if not table.rows:
        return f"<p>{_escaped(table.title)}: nothing.</p>"
    first = table.rows[0]
    kinds = [' class="number"' if not isinstance(cell, str) else "" for cell in first.values()]
    head = _row("th", kinds, list(first))
    body = "".join(_row("td", kinds, [cell_text(c) for c in r.values()]) for r in table.rows)
    caption = f"<caption>{_escaped(table.title)}</caption>"
    return (
        f'<div class="wide"><table>{caption}<thead>{head}</thead>'
        f"<tbody>{body}</tbody></table></div>"
    )


def _folded(folded: Folded) -> str:
    return "".join(
        f'<details name="folded"><summary>{_escaped(text)}</summary><iframe loading="lazy" '
        f'title="{_escaped(text)}" srcdoc="{_escaped(page)}"></iframe></details>'
        for text, page in folded.pages.items()
    )


def _row(tag: str, kinds: Sequence[str], texts: Sequence[str]) -> str:
    cells = (f"<{tag}{k}>{_escaped(t)}</{tag}>" for k, t in zip(kinds, texts, strict=True))
    return f"<tr>{''.join(cells)}</tr>"


def _slug(title: str) -> str:
    return re.sub(r"[^a-z0-9]+", "-", title.lower()).strip("-")


_escaped = html.escape
