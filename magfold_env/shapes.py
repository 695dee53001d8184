"""Shapes: fold words, the cells that they cover, their symmetries and the similarity of folds.

A word has one letter per joint, from component 1 to n: L (+90°), S (0) or R (-90°). The unit of
length is half a diagonal, so that all centres have integer coordinates; see `cells`.
"""

import reprlib
from functools import lru_cache
from typing import cast

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]
Outline = tuple[tuple[int, int], ...]

LETTERS = "LSR"
_QUARTERS = {"L": 1, "S": 0, "R": -1}
_FLIP = str.maketrans("LSR", "RSL")
_COS = np.array([1, 0, -1, 0], dtype=np.int64)
_SIN = np.array([0, 1, 0, -1], dtype=np.int64)


def parse_word(word: str, n: int | None = None, key: str = "word") -> str:
    """Return `word` if it is a fold word.

    Parameters
    ----------
    word
        Letters L, S and R, one per joint; empty for a single component.
    n
        Number of components that the word must have; None allows any number.
    key
        Name of the word in messages.

    Raises
    ------
    ValueError
        If there are other letters, or not n-1 letters.
    """
    if not isinstance(cast("object", word), str):
        raise ValueError(f"{key}: {reprlib.repr(word)} is not allowed; must be text of L, S and R")
    if set(word) - set(LETTERS):
        upper = word.upper()
        meant = "" if set(upper) - set(LETTERS) else f"; did you mean {upper}?"
        raise ValueError(
            f"{key}: {word[:100]!r} is not allowed; must consist of the letters L, S and R{meant}"
        )
    if n is not None and len(word) != n - 1:
        raise ValueError(
            f"{key}: {word[:100]!r} is not allowed; must have {n - 1} letters for {n} components"
        )
    return word


def word_to_angles(word: str) -> FloatArray:
    """Return the joint angles of a word [rad], shape (n-1,)."""
    quarters = [_QUARTERS[letter] for letter in parse_word(word)]
    return np.array(quarters, dtype=np.float64) * (np.pi / 2)


def angles_to_word(joint_angles: npt.ArrayLike) -> str:
    """Return the word nearest to joint angles [rad], shape (n-1,), with thresholds at ±45°.

    Raises
    ------
    ValueError
        If an angle is not finite.
    """
    angles = np.asarray(joint_angles, dtype=np.float64)
    if not np.isfinite(angles).all():
        raise ValueError(f"joint_angles: {angles.tolist()} is not allowed; must be finite")
    turned = angles - 2 * np.pi * np.round(angles / (2 * np.pi))  # joints without stops may spin
    return "".join(
        "L" if angle > np.pi / 4 else "R" if angle < -np.pi / 4 else "S" for angle in turned
    )


def mirror(word: str) -> str:
    """Return the word of the mirror image, in which L and R are exchanged."""
    return parse_word(word).translate(_FLIP)


def is_fully_folded(word: str) -> bool:
    """Return whether the word contains no S; its casings may still overlap."""
    return "S" not in parse_word(word)


def cells(word: str) -> IntArray:
    """Return the centres in half diagonals, with component 1 at the origin heading along +x.

    Headings are multiples of 90°, and consecutive centres differ by the sum of two heading vectors,
    so all coordinates are integers. A casing is the square ``|x| + |y| <= 1`` about its centre.

    Returns
    -------
    (n, 2) array of int
    """
    quarters = np.cumsum([0, *(_QUARTERS[letter] for letter in parse_word(word))]) % 4
    heading = np.stack([_COS[quarters], _SIN[quarters]], axis=1)
    steps = heading[:-1] + heading[1:]
    return np.concatenate([np.zeros((1, 2), dtype=np.int64), np.cumsum(steps, axis=0)])


def overlaps(word: str) -> bool:
    """Return whether two casings of the word overlap.

    The distance ``|dx| + |dy|`` between two centres is even, and the casings overlap if it is below
    2. Casings therefore overlap if and only if they have the same centre. The paper's filter
    (centres less than 3 mm apart) agrees.
    """
    centres = cells(word)
    return len(np.unique(centres, axis=0)) < len(centres)


def folded_words(n: int) -> list[str]:
    """Return all fully folded words of n components without overlap, in sorted order.

    The words are self-avoiding paths that turn at every step. They grow letter by letter and stop
    at the first overlap.

    Raises
    ------
    ValueError
        If `n` is below 1.
    """
    if n < 1:
        raise ValueError(f"n: {n} is not allowed; must be at least 1")
    found = [""]
    for _ in range(n - 1):
        found = [w for word in found for w in (word + "L", word + "R") if not overlaps(w)]
    return sorted(found)


def outline(word: str) -> Outline:
    """Return the cells that a word covers, in a form independent of rotation and translation.

    Mirror images differ unless the cells are their own mirror image. Two words may share an
    outline, because it does not contain the order of its cells.
    """
    return _placed(cells(word))


def drawn_outline(drawing: str) -> Outline:
    """Return the outline of squares drawn as text, one line per row.

    Parameters
    ----------
    drawing
        ``#`` for a component, ``.`` or a space elsewhere.

    Raises
    ------
    ValueError
        If there are other letters, or no ``#``.
    """
    if set(drawing) - set("#. \n") or "#" not in drawing:
        allowed = "must be lines of # for components, and . or spaces for what is left free"
        raise ValueError(f"drawing: {drawing!r} is not allowed; {allowed}")
    rows = enumerate(drawing.split("\n"))
    squares = [(x, -y) for y, row in rows for x, sign in enumerate(row) if sign == "#"]
    # The axes are along the casings' diagonals, as in `cells`.
    return _placed(np.array([(x - y, x + y) for x, y in squares], dtype=np.int64))


