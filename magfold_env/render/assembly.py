"""The assembly sheet: what the workshop needs to build a chain, printable on A4."""

from __future__ import annotations

import math
import textwrap
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from magfold_env.fold import Fold
from magfold_env.minimiser import Mode, minimise
from magfold_env.render import cards, parts
from magfold_env.render.cards import FloatArray, card_scale, draw_card, draw_fold
from magfold_env.render.sheets import MARGIN, Axis, Block, check_suffix, save_pages, text
from magfold_env.scene import Scene
from magfold_env.shapes import headings, word_to_angles

LONGEST = 24
"""Components up to which energy minimisation takes seconds."""

_COLUMNS = 3
_LINE = 4.4  # [mm]
_LETTERS = 106  # of a line
_CAPITALS = 78  # of a line of poles
_PICTURE = 50.0  # height of a fold's picture [mm]
_UPRIGHT = math.pi / 4  # heading of component 1 with which the casings of a full fold stand upright


class Outcome(NamedTuple):
    """A fold that is expected, and on what grounds."""

    title: str
    word: str
    note: str
    joints: FloatArray | None
    """Joint angles [rad], shape (n-1,); None where there is nothing to draw."""


def save_sheet(scene: Scene, fold: Fold, path: str | Path, title: str = "") -> None:
    """Write the assembly sheet of a chain: its components, its magnets and the folds to expect.

    Parameters
    ----------
    scene
        What to build, before its random draws.
    fold
        Its simulated fold.
    path
        A `.pdf`, or a `.png` with all pages below each other; written under a temporary name first.
    title
        What the chain is called.

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
    blocks = [Block(10.0, partial(_title, title=title)), *_facts(scene, found)]
    blocks.append(Block(_PICTURE + 24.0, partial(_folds, scene=scene, expected=expected)))
    blocks.append(Block(2.0 * _LINE + 1.0, partial(_lines, lines=_legend(scene), faint=True)))
    for first in range(0, scene.n, _COLUMNS):
        labels: dict[int, list[str]] = {}
        for k in range(first, min(first + _COLUMNS, scene.n)):
            labels[k] = [names[i] if i >= 0 and len(names) > 1 else "" for i in where[k]]
        blocks.append(Block(cards.HEIGHT, partial(_cards, scene=scene, labels=labels)))
    save_pages(blocks, path)


def simulated(fold: Fold) -> Outcome:
    """Return how the simulated fold ended."""
    sound = bool(np.isfinite(fold.angles).all())
    return Outcome(
        "Simulated",
        fold.word or "(one component)",
        f"{fold.status}: {fold.message}",
        fold.joint_angles if sound else None,
    )


def predicted(scene: Scene, simulated_word: str) -> list[Outcome]:
    """Return what energy minimisation predicts: of all words, and joint by joint in a tube.

    The note says whether that is what was simulated, or why there is no prediction.
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


def _facts(scene: Scene, found: list[parts.Kind]) -> list[Block]:
    lines = [*parts.casing_texts(scene), parts.release_text(scene)]
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
    return [
        f"Components are seen from above, {size}, the end of component {scene.n} to the right. "
        "Letters outside a face are the pole that faces OUT:",
        "red N, blue S, – no magnet. A fold's word has a letter a joint, component 1 first: "
        "L turns left, R right, S stays straight.",
    ]


def _title(axis: Axis, top: float, title: str) -> None:
    words = f"Assembly sheet: {title}" if title else "Assembly sheet"
    text(axis, MARGIN, top, words, 15.0, fontweight="bold")


def _lines(axis: Axis, top: float, lines: list[str], faint: bool = False) -> None:
    for k, line in enumerate(lines):
        text(axis, MARGIN, top - k * _LINE, line, 7.0 if faint else 8.5)


def _folds(axis: Axis, top: float, scene: Scene, expected: list[Outcome]) -> None:
    for k, outcome in enumerate(expected):
        left = MARGIN + k * cards.WIDTH
        text(axis, left, top - 3.0, outcome.title, 8.5, fontweight="bold")
        word = "\n".join(textwrap.wrap(outcome.word, 24))
        text(axis, left, top - 7.5, word, 9.5, family="monospace")
        lower = 4.0 * word.count("\n")
        note = "\n".join(textwrap.wrap(outcome.note, 44)[:3])
        text(axis, left, top - 12.5 - lower, note, 6.5)
        if outcome.joints is not None:
            bottom = top - _PICTURE - 22.0
            box = (left + 1.0, bottom, cards.WIDTH - 5.0, _PICTURE - lower)
            draw_fold(axis, box, scene, headings(outcome.joints, first=_UPRIGHT))


def _cards(axis: Axis, top: float, scene: Scene, labels: dict[int, list[str]]) -> None:
    for column, (k, names) in enumerate(labels.items()):
        draw_card(axis, (MARGIN + column * cards.WIDTH, top), scene, k, names)
