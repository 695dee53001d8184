"""Feed schedules made of legs. In each leg, the feed moves at one speed to a given position.

Schedules observe only how far the feed has advanced.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from magfold_env.envs.chains.arrays import Bools, Floats, Ints
from magfold_env.envs.spaces.actions import SLOWEST_LEVEL

BRAKE = 8.0
"""Deceleration of the feed at the end of a braking leg [m/s²]."""

NEAR = 0.05
"""A braking leg is over when its remaining distance is at most this [casing diagonals]."""

_NEVER = 1_000_000


class Leg(NamedTuple):
    """A part of a schedule that ends at a given advance or after some steps, whichever is first."""

    speed: float
    """Speed of the feed [m/s]: positive out of the tube, 0 to stop."""
    until: float = np.inf
    """Advance of the feed at which the leg ends [m]."""
    steps: int = _NEVER
    """Number of steps after which the leg ends."""
    brakes: bool = False
    """Whether the feed brakes before the end of the leg."""


class Following:
    """Plays one schedule in each row of episodes, leg after leg; the last leg never ends."""

    def __init__(self, ways: Sequence[Sequence[Leg]]) -> None:
        self._last: Ints = np.array([len(each) - 1 for each in ways])
        longest = int(self._last.max()) + 1
        padded = [[*each, *[each[-1]] * (longest - len(each))] for each in ways]
        self._legs: Floats = np.array(padded, dtype=np.float64)  # (m, legs, 4)
        self.at: Ints = np.zeros(len(ways), dtype=np.int64)
        """Index of the current leg of every row, (m,)."""
        self._taken: Ints = np.zeros(len(ways), dtype=np.int64)

    def __call__(self, episodes: Any, rows: Ints) -> tuple[Floats]:
        """Return the speeds of the given rows for the next step [m/s]."""
        diagonal = episodes.setup.scene.casing.diagonal
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
        """Continue each given row after the last leg that ends at or before its advance [m]."""
        ends: Floats = self._legs[rows, :, 1]
        over: Bools = np.isfinite(ends) & (ends <= gone[:, None])
        # The index after the last leg that is over.
        after: Ints = over.shape[1] - np.argmax(over[:, ::-1], axis=1)
        self.at[rows] = np.minimum(np.where(over.any(axis=1), after, 0), self._last[rows])
        self._taken[rows] = 0

    def _now(self, rows: Ints, gone: Floats) -> tuple[Floats, ...]:
        """Return the speed, remaining distance [m], step limit and braking flag of current legs."""
        now: tuple[Floats, ...] = tuple(self._legs[rows, self.at[rows]].T)
        speed, until, steps, brakes = now
        left = np.where(speed < 0.0, gone - until, until - gone)
        return speed, left, steps, brakes
