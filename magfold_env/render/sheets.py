"""A4 sheets with coordinates in millimetres. Needs matplotlib."""

import importlib
import io
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from PIL import Image

from magfold_env.files import replacing
from magfold_env.reporting.plotting import INK, figure_class

WIDTH, HEIGHT = 210.0, 297.0  # of A4 [mm]
MARGIN = 14.0  # [mm]
SUFFIXES = (".pdf", ".png")
SMALLEST = 8.0  # text [pt]

_INCH = 25.4  # [mm]
_DPI = 150  # of a PNG
_FOOT = 8.0  # height of the footer of every page [mm]
_RULER = 50.0  # [mm]

Axis = Any  # matplotlib has no types


class Block(NamedTuple):
    """A part of a sheet that stays on one page and has its full width."""

    height: float
    """Height [mm]."""
    draw: Callable[[Axis, float], None]
    """Draws the block on an axis in mm, below a given height above the page's lower edge."""


def check_suffix(path: str | Path) -> None:
    """Refuse a file that is not one of `SUFFIXES`.

    Raises
    ------
    ValueError
        If it is not.
    """
    if Path(path).suffix.lower() not in SUFFIXES:
        raise ValueError(f"{str(path)!r} is not allowed; must end in {' or '.join(SUFFIXES)}")


def save_pages(blocks: Sequence[Block], path: str | Path) -> None:
    """Write blocks one below the other, as pages of a PDF or one tall PNG according to the suffix.

    A page is broken before a block that does not fit on it. See `check_suffix`.
    """
    pages = _pages(blocks)
    figures = [_figure(page, k + 1, len(pages)) for k, page in enumerate(pages)]
    with replacing(path) as temporary:
        if temporary.suffix.lower() == ".pdf":
            _save_pdf(figures, temporary)
        else:
            _save_png(figures, temporary)


def text(axis: Axis, x: float, y: float, words: str, size: float = 8.5, **style: Any) -> None:
    """Write text of `size` pt with the top of its first line at a place [mm] unless styled."""
    axis.text(x, y, words, **{"fontsize": size, "color": INK, "va": "top", **style})


def _pages(blocks: Sequence[Block]) -> list[list[Block]]:
    pages: list[list[Block]] = [[]]
    left = HEIGHT - 2.0 * MARGIN - _FOOT
    room = left
    for block in blocks:
        if block.height > room and pages[-1]:
            pages.append([])
            room = left
        pages[-1].append(block)
        room -= block.height
    return pages


def _figure(blocks: Sequence[Block], number: int, count: int) -> Any:
    figure = figure_class()(figsize=(WIDTH / _INCH, HEIGHT / _INCH))
    axis = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axis.set(xlim=(0.0, WIDTH), ylim=(0.0, HEIGHT))
    axis.set_axis_off()
    top = HEIGHT - MARGIN
    for block in blocks:
        block.draw(axis, top)
        top -= block.height
    ends = [MARGIN, MARGIN + _RULER]
    axis.plot(ends, [MARGIN, MARGIN], color=INK, linewidth=1.0, marker="|", markersize=5.0)
    words = f"{_RULER:.0f} mm if printed at 100 %"
    text(axis, MARGIN + _RULER + 3.0, MARGIN, words, SMALLEST, va="center")
    words = f"page {number} of {count}"
    text(axis, WIDTH - MARGIN, MARGIN, words, SMALLEST, va="center", ha="right")
    return figure


def _save_pdf(figures: Sequence[Any], path: Path) -> None:
    backend = importlib.import_module("matplotlib.backends.backend_pdf")
    # No date, so that equal sheets are equal files.
    with backend.PdfPages(path, metadata={"CreationDate": None}) as pdf:
        for figure in figures:
            pdf.savefig(figure)


def _save_png(figures: Sequence[Any], path: Path) -> None:
    images: list[Image.Image] = []
    for figure in figures:
        buffer = io.BytesIO()
        figure.savefig(buffer, format="png", dpi=_DPI, facecolor="white")
        images.append(Image.open(buffer).convert("RGB"))
    width, height = images[0].size
    tall = Image.new("RGB", (width, height * len(images)))
    for k, image in enumerate(images):
        tall.paste(image, (0, k * height))
    tall.save(path, format="PNG", optimize=True, dpi=(_DPI, _DPI))
