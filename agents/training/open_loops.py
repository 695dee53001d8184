"""Demonstrations by the best open loops, which are searched for each task.

Every episode is played by the best open loop of the task's search that succeeds in it; this is
known because training episodes can be repeated. The demonstrations are therefore mostly one
schedule, and episodes in which another is better.

The search is long. It is stored beside the runs in ``open-loops-ID-KEY``, for all runs with the
same imitation, scene, tasks and actions, and an interrupted search continues.
"""

import hashlib
import json
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from agents.commands import progress_bar
from agents.evaluation.episodes import Table
from agents.open_loops.search import Field, Search, open_loops_of
from agents.settings import EnvSettings
from agents.training.envs import make_env
from magfold_env.envs.baselines.constant_speed import Plan
from magfold_env.envs.chains.arrays import Bools
from magfold_env.files import physics_digest
from magfold_env.scoring.track import WIDTH

STREAM = "imitation"
"""Stream of the draws of the search for open loops."""

SHOWN = 16
"""Number of open loops of a task from which one is demonstrated."""


class BestOpenLoops:
    """Plays in each episode the best open loop of its task that succeeds in it.

    If none succeeds, the best of the task plays.

    Parameters
    ----------
    settings : EnvSettings
        Settings of the environment; open loops use its actions.
    effort : Search
        Effort of the search for every task.
    folder : Path
        Folder that contains the folders of searches.
    """

    def __init__(self, settings: EnvSettings, effort: Search, folder: Path) -> None:
        env: Any = make_env(settings).unwrapped
        self._loops, self._field = open_loops_of(env), field_of(env)
        self._best = best_open_loops(settings, effort, folder)

    def plan(self, numbers: Sequence[int], seeds: Sequence[int]) -> Plan:
        """Return a plan that plays episodes of tasks, by number, with given seeds, one per row."""
        ranks = np.zeros(len(seeds), dtype=np.int64)
        left = np.arange(len(seeds))
        for rank in range(max(map(len, self._best))):
            left = np.array([row for row in left.tolist() if rank < len(self._best[numbers[row]])])
            if not left.size:
                break
            succeeds = self._succeeds(numbers, seeds, left.tolist(), rank)
            ranks[left[succeeds]] = rank
            left = left[~succeeds]
        pairs = zip(numbers, ranks.tolist(), strict=True)
        return self._loops.following([self._best[number][rank] for number, rank in pairs])

    def _succeeds(
        self, numbers: Sequence[int], seeds: Sequence[int], rows: Sequence[int], rank: int
    ) -> Bools:
        """Return where the open loops of a rank succeed."""
        own = np.array([numbers[row] for row in rows])
        found = [self._best[number][rank] for number in own.tolist()]
        return self._field.follow(own, [seeds[row] for row in rows], found)[:, 0] > 0.0


def best_open_loops(settings: EnvSettings, effort: Search, folder: Path) -> list[list[Any]]:
    """Return the best open loops of every task of an environment, the best first.

    Arguments are those of `BestOpenLoops`.
    """
    env: Any = make_env(settings).unwrapped
    loops, jobs = open_loops_of(env), [(settings, n, effort) for n in range(len(env.tasks))]
    key = {"search": effort}
    found: list[list[int]] = kept_search("open loops", settings, key, folder, _search, jobs)
    return [
        [loops.candidates(effort.candidates, number)[place] for place in places]
        for number, places in enumerate(found)
    ]


def kept_search(
    title: str,
    settings: EnvSettings,
    effort: dict[str, Any],
    folder: Path,
    search: Callable[..., Any],
    jobs: Sequence[tuple[Any, ...]],
) -> list[Any]:
    """Return the results of a search for every task of an environment, stored beside runs.

    Parameters
    ----------
    title : str
        Name of the search.
    settings : EnvSettings
        Those of the environment.
    effort : dict
        Further values that the results depend on.
    folder : Path
        Folder that contains the folders of searches.
    search
        Returns the result of a task from a job, as JSON values; it is called in processes.
    jobs
        The arguments of `search` for every task.
    """
    env: Any = make_env(settings).unwrapped
    key: dict[str, Any] = {
        "env": settings.model_dump(mode="json"),
        "scene": env.world.scene.model_dump(mode="json"),
        "tasks": [task.model_dump(mode="json") for task in env.tasks],
        "physics": physics_digest(),
        **effort,
    }
    digest = hashlib.sha256(json.dumps(key, sort_keys=True).encode()).hexdigest()[:8]
    name = f"{title.replace(' ', '-')}-{settings.id.rpartition('/')[2]}-{digest}"
    with progress_bar() as bar:
        # Runs that begin together share one search: the first runs it and the others wait.
        table = Table(bar, len(os.sched_getaffinity(0)), folder, key, wait=True)
        return table.row(name, len(jobs), lambda at, _: (search, *jobs[at]), _searched)


def _searched(search: Callable[..., Any], *job: Any) -> list[Any]:
    return [search(*job)]


def _search(settings: EnvSettings, number: int, effort: Search) -> list[int]:
    env: Any = make_env(settings).unwrapped
    ranked = field_of(env).search(number, STREAM, effort)
    return [each.place for each in ranked[:SHOWN] if each.successes] or [ranked[0].place]


def field_of(env: Any) -> Field:
    """Return reusable episodes in which choices are expressed as actions."""
    return Field(env.make_episodes(env.world, WIDTH), open_loops_of(env), env.world.actions)
