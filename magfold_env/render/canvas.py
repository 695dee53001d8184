"""A canvas with coordinates in metres, drawn enlarged and then reduced to smooth edges."""

import math
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Literal, NamedTuple, Self

import numpy as np
import numpy.typing as npt
from PIL import Image, ImageDraw, ImageFont

from magfold_env.files import replacing
from magfold_env.render.style import FLOOR, Colour
from magfold_env.shapes import FloatArray

Size = tuple[int, int]

_OVERSAMPLING = 3


class View(NamedTuple):
    """A rectangle in the plane [m]."""

    left: float
    right: float
    bottom: float
    top: float

    @classmethod
    def around(cls, points: FloatArray, room: float) -> Self:
        """Return the view that contains points [m], shape (m, 2), with a margin of `room` [m]."""
        (left, bottom), (right, top) = points.min(axis=0) - room, points.max(axis=0) + room
        return cls(float(left), float(right), float(bottom), float(top))

    def joined(self, other: Self) -> Self:
        """Return the smallest view that contains this view and another one."""
        return self._replace(
            left=min(self.left, other.left),
            right=max(self.right, other.right),
            bottom=min(self.bottom, other.bottom),
            top=max(self.top, other.top),
        )


class Canvas:
    """A picture of part of the plane, with y upwards and equal scales in both directions.

    The picture has the width and height `size` [px] and is centred on `view` [m]. It shows more of
    the plane than the view if their aspect ratios differ.
    """

    def __init__(self, view: View, size: Size, background: Colour = FLOOR) -> None:
        self.size = size
        width, height = size
        self.scale = min(width / (view.right - view.left), height / (view.top - view.bottom))
        """Pixels per metre."""
        self._middle = np.array([view.left + view.right, view.bottom + view.top]) / 2
        self._image = Image.new("RGB", (width * _OVERSAMPLING, height * _OVERSAMPLING), background)
        self._draw = ImageDraw.Draw(self._image, "RGBA")  # RGBA: colours may be translucent

    def polygon(
        self,
        points: npt.ArrayLike,
        fill: Colour | None,
        edge: Colour | None = None,
        width: float = 1,
    ) -> None:
        """Draw a polygon with corners `points` [m], shape (k, 2), and an edge `width` px wide."""
        corners = self._pixels(points)
        outline = max(1, round(width * _OVERSAMPLING))
        self._draw.polygon(corners, fill=fill, outline=edge, width=outline)

    def line(self, points: npt.ArrayLike, colour: Colour, width: float) -> None:
        """Draw a line through `points` [m], shape (k, 2), `width` px wide."""
        self._draw.line(self._pixels(points), fill=colour, width=round(width * _OVERSAMPLING))

    def disc(
        self,
        centre: npt.ArrayLike,
        radius: float,
        fill: Colour | None,
        edge: Colour | None = None,
        width: float = 1,
    ) -> None:
        """Draw a disc with a `centre` and a `radius` [m], and with an edge `width` px wide."""
        ((x, y),) = self._pixels(np.reshape(centre, (1, 2)))
        r = radius * self.scale * _OVERSAMPLING
        box = (x - r, y - r, x + r, y + r)
        self._draw.ellipse(box, fill=fill, outline=edge, width=round(width * _OVERSAMPLING))

    def label(self, text: str, centre: npt.ArrayLike, height: float, colour: Colour) -> None:
        """Write upright `text` with a `height` [m], centred at `centre` [m]."""
        ((x, y),) = self._pixels(np.reshape(centre, (1, 2)))
        self._write(text, (x, y), height * self.scale, colour, "mm")

    def note(
        self,
        text: str,
        place: tuple[float, float],
        height: float,
        colour: Colour,
        anchor: Literal["la", "ma", "ra", "ld", "md", "rd"] = "la",
    ) -> None:
        """Write `text`, `height` px high, at a `place` [px] relative to the top left corner."""
        x, y = place
        self._write(text, (x * _OVERSAMPLING, y * _OVERSAMPLING), height, colour, anchor)

    def bar(self, right_end: tuple[float, float], length: float, colour: Colour) -> None:
        """Draw a horizontal bar, `length` [m] long, that ends at a point [px] of the picture."""
        x, y = right_end
        left = x - length * self.scale
        points = [(left * _OVERSAMPLING, y * _OVERSAMPLING), (x * _OVERSAMPLING, y * _OVERSAMPLING)]
        self._draw.line(points, fill=colour, width=2 * _OVERSAMPLING)

    def shade(
        self, corner: tuple[float, float], opposite: tuple[float, float], colour: Colour
    ) -> None:
        """Fill a rectangle between two opposite corners [px]."""
        box = [(x * _OVERSAMPLING, y * _OVERSAMPLING) for x, y in (corner, opposite)]
        self._draw.rectangle(box, fill=colour)

    def arrow(self, tail: npt.ArrayLike, tip: npt.ArrayLike, colour: Colour, width: float) -> None:
        """Draw an arrow between two points [px], with a shaft `width` px wide."""
        start, end = (np.asarray(p, dtype=np.float64) * _OVERSAMPLING for p in (tail, tip))
        along = (end - start) / np.hypot(*(end - start)) * width * _OVERSAMPLING
        across = np.array([-along[1], along[0]])
        neck = end - 4.0 * along
        outline = [
            *(start + 0.5 * across, neck + 0.5 * across, neck + 1.6 * across, end),
            *(neck - 1.6 * across, neck - 0.5 * across, start - 0.5 * across),
        ]
        self._draw.polygon([(float(x), float(y)) for x, y in outline], fill=colour)

    def image(self) -> Image.Image:
        """Return the finished RGB picture in the requested size."""
        return self._image.reduce(_OVERSAMPLING)

    def _write(
        self, text: str, place: tuple[float, float], height: float, colour: Colour, anchor: str
    ) -> None:
        font = _font(max(1, round(height * _OVERSAMPLING)))
        self._draw.text(place, text, fill=colour, font=font, anchor=anchor)

    def _pixels(self, points: npt.ArrayLike) -> list[tuple[float, float]]:
        away = (np.asarray(points, dtype=np.float64) - self._middle) * self.scale * [1.0, -1.0]
        placed = (away + np.array(self.size) / 2) * _OVERSAMPLING
        return [(float(x), float(y)) for x, y in placed]


def tiled(images: Sequence[Image.Image], columns: int) -> Image.Image:
    """Return a sheet of pictures of equal size, placed row by row."""
    width, height = images[0].size
    sheet = Image.new("RGB", (columns * width, math.ceil(len(images) / columns) * height), FLOOR)
    for k, image in enumerate(images):
        sheet.paste(image, (k % columns * width, k // columns * height))
    return sheet


def save_image(image: Image.Image, path: str | Path) -> None:
    """Write a picture as PNG through a temporary file."""
    with replacing(path) as temporary:
        image.save(temporary, format="PNG", optimize=True)


@cache
def _font(size: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    return ImageFont.load_default(size)  # the font that comes with Pillow
