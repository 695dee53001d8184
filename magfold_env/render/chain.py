"""Drawing a chain, its tube and its target on a canvas."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

from magfold_env.render import style
from magfold_env.render.canvas import Canvas, FloatArray
from magfold_env.render.touching import Touch
from magfold_env.scene import Scene
from magfold_env.shapes import centres

BoolArray = npt.NDArray[np.bool_]

_NORMALS = np.deg2rad([45.0, 135.0, -135.0, -45.0])  # of the faces, from the heading
_LEGIBLE = 6.0  # px: below this height letters are left out
_TUBE_MARGIN = 0.5  # diagonals of tube drawn beyond the last component still in it


def draw_chain(
    canvas: Canvas, scene: Scene, angles: FloatArray, base: FloatArray, loaded: BoolArray
) -> None:
    """Draw casings with their numbers, magnets with the letters of their poles, and hinges.

    A face that the sequence leaves without a magnet stays bare.

    Parameters
    ----------
    canvas
        What to draw on.
    scene
        Gives the casing, the magnets and the sequence.
    angles
        Absolute headings [rad], shape (n,).
    base
        Component 1's outer hinge [m], shape (2,).
    loaded
        Which components have their magnets; the others' places are drawn empty, shape (n,).
    """
    side = scene.casing.side
    middles = centres(angles, side=side, base=base)
    for k, middle in enumerate(middles):
        corners = square(middle, angles[k], side)
        canvas.polygon(
            corners, style.CASING, style.CASING_EDGE, max(1.0, 0.012 * side * canvas.scale)
        )
        if scene.magnets is not None:
            _draw_magnets(canvas, scene, middle, angles[k], scene.sequence[k] if loaded[k] else "")
        canvas.label(str(k + 1), middle, 0.24 * side, style.INK)
    along = 0.5 * scene.casing.diagonal * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    for hinge in (middles + along)[:-1]:
        canvas.disc(hinge, 0.055 * side, style.CASING_EDGE)
    if scene.mount == "pinned":
        canvas.disc(base, 0.11 * side, style.FLOOR, style.INK, width=0.04 * side * canvas.scale)


def square(middle: FloatArray, heading: float, side: float) -> FloatArray:
    """Return the corners of a casing [m], shape (4, 2): along and across its heading."""
    turns = heading + np.deg2rad([0.0, 90.0, 180.0, 270.0])
    return middle + side * np.sqrt(0.5) * np.stack([np.cos(turns), np.sin(turns)], axis=1)


def _draw_magnets(
    canvas: Canvas, scene: Scene, middle: FloatArray, heading: float, poles: str
) -> None:
    magnets = scene.magnets
    assert magnets is not None  # the caller's check
    width, thickness = magnets.by_face("width"), magnets.by_face("thickness")
    depth = scene.casing.side / 2 - magnets.by_face("inset") - thickness / 2
    for face, turn in enumerate(heading + _NORMALS):
        letter = poles[face] if poles else ""
        if letter == "-":
            continue
        normal = np.array([np.cos(turn), np.sin(turn)])
        across = np.array([-normal[1], normal[0]]) * width[face] / 2
        through = normal * thickness[face] / 2
        place = middle + depth[face] * normal
        block = [
            place + across + through,
            place - across + through,
            place - across - through,
            place + across - through,
        ]
        if not letter:
            canvas.polygon(block, style.EMPTY, style.FAINT, width=0.7)
            continue
        canvas.polygon(block, style.NORTH if letter == "N" else style.SOUTH)
        height = 0.9 * thickness[face]
        if height * canvas.scale >= _LEGIBLE:
            canvas.label(letter, place, height, style.LETTER)


def draw_tube(canvas: Canvas, scene: Scene, angles: FloatArray, base: FloatArray) -> None:
    """Draw the tube that ends at the origin, as long as what is still in it."""
    inner, wall = scene.bore / 2, scene.feed.wall
    diagonal = scene.casing.diagonal
    rear = float(centres(angles, side=scene.casing.side, base=base)[:, 0].min())
    end = min(rear - diagonal / 2, -2 * diagonal) - _TUBE_MARGIN * diagonal
    canvas.polygon([(end, -inner), (0, -inner), (0, inner), (end, inner)], style.BORE)
    for y in (inner, -inner - wall):
        canvas.polygon([(end, y), (0, y), (0, y + wall), (end, y + wall)], style.TUBE)


def draw_ghost(canvas: Canvas, angles: FloatArray, middles: FloatArray, side: float) -> None:
    """Draw translucent casings at `middles` [m], shape (n, 2): a shape that is wanted."""
    for middle, heading in zip(middles, angles, strict=True):
        canvas.polygon(square(middle, heading, side), style.GHOST, style.GHOST_EDGE, width=1.2)


def draw_conflicts(
    canvas: Canvas, middles: FloatArray, side: float, pairs: Iterable[tuple[int, int]]
) -> None:
    """Ring the places where equal poles touch.

    Parameters
    ----------
    canvas
        What to draw on.
    middles
        Centres of the components [m], shape (n, 2).
    side
        Edge length of a casing [m].
    pairs
        Numbers of the components that touch, counted from 1.
    """
    for first, second in pairs:
        between = (middles[first - 1] + middles[second - 1]) / 2
        canvas.disc(between, 0.36 * side, None, style.CONFLICT, width=0.07 * side * canvas.scale)


def draw_touches(canvas: Canvas, scene: Scene, found: Iterable[Touch]) -> None:
    """Draw bars where faces touch, in a warning's colour where their poles are equal.

    Parameters
    ----------
    canvas
        What to draw on.
    scene
        Gives the casing and the poles.
    found
        `magfold_env.render.touching.touches`.
    """
    for touch in found:
        (i, a), (j, b) = touch.first, touch.second
        poles = scene.sequence[i][a], scene.sequence[j][b]
        equal = poles[0] == poles[1] and "-" not in poles
        width = max(2.0, 0.09 * scene.casing.side * canvas.scale)
        canvas.line(touch.ends, style.CONFLICT if equal else style.GOOD, width)


def draw_held(canvas: Canvas, middles: FloatArray, side: float) -> None:
    """Ring the numbers of components that friction holds, at `middles` [m], shape (k, 2)."""
    for middle in middles:
        canvas.disc(middle, 0.2 * side, None, style.HELD, width=0.03 * side * canvas.scale)


def draw_marked(canvas: Canvas, middle: FloatArray, heading: float, side: float) -> None:
    """Outline the casing at `middle` [m] whose magnets are being chosen; number its faces."""
    width = max(2.0, 0.06 * side * canvas.scale)
    canvas.polygon(square(middle, heading, side), None, style.MARKED, width)
    for face, turn in enumerate(heading + _NORMALS):
        place = middle + 0.62 * side * np.array([np.cos(turn), np.sin(turn)])
        canvas.label(str(face + 1), place, 0.2 * side, style.MARKED)
