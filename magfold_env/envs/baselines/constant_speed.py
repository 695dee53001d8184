"""The best constant speed of a chain that is given: b where nothing but the speed is free.

Of `SPEEDS` the one that scores best on the draws of the stream ``selection`` is taken, the slowest
of equally good ones, and b is its mean score on those of the stream ``scoring``. Neither are draws
that results are reported on, nor such that anything is trained on.
"""

from collections.abc import Callable, Sequence
from copy import copy
from typing import Any

import numpy as np
from gymnasium.utils import seeding

from magfold_env.envs.baselines.baseline import Baseline, Store, baseline_key, chain_name
from magfold_env.envs.spaces.actions import FASTEST, SLOWEST_LEVEL
from magfold_env.envs.tasks.draws import episode_seeds
from magfold_env.envs.tasks.feed_tasks import FeedTask, FeedWorld
from magfold_env.envs.tasks.reward import RewardRule

SPEEDS: tuple[float, ...] = tuple(np.round(np.geomspace(SLOWEST_LEVEL, FASTEST, 13), 12).tolist())
"""The speeds that are tried [m/s]."""

SELECTION_DRAWS = 64
SCORING_DRAWS = 128


class ConstantSpeedStore(Store):
    """The baselines of a world's tasks.

    Parameters
    ----------
    make_episodes : callable
        Makes so many episodes of the world.
    world : FeedWorld
        What they share; tasks are told apart by name.
    protocol : sequence
        What else the episodes depend on.
    """

    def __init__(
        self, make_episodes: Callable[..., Any], world: FeedWorld, protocol: Sequence[Any]
    ) -> None:
        protocol = (SPEEDS, SELECTION_DRAWS, SCORING_DRAWS, *protocol)
        super().__init__(baseline_key(world.scene, world.match, protocol))
        self._make, self._world = make_episodes, copy(world)
        self._world.rule = RewardRule("score")  # or trials would ask for what they find
        self.names = [_name(task) for task in world.tasks]
        """What the tasks are kept under."""

    def compute(self, name: str) -> Baseline:
        """Return the baseline of a task, computed anew."""
        number = self.names.index(name)
        means = [self._trial(number, speed, "selection", SELECTION_DRAWS)[0] for speed in SPEEDS]
        speed = SPEEDS[int(np.argmax(means))]
        mean, success = self._trial(number, speed, "scoring", SCORING_DRAWS)
        task = self._world.tasks[number]
        return Baseline(task.target, task.sequence, speed, mean, success, task.direction)

    def _trial(self, number: int, speed: float, stream: str, draws: int) -> tuple[float, float]:
        """Return mean score and share of successes of a speed [m/s] on draws of a stream."""
        episodes = self._make(self._world, draws)
        episodes.rngs = [seeding.np_random(seed)[0] for seed in episode_seeds(stream, draws)]
        rows = episodes.rows
        episodes.begin(rows, [number] * draws)
        while len(rows):
            episodes.step(rows, (np.full(len(rows), speed),))
            rows = np.flatnonzero(~episodes.terminated)
        ends = episodes.told_at_end(episodes.rows)
        return float(ends["score"].mean()), float(ends["is_success"].mean())


def _name(task: FeedTask) -> str:
    return chain_name(task.sequence, task.direction, task.target)
