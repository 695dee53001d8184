"""The assembly sheet: instructions for building a chain, printable on A4."""

import math
import textwrap
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from magfold_env.fold import Fold, FoldStatus
from magfold_env.limit_loads import holding
from magfold_env.minimiser import Mode, minimise
from magfold_env.render import parts, style
from magfold_env.render.chain import FACE_NORMALS, magnet_block, square
from magfold_env.render.sheets import (
    MARGIN,
    SMALLEST,
    Axis,
    Block,
    check_suffix,
    save_pages,
    text,
)  # fmt: skip
from magfold_env.replay.data import WORDS
from magfold_env.reporting.plotting import GRID, INK, patch
from magfold_env.scene import FACES, Scene, SceneError
from magfold_env.shapes import FloatArray, centres, headings, word_to_angles

LONGEST = 24
"""Largest number of components for which energy minimisation takes seconds."""

_COLUMNS = 3
_LINE = 4.4  # [mm]
_LETTERS = 106  # of a line
_CAPITALS = 78  # of a line of poles
_NOTE = 34  # letters of a line under a fold's word
_FAINTEST = 6.0  # [pt] below which casings are drawn without their numbers
_PICTURE = 40.0  # height of a fold's picture [mm]
_ABOVE = 26.0  # of what is written above it [mm]
CARD = (60.0, 60.0)  # width and height [mm]

_SCALES = (50.0, 20.0, 10.0, 5.0, 4.0, 3.0, 2.5, 2.0, 1.5, 1.0, 0.5, 0.2, 0.1, 0.05)
_DIAGONAL = 36.0  # longest of a casing on a card [mm]
_FAINT = "#5f656d"
_POINT = 25.4 / 72.0  # [mm]
_UPRIGHT = math.pi / 4  # heading of component 1 with which the casings of a full fold stand upright


class Outcome(NamedTuple):
    """An expected fold and the reason for it."""

    title: str
    word: str
    note: str
    joints: FloatArray | None
    """Joint angles [rad], shape (n-1,); None if there is nothing to draw."""


def save_sheet(scene: Scene, fold: Fold, path: str | Path, title: str = "") -> None:
    """Write the assembly sheet of a chain: its components, its magnets and the folds to expect.

    Parameters
    ----------
    scene
        The scene to build, before its random draws.
    fold
        Its simulated fold.
    path
        A `.pdf`, or a `.png` with all pages below each other; written under a temporary name first.
    title
        Name of the chain.

    Raises
    ------
    ValueError
        If the path has another suffix.
    ImportError
        If matplotlib is not installed.
    """
    check_suffix(path)
    expected = [simulated(fold), *predicted(scene, fold.word)]
    found, where = parts.kinds(scene)
    names = [kind.name for kind in found]
    blocks = [Block(10.0, partial(_title, title=title)), *_facts(scene, fold, found)]
    blocks.append(Block(_ABOVE + _PICTURE + 2.0, partial(_folds, scene=scene, expected=expected)))
    withstands = _wrapped(holding_text(fold, drawn=scene.spreads.any), _LETTERS)
    blocks += [Block(_LINE, partial(_lines, lines=[line])) for line in withstands]
    legend = _legend(scene)
    blocks.append(Block(_LINE * len(legend) + 1.0, partial(_lines, lines=legend, faint=True)))
    for first in range(0, scene.n, _COLUMNS):
        labels: dict[int, list[str]] = {}
        for k in range(first, min(first + _COLUMNS, scene.n)):
            labels[k] = [names[i] if i >= 0 and len(names) > 1 else "" for i in where[k]]
        blocks.append(Block(CARD[1], partial(_cards, scene=scene, labels=labels)))
    save_pages(blocks, path)


def simulated(fold: Fold) -> Outcome:
    """Return the result of the simulation."""
    sound = bool(np.isfinite(fold.angles).all())
    return Outcome(
        "Simulated",
        fold.word or "(one component)",
        f"{fold.status}: {fold.message}",
        fold.joint_angles if sound else None,
    )


def holding_text(fold: Fold, *, drawn: bool = False) -> str:
    """Return a text on the loads that the simulated fold withstands; empty if it is not at rest.

    The text mentions whether the magnets and friction were `drawn` within spreads.
    """
    try:
        found = holding(fold)
    except SceneError:
        return ""
    if not found.opens.size:
        return ""
    moments = ", ".join(f"{1e3 * moment:.3g}" for moment in found.opens)
    of = f" of what was simulated, {fold.status}," if fold.status is FoldStatus.MISFOLDED else ""
    within = ", its numbers drawn within the scene's spreads" if drawn else ""
    return f"As simulated{within}: joints{of} open at {moments} mN·m; {str(found).split('; ')[-1]}."


