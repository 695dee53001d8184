"""Where contestants meet: the tasks, the draws, and episodes played side by side.

The draws that results are reported on are of a stream of their own, which neither searches nor
training use.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property, partial
from typing import Any, Protocol

import numpy as np

from agents.admission.halving import Ranked
from agents.admission.orders import Orders
from agents.admission.schedules import Schedules
from magfold_env.envs.baselines.constant_speed import Plan
from magfold_env.envs.chains.arrays import Floats, Ints
from magfold_env.envs.feed_track import FeedTrackEnv
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


class OpenLoops(Protocol):
    """What can be chosen before an episode begins; all that differs from track to track.

    Open loops are values of a kind of its own, which can be pickled and written in words.
    """

    @property
    def fastest(self) -> Any:
        """The open loop that always goes forward."""
        ...

    def candidates(self, count: int, number: int) -> list[Any]:
        """Return so many open loops that may be tried in a task, by its number."""
        ...

    def following(self, found: Sequence[Any]) -> Plan:
        """Return what plays open loops, one a row."""
        ...

    def drawn(self) -> tuple[Scene, Any]:
        """Return scene and task of the environment's episode, with all that was drawn of them."""
        ...

    def raced(self, best: list[Any], number: int, task: Any) -> list[Any]:
        """Return as many as came farthest in a task's search, `best`, for the oracle to race.

        `number` is the task's, `task` is it as `drawn` returns it.
        """
        ...


@dataclass(frozen=True)
class Arena(Track):
    """A track on the draws of `EVALUATION`, and what else contestants need."""

    stream: str = field(default=EVALUATION, kw_only=True)

    @cached_property
    def open_loops(self) -> OpenLoops:
        """What can be chosen beforehand."""
        env: Any = self.env
        return Schedules(env) if isinstance(env, FeedTrackEnv) else Orders(env)

    def ranked(self, count: int, number: int, best: list[Ranked]) -> list[Any]:
        """Return those of so many open loops of a task that came farthest."""
        tried = self.open_loops.candidates(count, number)
        return [tried[each.place] for each in best]

    @cached_property
    def field(self) -> "Field":
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


class Field:
    """Room for episodes that are played by plans which see nothing of the chain."""

    def __init__(self, episodes: Any, open_loops: OpenLoops) -> None:
        self._episodes, self._open_loops = episodes, open_loops

    def follow(self, numbers: Ints, seeds: list[int], found: Sequence[Any]) -> Floats:
        """Return success and score of episodes that are played by open loops, (m, 2).

        `numbers` are those of their tasks.
        """
        return self.play(numbers, seeds, lambda part: self._open_loops.following(found[part]))

    def play(self, numbers: Ints, seeds: list[int], plan: Callable[[slice], Plan]) -> Floats:
        """Return the same of episodes that are played by what `plan` returns for a part of them."""
        episodes, ends = self._episodes, np.empty((len(seeds), 2))
        for start in range(0, len(seeds), episodes.count):
            part = slice(start, start + episodes.count)
            choose = partial(plan(part), episodes)
            columns = episodes.play(seeds[part], numbers[part].tolist(), choose)
            ends[part] = np.column_stack([columns["is_success"], columns["score"]])
        return ends


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
