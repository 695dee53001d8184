"""Where contestants meet: the tasks, the draws, and episodes played side by side.

The draws that results are reported on are of a stream of their own, which neither searches nor
training use: training seeds are small numbers, and every other purpose has another stream.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any, cast

import gymnasium
import numpy as np
from gymnasium import Space, spaces

from agents.admission.schedules import Schedule, schedules
from agents.settings import FEED_TRACKS
from magfold_env.envs.baselines.constant_speed import Plan
from magfold_env.envs.chains.arrays import Floats, Ints
from magfold_env.envs.feed_track import FeedEpisodes, FeedTrackEnv
from magfold_env.envs.tasks.draws import episode_seeds
from magfold_env.envs.tasks.feed_tasks import FeedWorld
from magfold_env.scene import Scene

EVALUATION = "admission"
"""Stream of the draws that results are reported on."""

SEARCH = "admission search"
"""Stream of the draws that open loops are chosen on."""

WIDTH = 64
"""Episodes played side by side."""

_AT_ONCE = 1000


def copies(episode: int) -> str:
    """Return the stream of the draws that the oracle tries an episode's physics on."""
    return f"admission copies {episode}"


def choice_of_tasks(available: int, wanted: int) -> list[int]:
    """Return the numbers of so many tasks, spread evenly over the list, the first among them."""
    wanted = min(available, wanted)
    return [place * available // wanted for place in range(wanted)]


@dataclass(frozen=True)
class Arena:
    """An environment and the tasks that its contestants play, one episode after another.

    Episode i is of task i, counted round; its draws follow from the seed i of `EVALUATION`.

    Raises
    ------
    ValueError
        If the feed's speed is not all that is free in it.
    """

    env_id: str
    """Its name with Gymnasium."""
    tasks: int
    """How many tasks at most."""
    randomised: bool = True
    """Whether physics and start are drawn, as the environment does by default."""

    def __post_init__(self) -> None:
        if self.env_id not in FEED_TRACKS:
            allowed = ", ".join(FEED_TRACKS)
            raise ValueError(f"id: {self.env_id!r} is not allowed; must be one of {allowed}")

    @cached_property
    def env(self) -> FeedTrackEnv:
        """A single environment, in which nothing happens."""
        return self._made()

    def env_of(self, actions: Space[Any]) -> FeedTrackEnv:
        """Return a single environment that takes some actions, if there is one."""
        if isinstance(actions, spaces.Discrete):
            return self._made(actions="discrete", speeds=max(2, int(actions.n) // 2))
        return self.env

    def _made(self, **options: Any) -> FeedTrackEnv:
        if not self.randomised:
            options["randomisation"] = "none"
        made = gymnasium.make(self.env_id, disable_env_checker=True, **options)
        return cast("FeedTrackEnv", made.unwrapped)

    @property
    def world(self) -> FeedWorld:
        """What all episodes share."""
        return self.env.world

    @cached_property
    def numbers(self) -> list[int]:
        """The numbers of the tasks that are played."""
        return choice_of_tasks(len(self.env.tasks), self.tasks)

    def schedules(self, count: int, number: int) -> list[Schedule]:
        """Return so many schedules that may be tried in a task, by its number."""
        scene = self.world.scene
        return schedules(count, scene.n * scene.casing.diagonal, self.horizon, number)

    @property
    def horizon(self) -> int:
        """Steps after which an episode is too late."""
        return self._kind.horizon

    def episodes(self, count: int, world: FeedWorld | None = None) -> FeedEpisodes:
        """Return room for so many episodes side by side, of these tasks or of another world."""
        return self._kind(world or self.world, count)

    @property
    def _kind(self) -> type[FeedEpisodes]:
        return cast("type[FeedEpisodes]", type(self.env).make_episodes)

    @cached_property
    def field(self) -> "Field":
        """Room for episodes of these tasks, made once."""
        return Field(self.episodes(WIDTH))

    def draws(self, start: int, stop: int) -> tuple[Ints, list[int]]:
        """Return the tasks, by number, and the seeds of some of the episodes."""
        numbers = np.array(self.numbers)[np.arange(start, stop) % len(self.numbers)]
        return numbers, _seeds(-(-stop // _AT_ONCE) * _AT_ONCE)[start:stop]

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
            return lambda episodes, rows: table[rows, episodes.steps[rows]]

        return self.play(numbers, seeds, plan)

    def play(self, numbers: Ints, seeds: list[int], plan: Callable[[slice], Plan]) -> Floats:
        """Return the same of episodes that are fed by what `plan` returns for a part of them."""
        episodes, ends = self._episodes, np.empty((len(seeds), 2))
        for start in range(0, len(seeds), episodes.count):
            part = slice(start, start + episodes.count)
            speeds = plan(part)
            columns = episodes.play(
                seeds[part],
                numbers[part].tolist(),
                lambda rows, speeds=speeds: (speeds(episodes, rows),),
            )
            ends[part] = np.column_stack([columns["is_success"], columns["score"]])
        return ends


@cache
def _seeds(count: int) -> list[int]:
    return episode_seeds(EVALUATION, count)
