"""Assembly sheets: printable A4 instructions for building a chain."""

import math
import textwrap
from collections.abc import Callable, Sequence
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from PIL import Image

from magfold_env.files import replacing
from magfold_env.fold import Fold, FoldStatus
from magfold_env.holding_loads import holding
from magfold_env.minimiser import Mode, minimise
from magfold_env.render import style, workshop
from magfold_env.render.chain import FACE_NORMALS, magnet_block, square
from magfold_env.render.sheet_parts import facts, kinds
from magfold_env.replay.data import WORDS
from magfold_env.reporting.plotting import GRID, INK, figure_class, patch
from magfold_env.scene import FACES, Scene, SceneError
from magfold_env.shapes import FloatArray, centres, headings, word_to_angles

SUFFIXES = (".pdf", ".png", ".svg", ".dxf")
LONGEST = 24
"""Largest number of components for which a sheet predicts folds, which takes a few seconds."""

WIDTH, HEIGHT, MARGIN = 210.0, 297.0, 14.0  # A4 page [mm]; all lengths below are in mm
CARD = 60.0  # edge of the square card of one component
_INCH, _DPI = 25.4, 150  # mm per inch, and resolution of PNG files
_FOOT, _RULER = 8.0, 50.0
_COLUMNS, _LINE = 3, 4.4
_TEXT, _SMALL = 8.5, 8.0  # [pt]
_LETTERS, _CAPITALS, _NOTE = 106, 78, 34  # characters per line of text, poles and notes
_ABOVE, _PICTURE = 26.0, 40.0  # heights of a fold's text and picture
_SCALES = (50.0, 20.0, 10.0, 5.0, 4.0, 3.0, 2.5, 2.0, 1.5, 1.0, 0.5, 0.2, 0.1, 0.05)
_DIAGONAL = 36.0  # longest diagonal of a casing on a card
_FAINT = "#5f656d"
_FAINTEST = 6.0  # smallest size of a casing's number [pt]
_UPRIGHT = math.pi / 4  # component 1's heading [rad]; casings of a full fold are then upright

Block = tuple[float, Callable[[Any, float], None]]
"""Height of a part of a sheet [mm], and the function that draws it below a given height."""


class Outcome(NamedTuple):
    """A simulated or predicted fold, with the text that a sheet prints about it."""

    title: str
    word: str
    note: str
    joints: FloatArray | None
    """Joint angles [rad], shape (n-1,); None if there is nothing to draw."""