def predicted(scene: Scene, simulated_word: str) -> list[Outcome]:
    """Return the predictions of energy minimisation: over all words, and joint by joint in a tube.

    The note says whether the prediction agrees with the simulation, or why there is none.
    """
    ways: list[tuple[str, Mode]] = [("Least energy of all words", "free")]
    if scene.mount == "tube":
        ways.append(("Least energy, joint by joint", scene.feed.direction))
    return [_prediction(scene, title, mode, simulated_word) for title, mode in ways]


def _prediction(scene: Scene, title: str, mode: Mode, simulated_word: str) -> Outcome:
    if scene.n > LONGEST:
        return Outcome(title, "", f"not searched: more than {LONGEST} components", None)
    if scene.field is not None and scene.field.any:
        return Outcome(title, "", "not searched: the field outside counts too", None)
    try:
        best = minimise(scene, mode, top=1).best
    except ValueError as error:
        return Outcome(title, "", str(error), None)
    agrees = "as simulated" if best.word == simulated_word else "not what was simulated"
    note = f"{agrees}; {1e3 * best.energy:.3f} mJ".replace("-", "−")
    if best.tied:
        note += f", equal to {', '.join(best.tied)}"
    if best.conflicts:
        pairs = ", ".join(f"{one} and {other}" for one, other in best.conflicts)
        note += f"; equal poles touch: {pairs}"
    return Outcome(title, best.word or "(one component)", note, word_to_angles(best.word))


def _facts(scene: Scene, fold: Fold, found: list[parts.Kind]) -> list[Block]:
    lines = [*parts.casing_texts(scene), parts.release_text(scene)]
    if scene.mount == "tube":
        lines.append(f"The feed pushes or pulls with at most {abs(fold.push_peak):.2g} N.")
    if scene.obstacles:
        lines.append(f"Obstacles: {len(scene.obstacles)}; see the scene.")
    if scene.field is not None and scene.field.magnet is not None:
        x, y = (parts.millimetres(each) for each in scene.field.magnet.position)
        lines.append(f"A fixed magnet stands at ({x}, {y}) mm: see the scene.")
    total = sum(kind.pieces for kind in found)
    lines.append(f"{total} magnets, width × height × thickness:" if total else "No magnets.")
    lines += [f"    {kind.name}   {parts.kind_text(kind)}" for kind in found]
    sequence = "Sequence: " + " ".join(scene.sequence)
    wrapped = [part for line in lines for part in _wrapped(line, _LETTERS)]
    wrapped += _wrapped(sequence, _CAPITALS)
    return [Block(_LINE, partial(_lines, lines=[line])) for line in wrapped]


def _wrapped(line: str, letters: int) -> list[str]:
    indent = line[: len(line) - len(line.lstrip())]
    return textwrap.wrap(line, letters, subsequent_indent=indent + "    ")


def _legend(scene: Scene) -> list[str]:
    scale = card_scale(scene)
    size = f"{scale:g} : 1" if scale >= 1.0 else f"1 : {1.0 / scale:.3g}"
    return _wrapped(
        f"Components are seen from above, {size}, the end of component {scene.n} to the right. "
        "Letters outside a face are the pole that faces OUT: red N, blue S, – no magnet. "
        f"A fold's word: {WORDS}",
        _LETTERS,
    )


def _title(axis: Axis, top: float, title: str) -> None:
    words = f"Assembly sheet: {title}" if title else "Assembly sheet"
    text(axis, MARGIN, top, words, 15.0, fontweight="bold")


def _lines(axis: Axis, top: float, lines: list[str], faint: bool = False) -> None:
    for k, line in enumerate(lines):
        text(axis, MARGIN, top - k * _LINE, line, SMALLEST if faint else 8.5)


def _folds(axis: Axis, top: float, scene: Scene, expected: list[Outcome]) -> None:
    for k, outcome in enumerate(expected):
        left = MARGIN + k * CARD[0]
        text(axis, left, top - 3.0, outcome.title, 8.5, fontweight="bold")
        word = "\n".join(textwrap.wrap(outcome.word, 24))
        text(axis, left, top - 7.5, word, 9.5, family="monospace")
        lower = 4.0 * word.count("\n")
        note = textwrap.fill(outcome.note, _NOTE, max_lines=4, placeholder=" …")
        text(axis, left, top - 12.5 - lower, note, SMALLEST)
        if outcome.joints is not None:
            bottom = top - _ABOVE - _PICTURE
            box = (left + 1.0, bottom, CARD[0] - 5.0, _PICTURE - lower)
            draw_fold(axis, box, scene, headings(outcome.joints, first=_UPRIGHT))


def _cards(axis: Axis, top: float, scene: Scene, labels: dict[int, list[str]]) -> None:
    for column, (k, names) in enumerate(labels.items()):
        draw_card(axis, (MARGIN + column * CARD[0], top), scene, k, names)


# --- cards of single components, and pictures of whole folds ---------------------------------


def card_scale(scene: Scene) -> float:
    """Return the magnification of casings on cards."""
    fitting = (s for s in _SCALES if 1e3 * scene.casing.diagonal * s <= _DIAGONAL)
    return next(fitting, _DIAGONAL / (1e3 * scene.casing.diagonal))


