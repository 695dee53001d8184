"""Where contestants meet: the tasks, the draws, and episodes played side by side.

The draws that results are reported on are of a stream of their own, which neither searches nor
training use.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property
from typing import Any

import numpy as np

from agents.open_loops.field import Field, OpenLoops, open_loops_of
from agents.open_loops.halving import Ranked
from magfold_env.envs.baselines.constant_speed import Plan
from magfold_env.envs.chains.arrays import Ints
from magfold_env.envs.tasks.feed_tasks import Task
from magfold_env.scene import Scene
from magfold_env.scoring.track import WIDTH, Track

EVALUATION = "admission"
"""Stream of the draws that results are reported on."""

SEARCH = "admission search"
"""Stream of the draws that open loops are chosen on."""


def copies(episode: int) -> str:
    """Return the stream of the draws that the oracle tries an episode's physics on."""
    return f"admission copies {episode}"


@dataclass(frozen=True)
class Arena(Track):
    """A track on the draws of `EVALUATION`, and what else contestants need."""

    stream: str = field(default=EVALUATION, kw_only=True)

    @cached_property
    def open_loops(self) -> OpenLoops:
        """What can be chosen beforehand."""
        return open_loops_of(self.env)

    def ranked(self, count: int, number: int, best: list[Ranked]) -> list[Any]:
        """Return those of so many open loops of a task that came farthest."""
        tried = self.open_loops.candidates(count, number)
        return [tried[each.place] for each in best]

    @cached_property
    def field(self) -> Field:
        """Room for episodes of these tasks, made once."""
        return Field(self.episodes(WIDTH), self.open_loops)

    def drawn(self, episode: int) -> tuple[Scene, Task]:
        """Return scene and task of an episode, with all that is drawn of them."""
        numbers, seeds = self.draws(episode, episode + 1)
        self.env.reset(seed=seeds[0], options={"task": int(numbers[0])})
        return self.open_loops.drawn()


@cache
def own_arena(env_id: str, tasks: int, randomised: bool = True) -> Arena:
    """Return this process's own arena, made once."""
    return Arena(env_id, tasks, randomised)


def replaying(chosen: Sequence[Sequence[Any]]) -> Plan:
    """Return what plays choices that were made before, one a step; the last one is kept.

    `chosen` are those of every row, as `World.actions` reads a single one.
    """
    taken = np.zeros(len(chosen), dtype=np.int64)

    def plan(_: Any, rows: Ints) -> Any:
        now = [chosen[row][min(int(taken[row]), len(chosen[row]) - 1)] for row in rows.tolist()]
        taken[rows] += 1
        return tuple(np.array(part) for part in zip(*now, strict=True))

    return plan
