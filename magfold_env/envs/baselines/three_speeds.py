"""The score of a push, a pull and a second push: the baseline b where a chain folds twice.

A schedule pushes out all components except the last, stops, pulls them in and pushes all of them
out, each at a constant speed. It observes only the advance of the feed. The first two speeds are
those with which the most chains reach their first word and are drawn in, on the draws of the stream
``selection``. The third speed scores best on the same draws. b is the mean score on the draws of
the stream ``scoring``.
"""

from collections.abc import Sequence
from itertools import product
from typing import Any

from magfold_env.envs.baselines.baseline import Baseline
from magfold_env.envs.baselines.constant_speed import Plan, TaskStore
from magfold_env.envs.baselines.legs import BRAKE, Following, Leg
from magfold_env.envs.tasks.setup import TaskSetup
from magfold_env.scene import Scene

PUSHES = (0.05, 0.15, 0.45)
"""Candidate speeds for a push [m/s]."""

PULLS = (0.1, 0.3)
"""Candidate speeds for a pull [m/s]."""

INSIDE = 0.3
"""Length that the first push keeps in the tube and the pull leaves outside [diagonals]."""

STAND = 15
"""Number of steps at standstill between the first push and the pull."""

Speeds = tuple[float, float, float]


def push_pull_push(scene: Scene, speeds: Speeds) -> tuple[Leg, ...]:
    """Return the schedule that pushes, pulls and pushes at the three given speeds [m/s]."""
    push, pull, last = speeds
    held = (scene.n - INSIDE) * scene.casing.diagonal
    return (
        Leg(push, held, brakes=True),
        Leg(0.0, steps=STAND),
        Leg(-pull, INSIDE * scene.casing.diagonal),
        Leg(last),
    )


class ThreeSpeedStore(TaskStore):
    """Baselines achieved with `push_pull_push`; the arguments are those of `TaskStore`."""

    draws = (16, 32)

    def protocol(self, setup: TaskSetup) -> tuple[Any, ...]:
        """Return the constants on which baselines of this kind depend."""
        return PUSHES, PULLS, *self.draws, INSIDE, STAND, BRAKE

    def candidates(self, number: int) -> Sequence[Baseline]:
        """Return the schedules to try for a task, as baselines without scores."""
        task = self._setup.tasks[number]

        def schedule(push: float, *later: float) -> Baseline:
            return Baseline(task.aim, task.sequence, push, 0.0, 0.0, task.direction, later)

        def drawn_in(speeds: tuple[float, float]) -> float:
            tried = schedule(*speeds, PUSHES[-1])
            return (self._trial(number, tried)["stage"] == 2).mean()

        first = max(product(PUSHES, PULLS), key=drawn_in)
        return [schedule(*first, last) for last in PUSHES]

    def _plan(self, schedules: Sequence[tuple[int, Baseline]]) -> Plan:
        return Following([way_of(self._setup.scene, each) for _, each in schedules])


def way_of(scene: Scene, baseline: Baseline) -> tuple[Leg, ...]:
    """Return the schedule of a baseline with three speeds."""
    assert baseline.speed is not None
    first, second = baseline.later
    return push_pull_push(scene, (baseline.speed, first, second))