def save_sheet(scene: Scene, fold: Fold, path: str | Path, title: str = "") -> None:
    """Write the assembly sheet of a chain, with its components, magnets and expected folds.

    Parameters
    ----------
    scene
        The scene to build, before any random draws.
    fold
        The simulated fold of the scene.
    path
        Path of the sheet: a `.pdf` or `.png` for printing (a `.png` shows its pages one below
        another), or a `.svg` or `.dxf` in millimetres for the workshop, see
        `magfold_env.render.workshop`. The file is written through a temporary file.
    title
        Name of the chain.

    Raises
    ------
    ValueError
        If the path has another suffix.
    ImportError
        If matplotlib is not installed, or if ezdxf is not installed and the suffix is `.dxf`.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in SUFFIXES:
        raise ValueError(f"{str(path)!r} is not allowed; must end in {' or '.join(SUFFIXES)}")
    if suffix in workshop.WRITERS:
        lines = [*facts(scene, fold), *workshop.magnet_lines(scene), simulated(fold).note]
        with replacing(path) as temporary:
            workshop.WRITERS[suffix](workshop.drawing(scene, [title, *lines]), temporary)
        return
    pages = _pages(_blocks(scene, fold, title))
    figures = [_figure(page, k, len(pages)) for k, page in enumerate(pages, start=1)]
    with replacing(path) as temporary:
        if suffix == ".pdf":
            backend = import_module("matplotlib.backends.backend_pdf")
            # Without a date, equal sheets give equal files.
            with backend.PdfPages(temporary, metadata={"CreationDate": None}) as pdf:
                for figure in figures:
                    pdf.savefig(figure)
        else:
            pixels = np.vstack([_pixels(figure) for figure in figures])
            Image.fromarray(pixels).save(temporary, format="PNG", optimize=True, dpi=(_DPI, _DPI))


# --- contents of a sheet ---------------------------------------------------------------------


def _blocks(scene: Scene, fold: Fold, title: str) -> list[Block]:
    found, where = kinds(scene)
    names = np.array([*(kind.name for kind in found), "empty"])[where]
    lines = [*facts(scene, fold), *workshop.magnet_lines(scene)]
    head = f"Assembly sheet: {title}" if title else "Assembly sheet"
    blocks: list[Block] = [(10.0, partial(_write, words=head, size=15.0, fontweight="bold"))]
    blocks += [block for line in lines for block in _lines(line)]
    blocks += _lines("Sequence: " + " ".join(scene.sequence), letters=_CAPITALS)
    outcomes = [simulated(fold), *predicted(scene, fold.word)]
    blocks.append((_ABOVE + _PICTURE + 2.0, partial(_folds, scene=scene, outcomes=outcomes)))
    blocks += _lines(holding_text(fold, drawn=scene.spreads.any))
    scale = card_scale(scene)
    size = f"{scale:g} : 1" if scale >= 1.0 else f"1 : {1.0 / scale:.3g}"
    blocks += _lines(
        f"Components are seen from above, {size}, the end of component {scene.n} to the right. "
        "Letters outside a face are the pole that faces OUT: red N, blue S, – no magnet. "
        f"A fold's word: {WORDS}",
        size=_SMALL,
    )
    for first in range(0, scene.n, _COLUMNS):
        blocks.append((CARD, partial(_cards, scene=scene, first=first, names=names)))
    return blocks


def _lines(words: str, *, letters: int = _LETTERS, size: float = _TEXT) -> list[Block]:
    """Wrap a text and return one block per line."""
    indent = words[: len(words) - len(words.lstrip())] + "    "
    wrapped = textwrap.wrap(words, letters, subsequent_indent=indent)
    return [(_LINE, partial(_write, words=line, size=size)) for line in wrapped]


def simulated(fold: Fold) -> Outcome:
    """Return the simulated fold as an outcome."""
    joints = fold.joint_angles if np.isfinite(fold.angles).all() else None
    word = fold.word or "(one component)"
    return Outcome("Simulated", word, f"{fold.status}: {fold.message}", joints)


def holding_text(fold: Fold, *, drawn: bool = False) -> str:
    """Return a text about the loads that a fold withstands, or "" if it is not at rest.

    If `drawn`, the text mentions that the fold's values were drawn within the scene's spreads.
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
    """Return the folds of least energy: over all words and, in a tube, joint by joint.

    Each note states whether the fold agrees with the simulation, or why no search was made.
    """
    ways: list[tuple[str, Mode]] = [("Least energy of all words", "free")]
    if scene.mount == "tube":
        ways.append(("Least energy, joint by joint", scene.feed.direction))
    return [_prediction(scene, title, mode, simulated_word) for title, mode in ways]


def _prediction(scene: Scene, title: str, mode: Mode, simulated_word: str) -> Outcome:
    if scene.n > LONGEST:
        return Outcome(title, "", f"not searched: more than {LONGEST} components", None)
    try:
        best = minimise(scene, mode, top=1).best
    except ValueError as error:
        return Outcome(title, "", f"not searched: {error}", None)
    agrees = "as simulated" if best.word == simulated_word else "not what was simulated"
    note = f"{agrees}; {1e3 * best.energy:.3f} mJ".replace("-", "−")
    if best.tied:
        note += f", equal to {', '.join(best.tied)}"
    if best.conflicts:
        pairs = ", ".join(f"{one} and {other}" for one, other in best.conflicts)
        note += f"; like poles touch: {pairs}"
    return Outcome(title, best.word or "(one component)", note, word_to_angles(best.word))