def _placed(covered: IntArray) -> Outline:
    """Return cells (n, 2), moved to the origin, in the lexicographically smallest rotation."""
    candidates: list[Outline] = []
    for _ in range(4):
        covered = np.stack([-covered[:, 1], covered[:, 0]], axis=1)
        moved = covered - covered.min(axis=0)
        candidates.append(tuple(sorted((int(x), int(y)) for x, y in moved)))
    return min(candidates)


@lru_cache(maxsize=1024)
def words_of_outline(covered: Outline) -> tuple[str, ...]:
    """Return the sorted, fully folded words that cover exactly the cells of an outline.

    Words start from every cell and heading, and grow only into free cells. The result is empty if
    no fully folded word covers the cells; no word covers a T of four squares, for example.

    Parameters
    ----------
    covered
        The result of `outline` or `drawn_outline`.

    Raises
    ------
    ValueError
        If edges do not connect all cells, or a cell is given twice.
    """
    left, reached = set(covered), list(covered[:1])
    for x, y in reached:  # which grows
        left -= {*reached}
        reached += left & {(x + 1, y + 1), (x + 1, y - 1), (x - 1, y + 1), (x - 1, y - 1)}
    if sorted(reached) != sorted(covered) or not covered:
        raise ValueError(f"covered: {covered} is not allowed; edges must connect all cells")
    found: set[str] = set()
    for cell in covered:
        for quarter in range(4):
            _grow("", cell, quarter, frozenset(covered) - {cell}, found)
    return tuple(sorted(found))


def _grow(
    word: str,
    cell: tuple[int, int],
    quarter: int,
    free: frozenset[tuple[int, int]],
    found: set[str],
) -> None:
    """Add to `found` all words that continue `word` from `cell` and cover all cells in `free`."""
    if not free:
        found.add(word)
        return
    for letter in "LR":
        turned = (quarter + _QUARTERS[letter]) % 4
        x = cell[0] + int(_COS[quarter] + _COS[turned])
        y = cell[1] + int(_SIN[quarter] + _SIN[turned])
        if (x, y) in free:
            _grow(word + letter, (x, y), turned, free - {(x, y)}, found)


def headings(joint_angles: npt.ArrayLike, first: float = 0.0) -> FloatArray:
    """Return absolute headings [rad], shape (n,), from joint angles, shape (n-1,)."""
    turns = np.asarray(joint_angles, dtype=np.float64)
    return first + np.concatenate([[0.0], np.cumsum(turns)])


def centres(
    angles: npt.ArrayLike, side: float = 1.0, base: npt.ArrayLike = (0.0, 0.0)
) -> FloatArray:
    """Return the casings' centres, in the unit of `side`.

    Parameters
    ----------
    angles
        Absolute headings [rad], shape (..., n).
    side
        Edge length of a casing.
    base
        Component 1's outer hinge, shape (..., 2).

    Returns
    -------
    (..., n, 2) array
    """
    angles = np.asarray(angles, dtype=np.float64)
    along = side * np.sqrt(2.0) * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    hinges = np.asarray(base, dtype=np.float64)[..., None, :] + np.cumsum(along, axis=-2)
    return hinges - 0.5 * along


def similarity(joint_angles_a: npt.ArrayLike, joint_angles_b: npt.ArrayLike) -> float:
    """Return the similarity of two folds, from 0 to 1.

    The similarity is the mean over ordered pairs i, j of ``exp(-|p_ij - q_ij|²/side²)``, where p_ij
    and q_ij are the centres of component j as seen from component i in the two folds. It does not
    change when a fold is moved or turned, but it changes when a fold is mirrored or its components
    are renumbered. It is continuous, and it is 1 only for equal joint angles.

    Parameters
    ----------
    joint_angles_a, joint_angles_b
        Joint angles [rad], shape (n-1,) each.

    Raises
    ------
    ValueError
        If the two have different lengths.
    """
    a = np.asarray(joint_angles_a, dtype=np.float64)
    b = np.asarray(joint_angles_b, dtype=np.float64)
    if a.shape != b.shape or a.ndim != 1:
        raise ValueError(
            f"joint_angles_b: shape {b.shape} is not allowed; must be (n-1,) and equal to that of "
            f"joint_angles_a, {a.shape}"
        )
    if a.size == 0:
        return 1.0
    apart = np.sum((_seen_from_each(a) - _seen_from_each(b)) ** 2, axis=-1)
    off_diagonal = ~np.eye(a.size + 1, dtype=np.bool_)
    return float(np.exp(-apart[off_diagonal]).mean())


def _seen_from_each(joint_angles: FloatArray) -> FloatArray:
    """Return the position of centre j in the frame of component i, (n, n, 2), for a side of 1."""
    angles = headings(joint_angles)
    place = centres(angles)
    away = place[None, :, :] - place[:, None, :]
    cos, sin = np.cos(angles)[:, None], np.sin(angles)[:, None]
    return np.stack(
        [cos * away[..., 0] + sin * away[..., 1], cos * away[..., 1] - sin * away[..., 0]], axis=-1
    )
