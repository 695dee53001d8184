"""Drawings of a chain, its contacts and its surroundings on a canvas."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from magfold_env.render import style
from magfold_env.render.canvas import Canvas, View
from magfold_env.scene import FixedMagnet, Scene
from magfold_env.shapes import BoolArray, FloatArray, centres

FACE_NORMALS = np.deg2rad([45.0, 135.0, -135.0, -45.0])  # relative to the heading [rad]
_LEGIBLE = 6.0  # smallest height of letters [px]; smaller letters are omitted
_TUBE_MARGIN = 0.5  # length of tube drawn beyond the last component in it, in diagonals
_GAP = 0.02  # largest gap between faces that touch, in sides
_SLANT = 0.05  # largest angle between faces that touch [rad]; equals a folded joint's tolerance
_SHARED = 0.1  # shortest contact drawn, in sides; excludes hinges, which are points
_ROOM = 0.15  # margin around a fixed body, relative to its longest side
_WIDEST = 3.0  # largest widening of a view for fixed bodies; more would make the chain tiny
_ARROW = 3.2  # length of the field's arrow, in heights of the text


def draw_chain(
    canvas: Canvas, scene: Scene, angles: FloatArray, base: FloatArray, loaded: BoolArray
) -> None:
    """Draw casings with numbers, magnets with the letters of their poles, and hinges.

    ``angles`` are the headings [rad], shape (n,), and ``base`` is component 1's outer hinge [m],
    shape (2,). Faces without magnets in the sequence stay bare. Components that are not ``loaded``,
    shape (n,), are drawn with empty places for their magnets.
    """
    side = scene.casing.side
    middles = centres(angles, side=side, base=base)
    width = max(1.0, 0.012 * side * canvas.scale)
    for k, middle in enumerate(middles):
        canvas.polygon(square(middle, angles[k], side), style.CASING, style.CASING_EDGE, width)
        if scene.magnets is not None:
            _draw_magnets(canvas, scene, middle, angles[k], scene.sequence[k] if loaded[k] else "")
        canvas.label(str(k + 1), middle, 0.24 * side, style.INK)
    along = 0.5 * scene.casing.diagonal * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    for hinge in (middles + along)[:-1]:
        canvas.disc(hinge, 0.055 * side, style.CASING_EDGE)
    if scene.mount == "pinned":
        canvas.disc(base, 0.11 * side, style.FLOOR, style.INK, width=0.04 * side * canvas.scale)


def square(middle: FloatArray, heading: float, side: float) -> FloatArray:
    """Return a casing's corners [m], shape (4, 2), anticlockwise from its front corner."""
    turns = heading + np.deg2rad([0.0, 90.0, 180.0, 270.0])
    return middle + side * np.sqrt(0.5) * np.stack([np.cos(turns), np.sin(turns)], axis=1)


