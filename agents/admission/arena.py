"""Where contestants meet: the tasks, the draws, and episodes played side by side.

The draws that results are reported on are of a stream of their own, which neither searches nor
training use: training seeds are small numbers, and every other purpose has another stream.
"""

from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any, cast

import gymnasium
import numpy as np
from gymnasium import Space, spaces

from agents.settings import FLOOR_ENV
from magfold_env.envs.chains.arrays import Floats, Ints
from magfold_env.envs.tasks.draws import episode_seeds
from magfold_env.envs.tasks.feed_tasks import FeedWorld
from magfold_env.envs.unknown_floor import FloorEpisodes, UnknownFloorEnv
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
        If it is none of which the rule knows what an open loop is.
    """

    env_id: str
    """Its name with Gymnasium."""
    tasks: int
    """How many tasks at most."""
    randomised: bool = True
    """Whether physics and start are drawn, as the environment does by default."""

    def __post_init__(self) -> None:
        if self.env_id != FLOOR_ENV:
            raise ValueError(f"id: {self.env_id!r} is not allowed; must be {FLOOR_ENV}")

    @cached_property
    def env(self) -> UnknownFloorEnv:
        """A single environment, in which nothing happens."""
        return self._made()

    def env_of(self, actions: Space[Any]) -> UnknownFloorEnv:
        """Return a single environment that takes some actions, if there is one."""
        if isinstance(actions, spaces.Discrete):
            return self._made(actions="discrete", speeds=max(2, int(actions.n) // 2))
        return self.env

    def _made(self, **options: Any) -> UnknownFloorEnv:
        if not self.randomised:
            options["randomisation"] = "none"
        made = gymnasium.make(self.env_id, disable_env_checker=True, **options)
        return cast("UnknownFloorEnv", made.unwrapped)

    @property
    def world(self) -> FeedWorld:
        """What all episodes share."""
        return self.env.world

    @cached_property
    def numbers(self) -> list[int]:
        """The numbers of the tasks that are played."""
        return choice_of_tasks(len(self.env.tasks), self.tasks)

    @property
    def length(self) -> float:
        """That of a chain [m]."""
        scene = self.world.scene
        return scene.n * scene.casing.diagonal

    @cached_property
    def field(self) -> "Field":
        """Room for episodes of these tasks, made once."""
        return Field(self.world)

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
    """Room for episodes of a world that are fed as is decided before they begin."""

    def __init__(self, world: FeedWorld, width: int = WIDTH) -> None:
        self._episodes = FloorEpisodes(world, width)

    def feed(self, numbers: Ints, seeds: list[int], speeds: Floats) -> Floats:
        """Return success and score of episodes, (m, 2).

        `numbers` are those of their tasks, and `speeds` those of their steps [m/s], (m, horizon).
        """
        episodes, ends = self._episodes, np.empty((len(seeds), 2))
        for start in range(0, len(seeds), episodes.count):
            part = slice(start, start + episodes.count)
            table = speeds[part]
            columns = episodes.play(
                seeds[part],
                numbers[part].tolist(),
                lambda rows, table=table: (table[rows, episodes.steps[rows]],),
            )
            ends[part] = np.column_stack([columns["is_success"], columns["score"]])
        return ends


@cache
def _seeds(count: int) -> list[int]:
    return episode_seeds(EVALUATION, count)
