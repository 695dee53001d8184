"""Drawing what acts on a chain from outside: a fixed magnet, and an even field's direction."""

from __future__ import annotations

import numpy as np

from magfold_env.render import style
from magfold_env.render.canvas import Canvas, View
from magfold_env.scene import FixedMagnet, Scene

_ROOM = 0.15  # of a fixed magnet's longest side, around it
_WIDEST = 3.0  # views: a magnet farther away is left out rather than the chain made tiny
_ARROW = 3.2  # heights of the text


def with_magnet(scene: Scene, view: View) -> View:
    """Return a view that holds the fixed magnet too, if there is one and it is not too far."""
    magnet = scene.field.magnet if scene.field is not None else None
    if magnet is None:
        return view
    room = _ROOM * max(magnet.width, magnet.thickness)
    (left, bottom), (right, top) = (
        magnet.corners.min(axis=0) - room,
        magnet.corners.max(axis=0) + room,
    )
    wide = view.joined(View(float(left), float(right), float(bottom), float(top)))
    extent = max(view.right - view.left, view.top - view.bottom)
    grown = max(wide.right - wide.left, wide.top - wide.bottom)
    return wide if grown <= _WIDEST * extent else view


def draw_field(canvas: Canvas, scene: Scene, text: float) -> None:
    """Draw a scene's external field, if it has one.

    Parameters
    ----------
    canvas
        What to draw on.
    scene
        Gives the field.
    text
        Height of text [px].
    """
    if scene.field is None:
        return
    if scene.field.magnet is not None:
        _draw_magnet(canvas, scene.field.magnet)
    if any(scene.field.uniform):
        _draw_arrow(canvas, np.array(scene.field.uniform), text)


def _draw_magnet(canvas: Canvas, magnet: FixedMagnet) -> None:
    north_right, north_left, south_left, south_right = magnet.corners
    left, right = (north_left + south_left) / 2.0, (north_right + south_right) / 2.0
    halves = (
        ("N", style.NORTH, [north_right, north_left, left, right]),
        ("S", style.SOUTH, [left, south_left, south_right, right]),
    )
    height = 0.7 * min(magnet.thickness / 2.0, magnet.width)
    for letter, colour, corners in halves:
        canvas.polygon(corners, colour)
        canvas.label(letter, np.mean(corners, axis=0), height, style.LETTER)
    canvas.polygon(magnet.corners, None, style.CASING_EDGE, width=1.5)


def _draw_arrow(canvas: Canvas, field: np.ndarray, text: float) -> None:
    """Draw the direction of an even field [T] in the lower left corner, with its strength."""
    length = _ARROW * text
    strength = float(np.hypot(*field))
    along = length / strength * field * [1.0, -1.0]  # pixels count downwards
    middle = np.array([0.8 * text + length / 2.0, canvas.size[1] - 2.2 * text - length / 2.0])
    canvas.arrow(middle - along / 2.0, middle + along / 2.0, style.FIELD, width=0.14 * text)
    place = (0.8 * text, canvas.size[1] - 0.9 * text)
    canvas.note(f"{1e3 * strength:.3g} mT", place, 0.75 * text, style.FIELD, "ld")
