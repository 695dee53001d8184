"""The score of a chain at its best constant speed: the baseline b where agents set only the speed.

The baseline uses the speed in `SPEEDS` that scores best on the draws of the stream ``selection``.
If several are equally good, it uses the slowest. b is the mean score at that speed on the draws of
the stream ``scoring``. Training and reported results use other draws.
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
from magfold_env.envs.tasks.setup import TaskSetup

SPEEDS: tuple[float, ...] = tuple(np.round(np.geomspace(SLOWEST_LEVEL, FASTEST, 13), 12).tolist())
"""Candidate speeds [m/s]."""

Plan = Callable[[Any, Ints], Any]
"""A function of episodes and rows that returns decoded actions for these rows."""


class TaskStore(Store):
    """The baselines of a setup's tasks: for each task, the best of several feed schedules.

    The best schedule is the first with the highest mean score on the draws of the stream
    ``selection``. b is its mean score on the draws of the stream ``scoring``. `make_episodes`,
    called with the setup and a count, returns that many episodes. `protocol` lists other constants
    on which the baselines depend.
    """

    draws: ClassVar[tuple[int, int]] = (64, 128)
    """Numbers of draws for choosing the schedule and for scoring it."""

    def __init__(
        self, make_episodes: Callable[..., Any], setup: TaskSetup, protocol: Sequence[Any]
    ) -> None:
        protocol = (*self.protocol(setup), *protocol)
        super().__init__(baseline_key(setup.scene, setup.match, protocol))
        self._make, self._setup = make_episodes, copy(setup)
        self._setup.rule = RewardRule("score")  # trials need no baselines
        self.names = [task.name for task in setup.tasks]
        """Cache keys of the tasks."""

    def plan(self, numbers: Sequence[int]) -> Plan:
        """Return a function that plays the baseline schedule of each given task in its own row."""
        found = {number: self.get(self.names[number]) for number in set(numbers)}
        return self._plan([(number, found[number]) for number in numbers])

    @abstractmethod
    def _plan(self, schedules: Sequence[tuple[int, Baseline]]) -> Plan:
        """Return a function that plays one schedule per row, each given with its task number."""

    @abstractmethod
    def protocol(self, setup: TaskSetup) -> tuple[Any, ...]:
        """Return the constants on which baselines of this kind depend."""

    @abstractmethod
    def candidates(self, number: int) -> Sequence[Baseline]:
        """Return the schedules to try for a task, as baselines without scores."""

    def compute(self, name: str) -> Baseline:
        """Compute the baseline of a task without the cache."""
        number = self.names.index(name)
        candidates = self.candidates(number)
        if not candidates:
            task = self._setup.tasks[number]
            return replace(unknown_baseline(task.aim), direction=task.direction, tray=task.parts)
        best = max(candidates, key=lambda each: self._trial(number, each)["score"].mean())
        ends = self._trial(number, best, scoring=True)
        mean, success = float(ends["score"].mean()), float(ends["is_success"].mean())
        return replace(best, score=mean, success=success)

    def _trial(self, number: int, tried: Baseline, *, scoring: bool = False) -> dict[str, Any]:
        """Return all infos of episodes that try a schedule on a task, as arrays by key."""
        draws = self.draws[scoring]
        episodes, plan = self._make(self._setup, draws), self._plan([(number, tried)] * draws)
        seeds = episode_seeds("scoring" if scoring else "selection", draws)
        ends = episodes.play(seeds, [number] * draws, partial(plan, episodes))
        return episodes.infos(episodes.rows) | ends


class ConstantSpeedStore(TaskStore):
    """Baselines achieved with constant speeds; the arguments are those of `TaskStore`."""

    def protocol(self, setup: TaskSetup) -> tuple[Any, ...]:
        """Return the constants on which baselines of this kind depend."""
        return (SPEEDS, *self.draws)

    def candidates(self, number: int) -> Sequence[Baseline]:
        """Return the schedules to try for a task, as baselines without scores."""
        task = self._setup.tasks[number]
        return [
            Baseline(task.aim, task.sequence, speed, 0.0, 0.0, task.direction) for speed in SPEEDS
        ]

    def _plan(self, schedules: Sequence[tuple[int, Baseline]]) -> Plan:
        speeds = np.array([baseline.speed for _, baseline in schedules], dtype=np.float64)
        return lambda _, rows: (speeds[rows],)
