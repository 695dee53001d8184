"""Feeding in legs: a speed until the feed has gone so far, then another.

It knows how far the feed has gone, and nothing else.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from magfold_env.envs.chains.arrays import Bools, Floats, Ints
from magfold_env.envs.spaces.actions import SLOWEST_LEVEL

BRAKE = 8.0
"""How hard the feed slows down before it stands still [m/s²]."""

NEAR = 0.05
"""From where it stands still, before the place that is meant [diagonals]."""

_NEVER = 1_000_000


class Leg(NamedTuple):
    """A part of the way, which ends at a place or after some time, whichever comes first."""

    speed: float
    """Of the feed [m/s]; out of the tube is positive, and 0 stands still."""
    until: float = np.inf
    """The advance of the feed at which it ends [m]."""
    steps: int = _NEVER
    """Steps after which it ends."""
    brakes: bool = False
    """Whether the feed slows down before it gets there."""


class Following:
    """Plays legs one after another in every row of episodes, and goes on with the last.

    Parameters
    ----------
    ways : sequence of sequence of Leg
        For each row its legs.

    Attributes
    ----------
    at : array of int, shape (m,)
        Which leg every row is in, from 0.
    """

    def __init__(self, ways: Sequence[Sequence[Leg]]) -> None:
        self._last: Ints = np.array([len(each) - 1 for each in ways])
        longest = int(self._last.max()) + 1
        padded = [[*each, *[each[-1]] * (longest - len(each))] for each in ways]
        self._legs: Floats = np.array(padded, dtype=np.float64)  # (m, legs, 4)
        self.at: Ints = np.zeros(len(ways), dtype=np.int64)
        self._taken: Ints = np.zeros(len(ways), dtype=np.int64)

    def __call__(self, episodes: Any, rows: Ints) -> tuple[Floats]:
        """Return the speeds of some rows in the next step [m/s]."""
        diagonal = episodes.world.scene.casing.diagonal
        gone = episodes.chains.advances()[rows]
        _, left, steps, brakes = self._now(rows, gone)
        over = left <= brakes * NEAR * diagonal
        over |= self._taken[rows] >= steps
        over &= self.at[rows] < self._last[rows]
        self.at[rows] += over
        self._taken[rows] = np.where(over, 0, self._taken[rows]) + 1
        speed, left, _, brakes = self._now(rows, gone)
        slowing = np.sqrt(2.0 * BRAKE * np.maximum(left, 0.0))
        slowed = np.minimum(np.abs(speed), np.maximum(slowing, SLOWEST_LEVEL))
        return (np.where(brakes > 0.0, np.copysign(slowed, speed), speed),)

    def restart(self, rows: Ints, gone: Floats) -> None:
        """Begin anew in some rows, after the last leg that ends where the feed has gone [m]."""
        ends: Floats = self._legs[rows, :, 1]
        over: Bools = np.isfinite(ends) & (ends <= gone[:, None])
        # The place after the last of them.
        after: Ints = over.shape[1] - np.argmax(over[:, ::-1], axis=1)
        self.at[rows] = np.minimum(np.where(over.any(axis=1), after, 0), self._last[rows])
        self._taken[rows] = 0

    def _now(self, rows: Ints, gone: Floats) -> tuple[Floats, ...]:
        """Return speed, way that is left [m], steps and whether it brakes, of the legs of rows."""
        now: tuple[Floats, ...] = tuple(self._legs[rows, self.at[rows]].T)
        speed, until, steps, brakes = now
        left = np.where(speed < 0.0, gone - until, until - gone)
        return speed, left, steps, brakes
