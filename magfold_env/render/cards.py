"""Cards of single components and pictures of whole folds, drawn in millimetres on paper."""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from magfold_env.render import style
from magfold_env.render.chain import square
from magfold_env.render.sheets import Axis, text
from magfold_env.reporting.plotting import GRID, INK
from magfold_env.scene import FACES, Scene
from magfold_env.shapes import centres

FloatArray = npt.NDArray[np.float64]

WIDTH, HEIGHT = 60.0, 60.0  # of a card [mm]

_SCALES = (50.0, 20.0, 10.0, 5.0, 4.0, 3.0, 2.5, 2.0, 1.5, 1.0, 0.5, 0.2, 0.1, 0.05)
_DIAGONAL = 36.0  # longest of a casing on a card [mm]
_NORMALS = np.deg2rad([45.0, 135.0, -135.0, -45.0])  # of the faces, from the heading
_FAINT = "#5f656d"
_POINT = 25.4 / 72.0  # [mm]


def card_scale(scene: Scene) -> float:
    """Return how much larger than real the casings on cards are drawn."""
    fitting = (s for s in _SCALES if 1e3 * scene.casing.diagonal * s <= _DIAGONAL)
    return next(fitting, _DIAGONAL / (1e3 * scene.casing.diagonal))


def draw_card(
    axis: Axis, corner: tuple[float, float], scene: Scene, k: int, names: Sequence[str]
) -> None:
    """Draw a component seen from above, heading to the right, with all its neighbours must know.

    Parameters
    ----------
    axis
        In mm.
    corner
        Upper left one of the card [mm].
    scene
        The chain.
    k
        Index of the component.
    names
        What the magnets behind its four faces are called; empty where nothing needs saying.
    """
    left, top = corner
    middle = np.array([left + WIDTH / 2.0, top - HEIGHT / 2.0 + 1.0])
    scale = 1e3 * card_scale(scene)
    frame = (left + 0.8, top - HEIGHT + 0.8, WIDTH - 1.6, HEIGHT - 1.6)
    _rectangle(axis, frame)
    text(axis, left + 3.5, top - 3.0, f"{k + 1}", 15.0, fontweight="bold")
    mass = f"{1e3 * scene.masses[k]:.3g} g" if np.ptp(scene.masses) > 0.0 else ""
    words = f"{scene.sequence[k]}  {mass}".strip()
    text(axis, left + WIDTH - 3.5, top - 3.8, words, 9.0, ha="right", family="monospace")
    _draw_component(axis, scene, k, 0.0, middle, scale)
    side = scene.casing.side * scale
    for f, pole in enumerate(scene.sequence[k]):
        normal = np.array([np.cos(_NORMALS[f]), np.sin(_NORMALS[f])])
        x, y = middle + (side / 2.0 + 4.6) * normal
        colour = _colour({"N": style.NORTH, "S": style.SOUTH}.get(pole, style.FAINT))
        sign = pole if pole != "-" else "–"
        outside = {"ha": "left" if normal[0] > 0 else "right", "va": "center"}
        inwards = -2.0 * np.sign(normal[0])
        text(axis, x + inwards, y + 1.2, sign, 15.0, color=colour, fontweight="bold", **outside)
        side_name = FACES[f] + (f" {names[f]}" if names[f] else "")
        words = side_name if pole != "-" else f"{FACES[f]} empty"
        text(axis, x + inwards, y - 2.6, words, 5.5, color=_FAINT, **outside)
    half = scene.casing.diagonal * scale / 2.0
    for end, neighbour in ((-1, k - 1), (1, k + 1)):
        words, aside = _hinge(scene, k, neighbour), "right" if end < 0 else "left"
        text(axis, middle[0] + end * (half + 1.8), middle[1], words, 6.0, va="center", ha=aside)
    if scene.mount == "tube":
        _draw_feed(axis, scene, middle[0], top - HEIGHT + 4.6)


def _hinge(scene: Scene, k: int, neighbour: int) -> str:
    if 0 <= neighbour < scene.n:
        return f"hinge\nto {neighbour + 1}"
    return "pinned" if scene.mount == "pinned" and k == 0 and neighbour < 0 else "free\nend"


