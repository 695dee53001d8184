"""What the best open loops do: they are searched for each task, and shown where they succeed.

In every episode the one that came farthest in the task's search is played, or where that fails the
next that does not, as can be known of an episode of training, which can be played again. So what
is shown is mostly one schedule, and how episodes look in which another is better.

The search is long. It lies beside the runs, in ``open-loops-ID-KEY``, for all that imitate the same
with the same tasks and actions, and goes on where it was broken off.
"""

import hashlib
import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from agents.commands import progress_bar
from agents.evaluation.episodes import spread_over
from agents.open_loops.field import Field, Search, open_loops_of
from agents.settings import EnvSettings
from agents.training.envs import make_env
from magfold_env.checkpoint import Checkpoint
from magfold_env.envs.baselines.constant_speed import Plan
from magfold_env.envs.chains.arrays import Bools
from magfold_env.files import physics_digest
from magfold_env.scoring.track import WIDTH

STREAM = "imitation"
"""Of the draws that open loops are searched on."""

SHOWN = 16
"""Open loops of a task of which one is shown."""


class BestOpenLoops:
    """Plays in each episode the best open loop of its task that succeeds in it.

    Where none does it is the best of the task.

    Parameters
    ----------
    settings : EnvSettings
        Those of the environment; open loops do what its actions can say.
    effort : Search
        How much is tried for every task.
    folder : Path
        Where folders of searches lie.
    """

    def __init__(self, settings: EnvSettings, effort: Search, folder: Path) -> None:
        env: Any = make_env(settings).unwrapped
        self._loops = open_loops_of(env)
        self._field = _field(env)
        self._best = [
            [self._loops.candidates(effort.candidates, number)[place] for place in places]
            for number, places in enumerate(_searched(settings, env, effort, folder))
        ]

    def plan(self, numbers: Sequence[int], seeds: Sequence[int]) -> Plan:
        """Return what plays episodes of tasks, by number, with such seeds, one a row."""
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
        """Return where the open loops of some rank do."""
        own = np.array([numbers[row] for row in rows])
        found = [self._best[number][rank] for number in own.tolist()]
        return self._field.follow(own, [seeds[row] for row in rows], found)[:, 0] > 0.0


def _searched(settings: EnvSettings, env: Any, effort: Search, folder: Path) -> list[list[int]]:
    """Return for every task the places of its best open loops among all that were tried."""
    key: dict[str, Any] = {
        "env": settings.model_dump(mode="json"),
        "tasks": [task.model_dump(mode="json") for task in env.tasks],
        "search": effort,
        "physics": physics_digest(),
    }
    digest = hashlib.sha256(json.dumps(key, sort_keys=True).encode()).hexdigest()[:8]
    name = f"open-loops-{settings.id.rpartition('/')[2]}-{digest}"
    with Checkpoint(folder / name, key) as kept, progress_bar() as bar:
        found: list[list[int]] = kept.load()
        jobs = [(settings, number, effort) for number in range(len(found), len(env.tasks))]
        task = bar.add_task("open loops", total=len(env.tasks), completed=len(found), note="")
        for places in spread_over(len(os.sched_getaffinity(0)), _search, jobs):
            found.append(places)
            kept.add(places)
            bar.update(task, completed=len(found))
    return found


def _search(settings: EnvSettings, number: int, effort: Search) -> list[int]:
    env: Any = make_env(settings).unwrapped
    ranked = _field(env).search(number, STREAM, effort)
    return [each.place for each in ranked[:SHOWN] if each.successes] or [ranked[0].place]


def _field(env: Any) -> Field:
    return Field(env.make_episodes(env.world, WIDTH), open_loops_of(env), env.world.actions)
