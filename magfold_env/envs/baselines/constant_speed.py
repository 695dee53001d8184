"""The best constant speed of a given chain: the baseline b where only the speed is free.

The baseline takes the speed of `SPEEDS` that scores best on the draws of the stream ``selection``,
and the slowest of equally good ones. b is its mean score on the draws of the stream ``scoring``.
Neither reported results nor training use these draws.
"""

from abc import abstractmethod
from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import replace
from functools import partial
from typing import Any, ClassVar

import numpy as np

from magfold_env.envs.baselines.baseline import (
    Baseline,
    Store,
    baseline_key,
    unknown_baseline,
)
from magfold_env.envs.chains.arrays import Ints
from magfold_env.envs.spaces.actions import FASTEST, SLOWEST_LEVEL
from magfold_env.envs.tasks.draws import episode_seeds
from magfold_env.envs.tasks.reward import RewardRule
from magfold_env.envs.tasks.world import TaskWorld

SPEEDS: tuple[float, ...] = tuple(np.round(np.geomspace(SLOWEST_LEVEL, FASTEST, 13), 12).tolist())
"""Candidate speeds [m/s]."""

Plan = Callable[[Any, Ints], Any]
"""Returns the next actions of some rows of episodes, in the form that `World.actions` returns."""


class TaskStore(Store):
    """The baselines of a world's tasks: the best of some schedules each.

    It is chosen on the draws of the stream ``selection``, the first of equally good ones, and b is
    its mean score on those of the stream ``scoring``. `make_episodes` makes a number of episodes of
    the world, and `protocol` is what else the baselines depend on.
    """

    draws: ClassVar[tuple[int, int]] = (64, 128)
    """How many draws the schedule is chosen on, and how many it is scored on."""

    def __init__(
        self, make_episodes: Callable[..., Any], world: TaskWorld, protocol: Sequence[Any]
    ) -> None:
        protocol = (*self.protocol(world), *protocol)
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

    @abstractmethod
    def protocol(self, world: TaskWorld) -> tuple[Any, ...]:
        """Return what baselines of this kind depend on."""

    @abstractmethod
    def candidates(self, number: int) -> Sequence[Baseline]:
        """Return the schedules of a task that are tried, without their scores."""

    def compute(self, name: str) -> Baseline:
        """Return the baseline of a task, computed anew."""
        number = self.names.index(name)
        candidates = self.candidates(number)
        if not candidates:
            task = self._world.tasks[number]
            return replace(unknown_baseline(task.aim), direction=task.direction, tray=task.parts)
        best = max(candidates, key=lambda each: self._trial(number, each)["score"].mean())
        ends = self._trial(number, best, scoring=True)
        mean, success = float(ends["score"].mean()), float(ends["is_success"].mean())
        return replace(best, score=mean, success=success)

    def _trial(self, number: int, tried: Baseline, *, scoring: bool = False) -> dict[str, Any]:
        """Return all infos of episodes of a task that a schedule plays."""
        draws = self.draws[scoring]
        episodes, plan = self._make(self._world, draws), self._plan([(number, tried)] * draws)
        seeds = episode_seeds("scoring" if scoring else "selection", draws)
        ends = episodes.play(seeds, [number] * draws, partial(plan, episodes))
        return episodes.infos(episodes.rows) | ends


class ConstantSpeedStore(TaskStore):
    """Baselines set by constant speeds; the arguments are those of `TaskStore`."""

    def protocol(self, world: TaskWorld) -> tuple[Any, ...]:
        """Return what baselines of this kind depend on."""
        return (SPEEDS, *self.draws)

    def candidates(self, number: int) -> Sequence[Baseline]:
        """Return the schedules of a task that are tried, without their scores."""
        task = self._world.tasks[number]
        return [
            Baseline(task.aim, task.sequence, speed, 0.0, 0.0, task.direction) for speed in SPEEDS
        ]

    def _plan(self, schedules: Sequence[tuple[int, Baseline]]) -> Plan:
        speeds = np.array([baseline.speed for _, baseline in schedules], dtype=np.float64)
        return lambda _, rows: (speeds[rows],)