def magnet_block(
    scene: Scene, face: int, heading: float, middle: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the centre (2,) and the corners (4, 2) of the magnet behind a casing's face [m]."""
    magnets = scene.magnets
    assert magnets is not None  # the caller checks this
    inset, thickness = magnets.by_face("inset")[face], magnets.by_face("thickness")[face]
    turn = heading + FACE_NORMALS[face]
    normal = np.array([np.cos(turn), np.sin(turn)])
    across = np.array([-normal[1], normal[0]]) * magnets.by_face("width")[face] / 2
    through = normal * thickness / 2
    place = middle + (scene.casing.side / 2 - inset - thickness / 2) * normal
    signs = ((1, 1), (-1, 1), (-1, -1), (1, -1))
    return place, np.array([place + a * across + b * through for a, b in signs])


def _draw_magnets(
    canvas: Canvas, scene: Scene, middle: FloatArray, heading: float, poles: str
) -> None:
    assert scene.magnets is not None  # the caller checks this
    for face, thickness in enumerate(scene.magnets.by_face("thickness")):
        letter = poles[face] if poles else ""
        if letter == "-":
            continue
        place, block = magnet_block(scene, face, heading, middle)
        if not letter:
            canvas.polygon(block, style.EMPTY, style.FAINT, width=0.7)
            continue
        canvas.polygon(block, style.NORTH if letter == "N" else style.SOUTH)
        if 0.9 * thickness * canvas.scale >= _LEGIBLE:
            canvas.label(letter, place, 0.9 * thickness, style.LETTER)


def _draw_tube(canvas: Canvas, scene: Scene, angles: FloatArray, base: FloatArray) -> None:
    """Draw the tube, with its mouth at the origin and long enough for the components in it."""
    inner, wall = scene.bore / 2, scene.feed.wall
    diagonal = scene.casing.diagonal
    rear = float(centres(angles, side=scene.casing.side, base=base)[:, 0].min())
    end = min(rear - diagonal / 2, -2 * diagonal) - _TUBE_MARGIN * diagonal
    canvas.polygon([(end, -inner), (0, -inner), (0, inner), (end, inner)], style.BORE)
    for y in (inner, -inner - wall):
        canvas.polygon([(end, y), (0, y), (0, y + wall), (end, y + wall)], style.TUBE)


def draw_ghost(canvas: Canvas, angles: FloatArray, middles: FloatArray, side: float) -> None:
    """Draw a target shape as translucent casings with centres `middles` [m], shape (n, 2)."""
    for middle, heading in zip(middles, angles, strict=True):
        canvas.polygon(square(middle, heading, side), style.GHOST, style.GHOST_EDGE, width=1.2)


def draw_conflicts(
    canvas: Canvas, middles: FloatArray, side: float, pairs: Iterable[tuple[int, int]]
) -> None:
    """Draw a ring between the components of each pair whose equal poles touch.

    ``pairs`` contains numbers of components, from 1; `middles`, shape (n, 2), their centres [m].
    """
    for first, second in pairs:
        between = (middles[first - 1] + middles[second - 1]) / 2
        canvas.disc(between, 0.36 * side, None, style.CONFLICT, width=0.07 * side * canvas.scale)


def draw_held(canvas: Canvas, middles: FloatArray, side: float) -> None:
    """Draw rings at the centres `middles` [m], shape (k, 2), of components that friction holds."""
    for middle in middles:
        canvas.disc(middle, 0.2 * side, None, style.HELD, width=0.03 * side * canvas.scale)


def draw_marked(canvas: Canvas, middle: FloatArray, heading: float, side: float) -> None:
    """Outline the casing at `middle` [m] whose magnets are being chosen, and number its faces."""
    width = max(2.0, 0.06 * side * canvas.scale)
    canvas.polygon(square(middle, heading, side), None, style.MARKED, width)
    for face, turn in enumerate(heading + FACE_NORMALS):
        place = middle + 0.62 * side * np.array([np.cos(turn), np.sin(turn)])
        canvas.label(str(face + 1), place, 0.2 * side, style.MARKED)


# --- faces that touch ------------------------------------------------------------------------


class Touch(NamedTuple):
    """Two faces in contact."""

    first: tuple[int, int]
    """Component and face of the first, counted from 0."""
    second: tuple[int, int]
    """Component and face of the second."""
    ends: FloatArray
    """Ends of the line along which the faces touch [m], shape (2, 2)."""


def touches(angles: FloatArray, base: FloatArray, side: float) -> list[Touch]:
    """Return the pairs of faces in contact; a corner that touches a face does not count.

    ``angles`` are headings [rad], shape (n,), and ``base`` is component 1's outer hinge [m], (2,).
    """
    turns = angles[:, None] + FACE_NORMALS
    normals = np.stack([np.cos(turns), np.sin(turns)], axis=-1)
    middles = centres(angles, side=side, base=base)
    faces = middles[:, None, :] + 0.5 * side * normals
    found: list[Touch] = []
    for i in range(len(angles)):
        for j in range(i + 1, len(angles)):
            if np.hypot(*(middles[j] - middles[i])) > 1.5 * side:
                continue
            opposed = normals[i] @ normals[j].T < -np.cos(_SLANT)
            for a, b in np.argwhere(opposed):
                normal, away = normals[i, a], faces[j, b] - faces[i, a]
                tangent = np.array([-normal[1], normal[0]])
                shift = float(away @ tangent)
                if abs(away @ normal) > _GAP * side or abs(shift) > (1.0 - _SHARED) * side:
                    continue
                reach = np.array([max(shift, 0.0) - side / 2, min(shift, 0.0) + side / 2])
                ends = faces[i, a] + reach[:, None] * tangent
                found.append(Touch((i, int(a)), (j, int(b)), ends))
    return found


def draw_touches(canvas: Canvas, scene: Scene, found: Iterable[Touch]) -> None:
    """Draw a bar where two faces touch, in a warning colour if their poles are equal."""
    for touch in found:
        (i, a), (j, b) = touch.first, touch.second
        poles = scene.sequence[i][a], scene.sequence[j][b]
        equal = poles[0] == poles[1] and "-" not in poles
        width = max(2.0, 0.09 * scene.casing.side * canvas.scale)
        canvas.line(touch.ends, style.CONFLICT if equal else style.GOOD, width)


# --- surroundings of a chain -----------------------------------------------------------------


def with_surroundings(scene: Scene, view: View) -> View:
    """Return a view that also contains the fixed magnet and obstacles if they are close enough."""
    magnet = scene.field.magnet if scene.field is not None else None
    extent = max(view.right - view.left, view.top - view.bottom)
    for each in (*scene.obstacles, *(() if magnet is None else (magnet.outline,))):
        wide = view.joined(View.around(each.corners, _ROOM * max(each.size)))
        grown = max(wide.right - wide.left, wide.top - wide.bottom)
        if grown <= _WIDEST * extent:
            view = wide
    return view


def draw_surroundings(
    canvas: Canvas, scene: Scene, angles: FloatArray, base: FloatArray, text: float
) -> None:
    """Draw obstacles, the tube and the external field; `text` is the height of letters [px].

    The arrays have the shapes that `draw_chain` describes.
    """
    for each in scene.obstacles:
        canvas.polygon(each.corners, style.TUBE)
    if scene.mount == "tube":
        _draw_tube(canvas, scene, angles, base)
    if scene.field is None:
        return
    if scene.field.magnet is not None:
        _draw_magnet(canvas, scene.field.magnet)
    if any(scene.field.uniform):
        _draw_arrow(canvas, np.array(scene.field.uniform), text)


def _draw_magnet(canvas: Canvas, magnet: FixedMagnet) -> None:
    north_right, north_left, south_left, south_right = magnet.outline.corners
    left, right = (north_left + south_left) / 2.0, (north_right + south_right) / 2.0
    halves = (
        ("N", style.NORTH, [north_right, north_left, left, right]),
        ("S", style.SOUTH, [left, south_left, south_right, right]),
    )
    height = 0.7 * min(magnet.thickness / 2.0, magnet.width)
    for letter, colour, corners in halves:
        canvas.polygon(corners, colour)
        canvas.label(letter, np.mean(corners, axis=0), height, style.LETTER)
    canvas.polygon(magnet.outline.corners, None, style.CASING_EDGE, width=1.5)


def _draw_arrow(canvas: Canvas, field: np.ndarray, text: float) -> None:
    """Draw the direction and strength of a uniform field [T] in the lower left corner."""
    length = _ARROW * text
    strength = float(np.hypot(*field))
    along = length / strength * field * [1.0, -1.0]  # y points downwards in pixels
    middle = np.array([0.8 * text + length / 2.0, canvas.size[1] - 2.2 * text - length / 2.0])
    canvas.arrow(middle - along / 2.0, middle + along / 2.0, style.FIELD, width=0.14 * text)
    place = (0.8 * text, canvas.size[1] - 0.9 * text)
    canvas.note(f"{1e3 * strength:.3g} mT", place, 0.75 * text, style.FIELD, "ld")