# --- pages -----------------------------------------------------------------------------------


def _pages(blocks: Sequence[Block]) -> list[list[Block]]:
    """Return the blocks of each page; a block that does not fit on a page begins the next one."""
    pages: list[list[Block]] = [[]]
    room = full = HEIGHT - 2.0 * MARGIN - _FOOT
    for block in blocks:
        if block[0] > room and pages[-1]:
            pages.append([])
            room = full
        pages[-1].append(block)
        room -= block[0]
    return pages


def _figure(blocks: Sequence[Block], number: int, count: int) -> Any:
    figure = figure_class()(figsize=(WIDTH / _INCH, HEIGHT / _INCH), dpi=_DPI)
    axis = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axis.set(xlim=(0.0, WIDTH), ylim=(0.0, HEIGHT))
    axis.set_axis_off()
    top = HEIGHT - MARGIN
    for height, draw in blocks:
        draw(axis, top)
        top -= height
    ends = [MARGIN, MARGIN + _RULER]
    axis.plot(ends, [MARGIN, MARGIN], color=INK, linewidth=1.0, marker="|", markersize=5.0)
    words = f"{_RULER:.0f} mm if printed at 100 %"
    text(axis, MARGIN + _RULER + 3.0, MARGIN, words, _SMALL, va="center")
    words = f"page {number} of {count}"
    text(axis, WIDTH - MARGIN, MARGIN, words, _SMALL, va="center", ha="right")
    return figure


def _pixels(figure: Any) -> Any:
    canvas = import_module("matplotlib.backends.backend_agg").FigureCanvasAgg(figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3]


def text(axis: Any, x: float, y: float, words: str, size: float = _TEXT, **look: Any) -> None:
    """Write text of `size` pt at (`x`, `y`) [mm], by default below that point."""
    axis.text(x, y, words, **{"fontsize": size, "color": INK, "va": "top", **look})


def _write(axis: Any, top: float, words: str, size: float, **look: Any) -> None:
    text(axis, MARGIN, top, words, size, **look)


# --- cards of single components, and pictures of whole folds ---------------------------------


def _folds(axis: Any, top: float, scene: Scene, outcomes: Sequence[Outcome]) -> None:
    for k, outcome in enumerate(outcomes):
        left = MARGIN + k * CARD
        text(axis, left, top - 3.0, outcome.title, fontweight="bold")
        word = textwrap.fill(outcome.word, 24)
        text(axis, left, top - 7.5, word, 9.5, family="monospace")
        lower = 4.0 * word.count("\n")
        note = textwrap.fill(outcome.note, _NOTE, max_lines=4, placeholder=" …")
        text(axis, left, top - 12.5 - lower, note, _SMALL)
        if outcome.joints is not None:
            box = (left + 1.0, top - _ABOVE - _PICTURE, CARD - 5.0, _PICTURE - lower)
            draw_fold(axis, box, scene, headings(outcome.joints, first=_UPRIGHT))


def _cards(axis: Any, top: float, scene: Scene, first: int, names: Any) -> None:
    for k in range(first, min(first + _COLUMNS, scene.n)):
        draw_card(axis, (MARGIN + (k - first) * CARD, top), scene, k, names[k])


def card_scale(scene: Scene) -> float:
    """Return the magnification of casings on cards."""
    diagonal = 1e3 * scene.casing.diagonal
    return next((s for s in _SCALES if diagonal * s <= _DIAGONAL), _DIAGONAL / diagonal)