def draw_card(
    axis: Axis, corner: tuple[float, float], scene: Scene, k: int, names: Sequence[str]
) -> None:
    """Draw component k seen from above, heading to the right, with the hinges to its neighbours.

    Parameters
    ----------
    axis, corner
        In mm, and the upper left corner of the card on it.
    scene, k
        The chain, and the component's index.
    names
        Names of the magnets behind the four faces; empty where none is needed.
    """
    left, top = corner
    middle = np.array([left + CARD[0] / 2.0, top - CARD[1] / 2.0 + 1.0])
    scale = 1e3 * card_scale(scene)
    frame = (left + 0.8, top - CARD[1] + 0.8), CARD[0] - 1.6, CARD[1] - 1.6
    axis.add_patch(patch("Rectangle", *frame, fill=False, edgecolor=GRID, linewidth=0.8))
    text(axis, left + 3.5, top - 3.0, f"{k + 1}", 15.0, fontweight="bold")
    mass = f"{1e3 * scene.masses[k]:.3g} g" if np.ptp(scene.masses) > 0.0 else ""
    words = f"{scene.sequence[k]}  {mass}".strip()
    text(axis, left + CARD[0] - 3.5, top - 3.8, words, 9.0, ha="right", family="monospace")
    _draw_component(axis, scene, k, 0.0, middle, scale)
    side = scene.casing.side * scale
    for f, pole in enumerate(scene.sequence[k]):
        normal = np.array([np.cos(FACE_NORMALS[f]), np.sin(FACE_NORMALS[f])])
        x, y = middle + (side / 2.0 + 4.6) * normal
        colour = _colour({"N": style.NORTH, "S": style.SOUTH}.get(pole, style.FAINT))
        sign = pole if pole != "-" else "–"
        outside = {"ha": "left" if normal[0] > 0 else "right", "va": "center"}
        inwards = -2.0 * np.sign(normal[0])
        text(axis, x + inwards, y + 1.2, sign, 15.0, color=colour, fontweight="bold", **outside)
        text(axis, x + inwards, y - 2.6, FACES[f], SMALLEST, color=_FAINT, **outside)
        kind = names[f] if pole != "-" else "empty"
        text(axis, x - 2.5 * inwards, y + 1.2, kind, SMALLEST, color=_FAINT, **outside)
    half = scene.casing.diagonal * scale / 2.0
    for end, neighbour in ((-1, k - 1), (1, k + 1)):
        words, aside = _hinge(scene, k, neighbour), "right" if end < 0 else "left"
        x = middle[0] + end * (half + 1.8)
        text(axis, x, middle[1], words, SMALLEST, va="center", ha=aside)
    if scene.mount == "tube":
        _draw_feed(axis, scene, middle[0], top - CARD[1] + 4.6)


def _hinge(scene: Scene, k: int, neighbour: int) -> str:
    if 0 <= neighbour < scene.n:
        return f"hinge\nto {neighbour + 1}"
    return "pinned" if scene.mount == "pinned" and k == 0 and neighbour < 0 else "free\nend"


def _draw_feed(axis: Axis, scene: Scene, x: float, y: float) -> None:
    way = -1.0 if scene.feed.direction == "forward" else 1.0
    arrow = {"arrowstyle": "-|>", "color": INK, "linewidth": 1.1}
    axis.annotate("", (x + 9.0 * way, y), (x - 3.0 * way, y), arrowprops=arrow)
    text(axis, x - 5.0 * way, y, "feed", SMALLEST, va="center", ha="right" if way > 0 else "left")


def draw_fold(
    axis: Axis, box: tuple[float, float, float, float], scene: Scene, angles: FloatArray
) -> None:
    """Draw a chain with headings [rad], shape (n,), as large as a box allows.

    The box is left, bottom, width and height [mm].
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
            _, block = magnet_block(scene, f, heading, np.zeros(2))
            _polygon(axis, scale * block + middle, style.NORTH if pole == "N" else style.SOUTH)
    for end, inner in ((corners[2], k > 0), (corners[0], k < scene.n - 1)):
        if inner:
            dot = {"color": _colour(style.CASING_EDGE), "linewidth": 0}
            axis.add_patch(patch("Circle", end, 0.055 * side, **dot))
    size = 0.3 * side / _POINT
    if size >= _FAINTEST:
        inside = {"ha": "center", "va": "center_baseline", "fontweight": "bold"}
        text(axis, middle[0], middle[1], f"{k + 1}", size, **inside)


def _polygon(
    axis: Axis,
    corners: FloatArray,
    fill: style.Colour,
    edge: style.Colour | None = None,
    line: float = 0.0,
) -> None:
    edges = {"edgecolor": "none" if edge is None else _colour(edge), "linewidth": line}
    axis.add_patch(patch("Polygon", corners, facecolor=_colour(fill), **edges))


def _colour(colour: style.Colour) -> Any:
    return tuple(channel / 255.0 for channel in colour)
