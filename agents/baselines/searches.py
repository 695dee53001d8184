"""The searches by name; those on physics calls alone; and one after another for all targets.

The genetic search goes through PyGAD. A choice is written as one gene a face, N or S, and one a
component for its speed; what is sought is the mean score of the first `RELEASES` calls.

A trained policy that is given physics calls proposes choices, which are arms of a bandit without
end, and calls go to them by Thompson sampling (Thompson, *Biometrika* 25, 1933): every known
choice, and the next proposal, draws its share of successes from what is known of it, and the
largest has the call.
"""

import hashlib
import logging
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pygad
from numpy.typing import NDArray

from agents.baselines.calls import Calls, Search, freeze, freeze_unseen, random_choice
from agents.baselines.designs import MinimiserDesign, RobustSearch
from agents.evaluation import episodes, policies
from agents.evaluation.policies import ChoiceFile, Chosen, OpenLoop
from agents.settings import EnvSettings
from magfold_env.designer import trials
from magfold_env.envs.fold_env import FoldEnv
from magfold_env.envs.spaces.actions import PATTERNS
from magfold_env.files import physics_digest

POPULATION = 40
PARENTS = 10
ELITE = 2
RELEASES = 4
"""Calls that a choice is bred by."""
FINAL = 40
"""Calls that the best of a generation is compared by, as in `magfold_env.designer.trials`."""
GENERATIONS = 10_000
"""More than any budget lasts."""


class CrossEntropySearch:
    """`magfold_env.designer.trials.cross_entropy` from an even distribution.

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
        trials.cross_entropy(
            calls, 4 * env.scene.n, env.actions.speeds.tolist(), rng, calls.budget, goal=self._goal
        )


class GeneticSearch:
    """A genetic algorithm: tournaments, uniform crossover, one gene in a chain mutated.

    Parameters
    ----------
    goal : float
        Share of successes of `FINAL` calls that is enough.
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

        def check(search: pygad.GA) -> str | None:
            genes, _, _ = search.best_solution(search.last_generation_fitness)
            scores = calls.scores([decoded(calls.env, genes)], FINAL)
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
            on_generation=check,
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


class PolicySearch:
    """Watches a policy, first at its best, then as it explores, and tries what it chose again.

    Parameters
    ----------
    greedy : Policy
        Plays what it thinks best.
    exploring : Policy
        Plays as in training, so that it proposes something else each time.
    """

    def __init__(self, greedy: policies.Policy, exploring: policies.Policy) -> None:
        self._greedy, self._exploring = greedy, exploring

    def run(self, calls: Calls, rng: np.random.Generator) -> None:
        """Watch the greedy policy, then propose or try again, call by call."""
        proposals = [calls.watch(self._greedy, rng)]
        while True:
            known = calls.tallies()
            drawn = [
                rng.beta(1 + each.successes, 1 + len(each.scores) - each.successes)
                for each in known
            ]
            new = rng.beta(1 + sum(proposals), 1 + len(proposals) - sum(proposals))
            if drawn and max(drawn) >= new:
                calls.again(known[int(np.argmax(drawn))].choice)
            else:
                proposals.append(calls.watch(self._exploring, rng))


SEARCHES: Mapping[str, Callable[[float], Search]] = {
    "minimiser-free": lambda goal: MinimiserDesign("free"),
    "minimiser-forward": lambda goal: MinimiserDesign("forward"),
    "minimiser-backward": lambda goal: MinimiserDesign("backward"),
    "robust": RobustSearch,
    "cross-entropy": CrossEntropySearch,
    "genetic": GeneticSearch,
}
"""By name, each made with the share of successes that is enough."""


def search_of(name: str, goal: float) -> Search:
    """Return the search called `name`.

    Raises
    ------
    ValueError
        If there is none, or `goal` is no share.
    """
    if name not in SEARCHES:
        raise ValueError(f"search: {name!r} is not allowed; must be one of {', '.join(SEARCHES)}")
    if not 0.0 < goal <= 1.0:
        raise ValueError(f"goal: {goal} is not allowed; must be above 0 and at most 1")
    return SEARCHES[name](goal)


def choose(
    name: str,
    settings: EnvSettings,
    path: Path,
    budget: int,
    goal: float = 1.0,
    seed: int = 0,
    processes: int = 1,
) -> Iterator[tuple[str, Chosen]]:
    """Search for a choice for every target and keep it in a file; yield each as it is known.

    Targets that are in the file already are not searched for again.

    Parameters
    ----------
    name : str
        One of `SEARCHES`.
    settings : EnvSettings
        The environment.
    path : Path
        The file of choices; made if need be.
    budget : int
        Most physics calls for each target.
    goal : float
        Share of successes that ends a search before.
    seed : int
        Of the search and of its physics calls.
    processes : int
        How many targets to search for at a time.

    Raises
    ------
    ValueError
        If there is no such search, or the file is damaged or was written by another one.
    """
    search_of(name, goal)
    env = episodes.make_env(settings)
    scene = env.scene.model_dump_json(exclude={"sequence"})
    key = {
        "search": name,
        "budget": budget,
        "goal": goal,
        "seed": seed,
        "physics": physics_digest(),
        "components": env.scene.n,
        "scene": hashlib.sha256(scene.encode()).hexdigest()[:16],
        # Which targets are searched for does not change what is found for one.
        "env": settings.model_dump(mode="json", exclude={"targets", "difficulty", "shaping"}),
    }
    file = ChoiceFile(path, key)
    yield from ((target, file.chosen[target]) for target in env.targets if target in file.chosen)
    missing = [target for target in env.targets if target not in file.chosen]
    jobs = [(name, settings, target, budget, goal, seed) for target in missing]
    if jobs:
        with episodes.players(processes) as pool:
            for target, chosen in zip(
                missing, episodes.spread_over(pool, _search, jobs), strict=True
            ):
                file.add(target, chosen)
                yield target, chosen


def _search(
    name: str, settings: EnvSettings, target: str, budget: int, goal: float, seed: int
) -> Chosen:
    search, env = search_of(name, goal), _own_env(settings)
    if budget == 0:
        return freeze_unseen(search, env, target, seed)
    return freeze(search, env, target, budget, seed)


_own_env: Callable[[EnvSettings], Any] = cache(episodes.make_env)
