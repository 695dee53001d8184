"""What an agent decides about a component: the pattern of its magnets and its feed speed."""

from collections.abc import Sequence
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from magfold_env.scene import SIGNS as SIGN_OF

SLOWEST = 0.01
"""Lowest feed speed on offer [m/s]."""

FASTEST = 0.6
"""Highest feed speed on offer [m/s]."""

PATTERNS: tuple[str, ...] = tuple("".join(faces) for faces in product("NS", repeat=4))
"""The 16 magnet patterns. Read an index as four bits, front-left first, front-right last, N = 0
and S = 1: 0 is NNNN, 1 is NNNS, 8 is SNNN, 15 is SSSS."""

SIGNS: NDArray[np.float64] = np.array(
    [[1.0 if face == "N" else -1.0 for face in faces] for faces in PATTERNS]
)
"""The patterns as numbers, N = 1 and S = −1, shape (16, 4)."""

_LETTERS = {sign: letter for letter, sign in SIGN_OF.items()}
_INDEX = {faces: index for index, faces in enumerate(PATTERNS)}

_MIDDLE = float(np.sqrt(SLOWEST * FASTEST))
_HALF_RANGE = float(np.log(FASTEST / _MIDDLE))


def signs_of(faces: str) -> NDArray[np.float64]:
    """Return the outward poles of a component, N = 1, S = −1, - = 0, shape (4,)."""
    if faces in _INDEX:
        return SIGNS[_INDEX[faces]]
    return np.array([SIGN_OF[face] for face in faces])


def letters_of(signs: NDArray[np.float64]) -> str:
    """Return the faces of a component, from its outward poles (4,)."""
    return "".join(_LETTERS[sign] for sign in signs.tolist())


def speed_levels(levels: int) -> NDArray[np.float64]:
    """Return feed speeds [m/s], log-spaced from `SLOWEST` to `FASTEST`, shape (levels,).

    Raises
    ------
    ValueError
        If there are fewer than two.
    """
    if levels <= 1:
        raise ValueError(f"speeds: {levels} is not allowed; must be 2 or more")
    return np.geomspace(SLOWEST, FASTEST, levels)


def speed_at(scaled: float) -> float:
    """Return the speed [m/s] at a place on the log scale: `SLOWEST` at −1, `FASTEST` at 1."""
    return float(speeds_at(scaled))


def scaled_speed(speed: float) -> float:
    """Return where a speed [m/s] lies on the log scale from −1 to 1."""
    return float(scaled_speeds(speed))


def speeds_at(scaled: Any) -> Any:
    """Return what `speed_at` does, of a number or of each in an array."""
    return np.clip(_MIDDLE * np.exp(_HALF_RANGE * scaled), SLOWEST, FASTEST)


def scaled_speeds(speeds: Any) -> Any:
    """Return what `scaled_speed` does, of a number or of each in an array."""
    return np.log(speeds / _MIDDLE) / _HALF_RANGE


def read_catalogue(catalogue: Sequence[str] | None) -> tuple[int, ...]:
    """Return the numbers of the patterns in `catalogue`, ascending; None stands for all 16.

    Raises
    ------
    ValueError
        If it is empty or holds anything but such patterns.
    """
    if catalogue is None:
        return tuple(range(len(PATTERNS)))
    text = isinstance(catalogue, str)
    wrong = [] if text else [faces for faces in catalogue if faces not in PATTERNS]
    if text or wrong or not catalogue:
        raise ValueError(
            f"catalogue: {(wrong[0] if wrong else catalogue)!r} is not allowed; must be a list "
            "of components of four letters N or S, such as ['NSNS', 'NNSS']"
        )
    return tuple(sorted({PATTERNS.index(faces) for faces in catalogue}))
