"""What the numbers of an action mean: the magnets of a component and its feed speed."""

from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

SLOWEST = 0.01
"""Lowest feed speed on offer [m/s]."""

FASTEST = 0.6
"""Highest feed speed on offer [m/s]."""

PATTERNS: tuple[str, ...] = tuple("".join(faces) for faces in product("NS", repeat=4))
"""The 16 magnet patterns. Read an index as four bits, front-left first, front-right last, N = 0
and S = 1: 0 is NNNN, 1 is NNNS, 8 is SNNN, 15 is SSSS."""


@dataclass(frozen=True)
class Choice:
    """One component's settings.

    Attributes
    ----------
    faces : str
        Polarity outward of front-left, back-left, back-right and front-right, as N and S.
    speed : float
        Feed speed that was asked for [m/s].
    """

    faces: str
    speed: float


@dataclass(frozen=True)
class ActionTable:
    """The discrete actions: (pattern, speed level).

    Attributes
    ----------
    levels : int
        Number of speed levels, log-spaced from `SLOWEST` to `FASTEST`, both included.
    """

    levels: int

    def __post_init__(self) -> None:
        if self.levels <= 1:
            raise ValueError(f"speeds: {self.levels} is not allowed; must be 2 or more")

    @cached_property
    def speeds(self) -> NDArray[np.float64]:
        """Feed speed of each level [m/s], shape (levels,), ascending."""
        return np.geomspace(SLOWEST, FASTEST, self.levels)

    @property
    def space(self) -> spaces.MultiDiscrete:
        """Gymnasium's description of the actions."""
        return spaces.MultiDiscrete([len(PATTERNS), self.levels])

    def decode(self, action: Any) -> Choice:
        """Return what `action` asks for.

        Raises
        ------
        ValueError
            If `action` is not two integers inside the space.
        """
        # A plain list is promoted as NumPy would, so that [3, 2] works as an action.
        values = np.asarray(action)
        if not self.space.contains(values):
            raise ValueError(
                f"action: {action!r} is not allowed; must be two integers, "
                f"pattern 0..{len(PATTERNS) - 1} and speed level 0..{self.levels - 1}"
            )
        return Choice(PATTERNS[int(values[0])], float(self.speeds[int(values[1])]))

    def encode(self, faces: str, speed: float) -> NDArray[np.int64]:
        """Return the action nearest to `faces` and `speed` [m/s] (nearest level in log speed)."""
        level = int(np.argmin(np.abs(np.log(self.speeds / speed))))
        return np.array([PATTERNS.index(faces), level], dtype=np.int64)
