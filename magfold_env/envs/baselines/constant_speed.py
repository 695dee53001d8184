"""The best constant speed of a given chain: the baseline b where only the speed is free.

The baseline takes the speed of `SPEEDS` that scores best on the draws of the stream ``selection``,
and the slowest of equally good ones. b is its mean score on the draws of the stream ``scoring``.
Neither reported results nor training use these draws.
"""

from abc import abstractmethod
from collections.abc import Callable, Sequence
from copy import copy
from functools import partial
from typing import Any

import numpy as np

from magfold_env.envs.baselines.baseline import Baseline, Store, baseline_key
from magfold_env.envs.chains.arrays import Ints
from magfold_env.envs.spaces.actions import FASTEST, SLOWEST_LEVEL
from magfold_env.envs.tasks.draws import episode_seeds
from magfold_env.envs.tasks.feed_tasks import TaskWorld
from magfold_env.envs.tasks.reward import RewardRule

SPEEDS: tuple[float, ...] = tuple(np.round(np.geomspace(SLOWEST_LEVEL, FASTEST, 13), 12).tolist())
"""Candidate speeds [m/s]."""

SELECTION_DRAWS = 64
SCORING_DRAWS = 128

Plan = Callable[[Any, Ints], Any]
"""Returns the next actions of some rows of episodes, in the form that `World.actions` returns."""


class TaskStore(Store):
    """The baselines of a world's tasks.

    Parameters
    ----------
    make_episodes : callable
        Makes a given number of episodes of the world.
    world : TaskWorld
        What the episodes share; task names are unique.
    protocol : sequence
        What else the baselines depend on.
    """

    def __init__(
        self, make_episodes: Callable[..., Any], world: TaskWorld, protocol: Sequence[Any]
    ) -> None:
        super().__init__(baseline_key(world.scene, world.match, protocol))
        self._make, self._world = make_episodes, copy(world)
        self._world.rule = RewardRule("score")  # trials need no baselines
        self.names = [task.name for task in world.tasks]
        """Cache keys of the tasks."""

    def plan(self, numbers: Sequence[int]) -> Plan:
        """Return a player of the schedules that set the tasks' baselines, one row per task."""
        found = {number: self.get(self.names[number]) for number in set(numbers)}
        return self._plan([(number, found[number]) for number in numbers])

    @abstractmethod
    def _plan(self, schedules: Sequence[tuple[int, Baseline]]) -> Plan:
        """Return a player of the schedules that set the baselines of tasks, given by number."""

    def _trial(self, number: int, plan: Plan, stream: str, draws: int) -> dict[str, Any]:
        """Play a plan for a task on the draws of a stream; return the infos of all episodes."""
        episodes = self._make(self._world, draws)
        seeds = episode_seeds(stream, draws)
        ends = episodes.play(seeds, [number] * draws, partial(plan, episodes))
        return episodes.infos(episodes.rows) | ends


class ConstantSpeedStore(TaskStore):
    """Baselines set by constant speeds; the arguments are those of `TaskStore`."""

    def __init__(
        self, make_episodes: Callable[..., Any], world: TaskWorld, protocol: Sequence[Any]
    ) -> None:
        protocol = (SPEEDS, SELECTION_DRAWS, SCORING_DRAWS, *protocol)
        super().__init__(make_episodes, world, protocol)

    def compute(self, name: str) -> Baseline:
        """Compute the baseline of a task."""
        number = self.names.index(name)
        means = [
            self._trial(number, _always(speed), "selection", SELECTION_DRAWS)["score"].mean()
            for speed in SPEEDS
        ]
        speed = SPEEDS[int(np.argmax(means))]
        ends = self._trial(number, _always(speed), "scoring", SCORING_DRAWS)
        mean, success = float(ends["score"].mean()), float(ends["is_success"].mean())
        task = self._world.tasks[number]
        return Baseline(task.target, task.sequence, speed, mean, success, task.direction)

    def _plan(self, schedules: Sequence[tuple[int, Baseline]]) -> Plan:
        speeds = np.array([baseline.speed for _, baseline in schedules], dtype=np.float64)
        return lambda _, rows: (speeds[rows],)


def _always(speed: float) -> Plan:
    return lambda _, rows: (np.full(len(rows), speed),)
