"""Genetic search on physics calls alone, through PyGAD.

A choice is written as one gene a face, N or S, and one a component for its speed; what is sought
is the mean score of the first `RELEASES` calls.
"""

import logging
from typing import Any

import numpy as np
import pygad
from numpy.typing import NDArray

from agents.baselines.calls import Calls
from agents.baselines.search import random_choice
from agents.evaluation.open_loop import OpenLoop
from magfold_env.envs.fold_env import FoldEnv
from magfold_env.envs.spaces.actions import PATTERNS

POPULATION = 40
PARENTS = 10
ELITE = 2
RELEASES = 4
"""Calls that a choice is bred by."""
JUDGED = 40
"""Calls that the best of a generation is judged by, as in `magfold_env.designer.trials`."""
GENERATIONS = 10_000
"""More than any budget lasts."""


class GeneticSearch:
    """A genetic algorithm: tournaments, uniform crossover, one gene in a chain mutated.

    Parameters
    ----------
    goal : float
        Share of successes of `JUDGED` calls that is enough.
    """

    def __init__(self, goal: float) -> None:
        self._goal = goal

    def first(self, env: FoldEnv[Any], target: str, rng: np.random.Generator) -> OpenLoop:
        """Return a random choice."""
        return random_choice(env, rng)

    def run(self, calls: Calls, rng: np.random.Generator) -> None:
        """Breed choices; seeds NumPy's and Python's global random numbers, which PyGAD uses."""
        n, levels = calls.env.scene.n, calls.env.actions.levels

        def fitness(_: pygad.GA, genes: NDArray[np.int64], __: object) -> list[float]:
            choices = [decoded(calls.env, row) for row in genes]
            return calls.scores(choices, RELEASES).mean(axis=1).tolist()

        def judge(search: pygad.GA) -> str | None:
            genes, _, _ = search.best_solution(search.last_generation_fitness)
            scores = calls.scores([decoded(calls.env, genes)], JUDGED)
            return "stop" if np.mean(scores == 1.0) >= self._goal else None

        pygad.GA(
            num_generations=GENERATIONS,
            sol_per_pop=POPULATION,
            num_parents_mating=PARENTS,
            keep_elitism=ELITE,
            num_genes=5 * n,
            gene_space=[[0, 1]] * (4 * n) + [range(levels)] * n,
            gene_type=int,
            fitness_func=fitness,
            fitness_batch_size=POPULATION,
            on_generation=judge,
            parent_selection_type="tournament",
            crossover_type="uniform",
            mutation_type="random",
            mutation_probability=1.0 / (5 * n),
            random_seed=int(rng.integers(2**31)),
            suppress_warnings=True,
            logger=_silent(),
        ).run()


def decoded(env: FoldEnv[Any], genes: NDArray[np.int64]) -> OpenLoop:
    """Return the choice that genes stand for: 4 n faces, N = 0 and S = 1, then n speed levels."""
    n = env.scene.n
    faces = np.asarray(genes[: 4 * n], dtype=np.uint8).reshape(n, 4)
    patterns = np.packbits(faces, axis=1)[:, 0] >> 4
    speeds = env.actions.speeds[np.asarray(genes[4 * n :], dtype=np.int64)]
    return OpenLoop(tuple(PATTERNS[p] for p in patterns.tolist()), tuple(speeds.tolist()))


def _silent() -> logging.Logger:
    """Return a logger that says nothing: PyGAD reports the error that ends the search."""
    logger = logging.Logger("pygad")
    logger.addHandler(logging.NullHandler())
    return logger
