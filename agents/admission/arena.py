"""Where contestants meet: the tasks, the draws, and episodes played side by side.

The draws that results are reported on are of a stream of their own, which neither searches nor
training use.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache, cached_property, partial

import numpy as np

from agents.admission.halving import Ranked
from agents.admission.schedules import Schedule, constant, following, schedules
from magfold_env.envs.baselines.constant_speed import SPEEDS, Plan
from magfold_env.envs.baselines.three_speeds import way_of
from magfold_env.envs.chains.arrays import Floats, Ints
from magfold_env.envs.feed_track import FeedEpisodes
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

    def schedules(self, count: int, number: int) -> list[Schedule]:
        """Return so many schedules that may be tried in a task, by its number."""
        scene, refolds = self.world.scene, len(self.env.tasks[number].words) > 1
        simple = [constant(speed) for speed in SPEEDS]
        if refolds:
            simple = [Schedule("baseline", way_of(scene, self.env.baseline_of(number)))]
        return schedules(count, scene, self.horizon, number, simple, refolds)

    def ranked(self, count: int, number: int, best: list[Ranked]) -> list[Schedule]:
        """Return those of so many schedules of a task that came farthest."""
        tried = self.schedules(count, number)
        return [tried[each.place] for each in best]

    @cached_property
    def field(self) -> "Field":
        """Room for episodes of these tasks, made once."""
        return Field(self.episodes(WIDTH))

    def drawn_scene(self, episode: int) -> Scene:
        """Return an episode's scene as it is drawn."""
        numbers, seeds = self.draws(episode, episode + 1)
        self.env.reset(seed=seeds[0], options={"task": int(numbers[0])})
        return self.env.to_scene()


@cache
def own_arena(env_id: str, tasks: int, randomised: bool = True) -> Arena:
    """Return this process's own arena, made once."""
    return Arena(env_id, tasks, randomised)


class Field:
    """Room for episodes that are fed by plans which see nothing of the chain."""

    def __init__(self, episodes: FeedEpisodes) -> None:
        self._episodes = episodes
        self.horizon = episodes.horizon
        """Steps of the longest of them."""

    def feed(self, numbers: Ints, seeds: list[int], speeds: Floats) -> Floats:
        """Return success and score of episodes, (m, 2).

        `numbers` are those of their tasks, and `speeds` those of their steps [m/s], (m, horizon).
        """

        def plan(part: slice) -> Plan:
            table = speeds[part]
            return lambda episodes, rows: (table[rows, episodes.steps[rows]],)

        return self.play(numbers, seeds, plan)

    def follow(self, numbers: Ints, seeds: list[int], found: list[Schedule]) -> Floats:
        """Return the same of episodes that are fed by schedules."""
        return self.play(numbers, seeds, lambda part: following(found[part]))

    def play(self, numbers: Ints, seeds: list[int], plan: Callable[[slice], Plan]) -> Floats:
        """Return the same of episodes that are fed by what `plan` returns for a part of them."""
        episodes, ends = self._episodes, np.empty((len(seeds), 2))
        for start in range(0, len(seeds), episodes.count):
            part = slice(start, start + episodes.count)
            choose = partial(plan(part), episodes)
            columns = episodes.play(seeds[part], numbers[part].tolist(), choose)
            ends[part] = np.column_stack([columns["is_success"], columns["score"]])
        return ends