def draw_card(
    axis: Any, corner: tuple[float, float], scene: Scene, k: int, names: Sequence[str]
) -> None:
    """Draw component `k` from above, heading right, with its poles and the numbers of neighbours.

    ``corner`` is the upper left corner of the card [mm]. ``names`` contains the kind of the magnet
    behind each face, or "empty".
    """
    left, top = corner
    middle = np.array([left + CARD / 2.0, top - CARD / 2.0])
    scale = 1e3 * card_scale(scene)
    frame = (left + 0.8, top - CARD + 0.8), CARD - 1.6, CARD - 1.6
    axis.add_patch(patch("Rectangle", *frame, fill=False, edgecolor=GRID, linewidth=0.8))
    text(axis, left + 3.5, top - 3.0, f"{k + 1}", 15.0, fontweight="bold")
    mass = f"  {1e3 * scene.masses[k]:.3g} g" if np.ptp(scene.masses) > 0.0 else ""
    words = scene.sequence[k] + mass
    text(axis, left + CARD - 3.5, top - 3.8, words, 9.0, ha="right", family="monospace")
    _draw_component(axis, scene, k, 0.0, middle, scale)
    for f, pole in enumerate(scene.sequence[k]):
        normal = np.array([np.cos(FACE_NORMALS[f]), np.sin(FACE_NORMALS[f])])
        x, y = middle + (scene.casing.side * scale / 2.0 + 4.6) * normal
        out = float(np.sign(normal[0]))
        colour = style.shares({"N": style.NORTH, "S": style.SOUTH}.get(pole, style.FAINT))
        outside = {"ha": "left" if out > 0 else "right", "va": "center"}
        sign = pole.replace("-", "–")
        text(axis, x - 2 * out, y + 1.2, sign, 15.0, color=colour, fontweight="bold", **outside)
        text(axis, x - 2 * out, y - 2.6, FACES[f], _SMALL, color=_FAINT, **outside)
        text(axis, x + 5 * out, y + 1.2, names[f], _SMALL, color=_FAINT, **outside)
    for out, neighbour in ((-1, k - 1), (1, k + 1)):
        words = f"hinge\nto {neighbour + 1}" if 0 <= neighbour < scene.n else "end"
        x = middle[0] + out * (scene.casing.diagonal * scale / 2.0 + 1.8)
        text(axis, x, middle[1], words, _SMALL, va="center", ha="left" if out > 0 else "right")


def draw_fold(
    axis: Any, box: tuple[float, float, float, float], scene: Scene, angles: FloatArray
) -> None:
    """Draw a chain with headings `angles` [rad], shape (n,), as large as fits into a box.

    ``box`` contains the left edge, the bottom edge, the width and the height [mm].
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
    axis: Any, scene: Scene, k: int, heading: float, middle: FloatArray, scale: float
) -> None:
    """Draw the casing, magnets, number and hinges of a component; `scale` is in mm per metre."""
    side = scene.casing.side * scale
    corners = square(middle, heading, side)
    edge = {"edgecolor": style.shares(style.CASING_EDGE), "linewidth": min(0.9, 0.05 * side)}
    axis.add_patch(patch("Polygon", corners, facecolor=style.shares(style.CASING), **edge))
    for f, pole in enumerate(scene.sequence[k] if scene.magnets is not None else ""):
        if pole != "-":
            _, block = magnet_block(scene, f, heading, np.zeros(2))
            colour = style.shares(style.NORTH if pole == "N" else style.SOUTH)
            axis.add_patch(patch("Polygon", scale * block + middle, color=colour, linewidth=0))
    for end, inner in ((corners[2], k > 0), (corners[0], k < scene.n - 1)):
        if inner:
            dot = {"color": style.shares(style.CASING_EDGE), "linewidth": 0}
            axis.add_patch(patch("Circle", end, 0.055 * side, **dot))
    size = 0.3 * side / _INCH * 72.0
    if size >= _FAINTEST:
        inside = {"ha": "center", "va": "center_baseline", "fontweight": "bold"}
        text(axis, middle[0], middle[1], f"{k + 1}", size, **inside)
