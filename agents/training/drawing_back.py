"""Retracting wrong folds and releasing them again: demonstrations of folds that can fail.

The player follows a task's best open loop until a joint outside the tube turns the wrong way. Then
it draws that joint in, except for the chain's first component, and feeds it again with another open
loop or the same one; a second attempt often succeeds. It does the same with misplaced joints while
the feed stands still at the end of a first fold, before the chain is drawn in for a second.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from agents.open_loops.schedules import Schedule
from magfold_env.envs.baselines.legs import Following
from magfold_env.envs.chains.arrays import Bools, Floats, Ints
from magfold_env.envs.reprogram import BACK, FIRST, SECOND
from magfold_env.envs.tasks.goals import SUCCESS_TOLERANCE

LEAST = 0.02
"""Smallest length of the chain that stays outside when it is drawn in, or in the tube when it is
let out again before it is drawn in further [diagonals]."""

SLIPS = 0.9
"""Share of the drive's largest pull above which it may slip."""

PATIENCE = 0.8
"""Share of the time limit after which no joint is drawn in any more."""


class Redoing(NamedTuple):
    """The settings of a fold."""

    first: Schedule
    again: Schedule
    """The open loop after drawing in."""
    wrong: float
    """Wrong angle of a joint at which it is drawn in [rad]."""
    at_last: float
    """The same angle while the last component, which cannot be drawn in again, comes out [rad]."""
    depth: float
    """Advance of the feed after drawing in, relative to the point where the component before the
    joint begins to come out [diagonals]."""
    speed: float
    """Speed of drawing in [m/s], negative."""
    stands: float = np.inf
    """Steps of standstill before a misplaced joint is drawn in."""


class Refolding(NamedTuple):
    """The settings of two folds."""

    first: Redoing
    second: Redoing
    back: float
    """Speed of drawing in the chain between them [m/s], negative."""
    slack: float
    """Length that is let out again if the drive slips [diagonals]."""


class DrawingBack:
    """Plays folds whose first attempt may fail, in every row of episodes, by the row's settings."""

    def __init__(self, found: Sequence[Redoing]) -> None:
        self._first = Following([each.first.way for each in found])
        self._again = Following([each.again.way for each in found])
        settings = np.array([each[2:] for each in found], dtype=np.float64)
        self._wrong, self._at_last, self._depth, self._speed, self._stands = settings.T
        self._goal: Floats = np.full(len(found), np.nan)
        self._stood: Ints = np.zeros(len(found), dtype=np.int64)
        self.times: Ints = np.zeros(len(found), dtype=np.int64)
        """Number of times each row has drawn in."""

    def __call__(self, episodes: Any, rows: Ints) -> tuple[Floats]:
        """Return the speeds of some rows for the next step [m/s]."""
        diagonal = episodes.world.scene.casing.diagonal
        gone = episodes.chains.advances()
        self._judge(episodes, rows, gone / diagonal)
        goal = self._goal[rows]
        back = gone[rows] > goal * diagonal
        over = rows[~back & np.isfinite(goal)]
        self._goal[over] = np.nan
        self._again.restart(over, gone[over])
        speeds = np.where(back, self._speed[rows], 0.0)
        is_first = self.times[rows] == 0
        for plan, own in (self._first, ~back & is_first), (self._again, ~back & ~is_first):
            if own.any():
                speeds[own] = plan(episodes, rows[own])[0]
        self._stood[rows] = np.where(speeds == 0.0, self._stood[rows] + 1, 0)
        return (speeds,)

    def _judge(self, episodes: Any, rows: Ints, gone: Floats) -> None:
        """Start drawing in in the rows with a joint that has turned the wrong way."""
        is_last = gone[rows] > episodes.world.scene.n - 1
        wrong = np.where(is_last, self._at_last[rows], self._wrong[rows])
        is_wrong = _turned_wrong(episodes, rows, wrong, self._stood[rows] >= self._stands[rows])
        begins = is_wrong.any(axis=1) & np.isnan(self._goal[rows])
        begins &= episodes.times(rows) < PATIENCE * episodes.late
        begins &= ~episodes.arrays.released[rows].all(axis=1)
        at = np.maximum(is_wrong.argmax(axis=1) + self._depth[rows], LEAST)
        begins &= gone[rows] > at
        self._goal[rows[begins]] = at[begins]
        self.times[rows] += begins


def _turned_wrong(episodes: Any, rows: Ints, wrong: Floats, stood: Bools) -> Bools:
    """Return which joints of some rows have turned the wrong way, in the order of feed.

    If the feed has `stood` long enough, all misplaced joints count.
    """
    arrays, turns = episodes.arrays, episodes.goals.turns[rows]
    joints = np.diff(arrays.angles[rows], axis=1)
    too_far = np.where(turns == 0.0, np.abs(joints), -np.sign(turns) * joints) > wrong[:, None]
    too_far |= stood[:, None] & (np.abs(joints - turns) > SUCCESS_TOLERANCE)
    return np.where(arrays.forward[rows, None], too_far, too_far[:, ::-1])


class DrawingBackTwice:
    """Plays two folds, with the chain drawn in between, in every row of episodes."""

    def __init__(self, found: Sequence[Refolding]) -> None:
        self._folds = {
            FIRST: DrawingBack([each.first for each in found]),
            SECOND: DrawingBack([each.second for each in found]),
        }
        self._back = np.array([each.back for each in found])
        self._slack = np.array([each.slack for each in found])
        self._goal: Floats = np.full(len(found), np.nan)

    def __call__(self, episodes: Any, rows: Ints) -> tuple[Floats]:
        """Return the speeds of some rows for the next step [m/s]."""
        stage = episodes.stage[rows]
        speeds = np.where(stage == BACK, self._drawn_in(episodes, rows), 0.0)
        for number, fold in self._folds.items():
            own = stage == number
            if own.any():
                speeds[own] = fold(episodes, rows[own])[0]
        return (speeds,)

    def _drawn_in(self, episodes: Any, rows: Ints) -> Floats:
        """Return the speeds of some rows while they draw the chain in [m/s]."""
        gone, scene = episodes.chains.advances()[rows], episodes.world.scene
        slips = episodes.infos(rows)["force"] < -SLIPS * scene.feed.force_limit
        more = gone + self._slack[rows] * scene.casing.diagonal
        # The tube keeps the last component.
        goal = np.minimum(more, (scene.n - LEAST) * scene.casing.diagonal)
        goal = np.where(slips, goal, self._goal[rows])
        self._goal[rows] = np.where(gone >= goal, np.nan, goal)
        return np.where(np.isfinite(self._goal[rows]), -1.0, 1.0) * self._back[rows]
