"""The cross-entropy method on physics calls alone: no energies, and one speed a chain."""

from typing import Any

import numpy as np

from agents.baselines.calls import Calls
from agents.baselines.search import random_choice
from agents.evaluation.open_loop import OpenLoop
from magfold_env.designer.trials import cross_entropy
from magfold_env.envs.fold_env import FoldEnv


class CrossEntropySearch:
    """`magfold_env.designer.trials` from an even distribution.

    Parameters
    ----------
    goal : float
        Share of successes of 40 calls that is enough.
    """

    def __init__(self, goal: float) -> None:
        self._goal = goal

    def first(self, env: FoldEnv[Any], target: str, rng: np.random.Generator) -> OpenLoop:
        """Return a random choice."""
        return random_choice(env, rng)

    def run(self, calls: Calls, rng: np.random.Generator) -> None:
        """Move the distribution towards what folds."""
        env = calls.env
        cross_entropy(
            calls, 4 * env.scene.n, env.actions.speeds.tolist(), rng, calls.budget, goal=self._goal
        )
