"""The searches by name, and one after another for all targets, into a file."""

import hashlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from agents.baselines.entropy import CrossEntropySearch
from agents.baselines.genetic import GeneticSearch
from agents.baselines.minimiser import MinimiserDesign
from agents.baselines.robust import RobustSearch
from agents.baselines.search import Search, freeze, freeze_unseen
from agents.baselines.store import ChoiceFile, Chosen
from agents.evaluation.episodes import make_env, players
from agents.settings.run import EnvSettings
from magfold_env.files import physics_digest

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
    env = make_env(settings)
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
    for target, chosen in _search_all(name, settings, missing, budget, goal, seed, processes):
        file.add(target, chosen)
        yield target, chosen


def _search_all(
    name: str,
    settings: EnvSettings,
    targets: Sequence[str],
    budget: int,
    goal: float,
    seed: int,
    processes: int,
) -> Iterator[tuple[str, Chosen]]:
    jobs = [(name, settings, target, budget, goal, seed) for target in targets]
    if not jobs:
        return
    columns = tuple(zip(*jobs, strict=True))
    with players(processes) as pool:
        found = map(_search, *columns) if pool is None else pool.map(_search, *columns)
        yield from zip(targets, found, strict=True)


def _search(
    name: str, settings: EnvSettings, target: str, budget: int, goal: float, seed: int
) -> Chosen:
    search, env = search_of(name, goal), _own_env(settings)
    if budget == 0:
        return freeze_unseen(search, env, target, seed)
    return freeze(search, env, target, budget, seed)


_own_env: Callable[[EnvSettings], Any] = cache(make_env)
