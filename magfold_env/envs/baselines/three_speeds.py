"""Pushing, pulling and pushing at constant speeds: b where a chain is to fold twice.

Such a schedule pushes all components out but the last, stands still, pulls them in and pushes
them all out. It knows how far the feed has gone, and nothing else. Of the speeds on offer the first
two are taken that draw in the most chains that had reached their first word, on the draws of the
stream ``selection``, then the third that scores best on the same; b is the mean score on those of
``scoring``.
"""

from collections.abc import Callable, Sequence
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from magfold_env.envs.baselines.baseline import Baseline
from magfold_env.envs.baselines.constant_speed import Plan, TaskStore
from magfold_env.envs.chains.arrays import Floats, Ints
from magfold_env.envs.spaces.actions import SLOWEST_LEVEL
from magfold_env.envs.tasks.feed_tasks import FeedWorld

PUSHES = (0.05, 0.15, 0.45)
"""The speeds to push at that are tried [m/s]."""

PULLS = (0.1, 0.3)
"""The speeds to pull at that are tried [m/s]."""

SELECTION_DRAWS = 16
SCORING_DRAWS = 32

INSIDE = 0.3
"""Length that stays in the tube at first, and that stays outside after the pull [diagonals]."""

STAND = 15
"""Steps to stand still in between."""

BRAKE = 8.0
"""How hard the feed slows down before it stands still [m/s²]."""

Speeds = tuple[float, float, float]


class PushPullPush:
    """The schedule of a push, a pull and a push, for every row of episodes.

    Parameters
    ----------
    speeds : array_like, shape (3,) or (m, 3)
        Of the three [m/s].
    count : int
        m, how many episodes there are.

    Attributes
    ----------
    leg : array of int, shape (m,)
        0: on the way out, 1: standing, 2: on the way in, 3: on the way out again.
    """

    def __init__(self, speeds: ArrayLike, count: int) -> None:
        self._speeds = np.broadcast_to(speeds, (count, 3)) * [1.0, -1.0, 1.0]
        self.leg: Ints = np.zeros(count, dtype=np.int64)
        self._stood: Ints = np.zeros(count, dtype=np.int64)

    def __call__(self, episodes: Any, rows: Ints) -> Floats:
        """Return the speeds of some rows in the next step [m/s]."""
        scene, leg = episodes.world.scene, self.leg
        diagonal = scene.casing.diagonal
        gone = episodes.chains.advances()[rows]
        left = (scene.n - INSIDE) * diagonal - gone
        leg[rows] += (leg[rows] == 0) & (left < 0.05 * diagonal)
        self._stood[rows] += leg[rows] == 1
        leg[rows] += (leg[rows] == 1) & (self._stood[rows] > STAND)
        leg[rows] += (leg[rows] == 2) & (gone <= INSIDE * diagonal)
        push, pull, last = self._speeds[rows].T
        slowing = np.sqrt(2.0 * BRAKE * np.maximum(left, 0.0))
        out = np.minimum(push, np.maximum(slowing, SLOWEST_LEVEL))
        return np.choose(leg[rows], [out, np.zeros_like(out), pull, last])


class ThreeSpeedStore(TaskStore):
    """The baselines that such schedules set; arguments are those of `TaskStore`."""

    def __init__(
        self, make_episodes: Callable[..., Any], world: FeedWorld, protocol: Sequence[Any]
    ) -> None:
        own = (PUSHES, PULLS, SELECTION_DRAWS, SCORING_DRAWS, INSIDE, STAND, BRAKE)
        super().__init__(make_episodes, world, (*own, *protocol))

    def compute(self, name: str) -> Baseline:
        """Return the baseline of a task, computed anew."""
        number = self.names.index(name)

        def trial(speeds: Speeds, stream: str, draws: int) -> Any:
            return self._trial(number, _played(PushPullPush(speeds, draws)), stream, draws)

        def drawn_in(speeds: Speeds) -> float:
            return float((trial(speeds, "selection", SELECTION_DRAWS)["stage"] == 2).mean())

        def score(speeds: Speeds) -> float:
            return float(trial(speeds, "selection", SELECTION_DRAWS)["score"].mean())

        first = max(((u, v, PUSHES[-1]) for u, v in product(PUSHES, PULLS)), key=drawn_in)
        speeds = max(((*first[:2], w) for w in PUSHES), key=score)
        ends = trial(speeds, "scoring", SCORING_DRAWS)
        task = self._world.tasks[number]
        return Baseline(
            "-".join(task.words),
            task.sequence,
            speeds[0],
            float(ends["score"].mean()),
            float(ends["is_success"].mean()),
            task.direction,
            speeds[1:],
        )

    def _plan(self, schedules: Sequence[tuple[int, Baseline]]) -> Plan:
        speeds = np.array([(each.speed, *each.later) for _, each in schedules], dtype=np.float64)
        return _played(PushPullPush(speeds, len(schedules)))


def _played(schedule: PushPullPush) -> Plan:
    return lambda episodes, rows: (schedule(episodes, rows),)