def _draw_feed(axis: Axis, scene: Scene, x: float, y: float) -> None:
    way = -1.0 if scene.feed.direction == "forward" else 1.0
    arrow = {"arrowstyle": "-|>", "color": INK, "linewidth": 1.1}
    axis.annotate("", (x + 9.0 * way, y), (x - 3.0 * way, y), arrowprops=arrow)
    text(axis, x - 5.0 * way, y, "feed", 6.5, va="center", ha="right" if way > 0 else "left")


def draw_fold(
    axis: Axis, box: tuple[float, float, float, float], scene: Scene, angles: FloatArray
) -> None:
    """Draw a whole chain as large as a box allows.

    Parameters
    ----------
    axis
        In mm.
    box
        Left, bottom, width and height [mm].
    scene
        The chain.
    angles
        Its headings [rad], shape (n,).
    """
    left, bottom, width, height = box
    middles = centres(angles, side=scene.casing.side)
    extent = np.ptp(middles, axis=0) + scene.casing.diagonal
    scale = min(width / extent[0], height / extent[1], 1e3 * card_scale(scene))
    shift = (middles.min(axis=0) + middles.max(axis=0)) / 2.0
    places = (middles - shift) * scale + [left + width / 2.0, bottom + height / 2.0]
    for k, place in enumerate(places):
        _draw_component(axis, scene, k, float(angles[k]), place, scale)


def _draw_component(
    axis: Axis, scene: Scene, k: int, heading: float, middle: FloatArray, scale: float
) -> None:
    """Draw casing, magnets, number and hinges; `scale` is mm on paper per metre."""
    side = scene.casing.side * scale
    line = min(0.9, 0.05 * side)
    corners = square(middle, heading, side)
    _polygon(axis, corners, style.CASING, style.CASING_EDGE, line)
    for f, pole in enumerate(scene.sequence[k] if scene.magnets is not None else ""):
        if pole != "-":
            block = _magnet(scene, f, heading, scale) + middle
            _polygon(axis, block, style.NORTH if pole == "N" else style.SOUTH)
    circle = importlib.import_module("matplotlib.patches").Circle
    for end, inner in ((corners[2], k > 0), (corners[0], k < scene.n - 1)):
        if inner:
            axis.add_patch(circle(end, 0.055 * side, color=_colour(style.CASING_EDGE), linewidth=0))
    size = 0.26 * side / _POINT
    inside = {"ha": "center", "va": "center_baseline", "fontweight": "bold"}
    text(axis, middle[0], middle[1], f"{k + 1}", size, **inside)


def _magnet(scene: Scene, f: int, heading: float, scale: float) -> FloatArray:
    """Return the corners of the magnet behind a face, from the casing's centre [mm], (4, 2)."""
    magnets = scene.magnets
    assert magnets is not None  # the caller's check
    outer = scene.casing.side / 2.0 - magnets.by_face("inset")[f]
    inner = outer - magnets.by_face("thickness")[f]
    half = magnets.by_face("width")[f] / 2.0
    turn = heading + _NORMALS[f]
    normal, across = np.array([np.cos(turn), np.sin(turn)]), np.array([-np.sin(turn), np.cos(turn)])
    ends = ((outer, half), (outer, -half), (inner, -half), (inner, half))
    return scale * np.array([depth * normal + aside * across for depth, aside in ends])


def _polygon(
    axis: Axis,
    corners: FloatArray,
    fill: style.Colour,
    edge: style.Colour | None = None,
    line: float = 0.0,
) -> None:
    polygon = importlib.import_module("matplotlib.patches").Polygon
    colour = "none" if edge is None else _colour(edge)
    axis.add_patch(polygon(corners, facecolor=_colour(fill), edgecolor=colour, linewidth=line))


def _rectangle(axis: Axis, box: tuple[float, float, float, float]) -> None:
    left, bottom, width, height = box
    patch = importlib.import_module("matplotlib.patches").Rectangle
    axis.add_patch(patch((left, bottom), width, height, fill=False, edgecolor=GRID, linewidth=0.8))


def _colour(colour: style.Colour) -> Any:
    return tuple(channel / 255.0 for channel in colour)
