"""Robust open-loop design: what energies propose is released, and what holds up is kept."""

from collections import Counter
from functools import lru_cache
from typing import Any

import numpy as np

from agents.baselines.calls import Calls
from agents.baselines.search import USUAL_SPEED
from agents.evaluation.open_loop import OpenLoop
from magfold_env.designer.annealing import stable_groups
from magfold_env.designer.search import candidates
from magfold_env.designer.task import SPEEDS, Choice, Task, task_for
from magfold_env.designer.trials import Standing, cross_entropy, race
from magfold_env.envs.fold_env import FoldEnv


class RobustSearch:
    """The design room's search (`magfold_env.designer`) on perturbed runs of the environment.

    Sequences that are good by energy, those under which the target holds where chains are long,
    are raced on releases at one speed after another until one does; if none will, the
    cross-entropy method goes on from the best.

    Parameters
    ----------
    goal : float
        Share of successes of 40 calls that is enough.
    """

    def __init__(self, goal: float) -> None:
        self._goal = goal

    def first(self, env: FoldEnv[Any], target: str, rng: np.random.Generator) -> OpenLoop:
        """Return the best sequence by energy at a usual speed."""
        return OpenLoop.at_one_speed(_proposed(_task(env, target, rng))[0], USUAL_SPEED)

    def run(self, calls: Calls, rng: np.random.Generator) -> None:
        """Race proposals at more and more speeds, then refine the best."""
        task = _task(calls.env, calls.target, rng)
        sequences = _proposed(task)
        standings: list[Standing] = []
        for count in range(1, len(SPEEDS) + 1):
            choices = [Choice(each, speed) for speed in SPEEDS[:count] for each in sequences]
            standings = race(choices, calls)
            if standings[0].rate >= self._goal:
                return
        groups = stable_groups(calls.target)[1] if task.search == "annealing" else None
        cross_entropy(
            calls, 4 * task.scene.n, SPEEDS, rng, calls.budget,
            goal=self._goal, first=standings[0].choice, groups=groups,
        )  # fmt: skip


def _task(env: FoldEnv[Any], target: str, rng: np.random.Generator) -> Task:
    """Return the search by energy; it knows no budget, since it calls no physics."""
    return task_for(
        target, env.scene, env.scene.feed.direction, "probability",
        search=None, seed=int(rng.integers(2**31)), speeds=None, budget=1, goal=1.0, runs=0,
    )  # fmt: skip


@lru_cache(maxsize=64)
def _proposed(task: Task) -> list[tuple[str, ...]]:
    """Return sequences that are good by energy; kept, since one budget after another asks."""
    return candidates(task, Counter(), lambda done: None)
