"""The best open loops of every task, which one search finds for many runs.

The search takes a long time. It is stored beside the runs in ``open-loops-ID-KEY``, for all runs
with the same imitation, scene, tasks and actions. The next run continues an interrupted search.
"""

import hashlib
import json
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from agents.commands import progress_bar
from agents.evaluation.episodes import Table
from agents.open_loops.search import RolloutPool, Search, open_loops_of
from agents.settings import EnvSettings
from agents.training.envs import make_env
from magfold_env.files import physics_digest
from magfold_env.scoring.track import WIDTH

STREAM = "imitation"
"""Name of the random stream that draws the episodes of the search for open loops."""

KEPT = 16
"""Largest number of open loops that are kept per task."""


def best_open_loops(settings: EnvSettings, effort: Search, folder: Path) -> list[list[Any]]:
    """Return the best open loops of every task of an environment, the best first.

    Open loops are expressed as the environment's actions. `effort` is the effort per task, and
    `folder` contains the folders of searches.
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

    `search` returns the result of a task as JSON values; several processes call it with `jobs`, one
    per task. `effort` contains further values on which the results depend, and `folder` contains
    the folders of searches.
    """
    env: Any = make_env(settings).unwrapped
    key: dict[str, Any] = {
        "env": settings.model_dump(mode="json"),
        "scene": env.setup.scene.model_dump(mode="json"),
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
    ranked = pool_of(env).search(number, STREAM, effort)
    return [each.place for each in ranked[:KEPT] if each.successes] or [ranked[0].place]


def pool_of(env: Any) -> RolloutPool:
    """Return reusable episodes in which choices are expressed as actions."""
    return RolloutPool(env.make_episodes(env.setup, WIDTH), open_loops_of(env), env.setup.actions)
