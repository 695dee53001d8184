"""Tracks, and the episodes in which players are compared.

Episode i has task i, cyclically. Its draws follow from seed i of a stream. Each purpose has its own
stream. No stream contains the seeds of training, which are small numbers.
"""

from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from math import prod
from typing import Any, cast

import gymnasium
import numpy as np
from gymnasium import Space, spaces

from magfold_env.envs.camera_track import CameraTrackEnv
from magfold_env.envs.chains.arrays import Ints
from magfold_env.envs.tasks.draws import episode_seeds
from magfold_env.envs.tasks.setup import TaskSetup
from magfold_env.envs.tasks.symmetry import Split

FEED_TRACKS = (
    "MagFold/UnknownFloor-v0",
    "MagFold/UnknownFloor-v1",
    "MagFold/Reprogram-v0",
    "MagFold/Lumen-v0",
)
"""Environments with given chains, in which only the feed speed is free."""

TRAYS = ("MagFold/Tray-v0", "MagFold/Anchor-v0")
"""Environments with components from a tray."""

TRACKS = (*FEED_TRACKS, *TRAYS)
"""Environments with given chains or components and a time limit."""

TASKS = 24
"""Default largest number of tasks to play, if the tasks have no side for tests."""

WIDTH = 64
"""Number of episodes that are played simultaneously."""

_AT_ONCE = 1000


def choice_of_tasks(available: int, wanted: int) -> list[int]:
    """Return evenly spaced numbers of tasks, beginning with the first task."""
    wanted = min(available, wanted)
    return [place * available // wanted for place in range(wanted)]


@dataclass(frozen=True)
class Track:
    """An environment, the tasks that are played in it, and their random draws."""

    env_id: str
    """ID of the environment in Gymnasium."""
    tasks: int | None = None
    """Largest number of tasks to play; None means `TASKS`, or all if the tasks have two sides."""
    split: Split = field(default="test", kw_only=True)
    """The side of the tasks to play, if they have two sides."""
    randomised: bool = True
    """Whether the physics and the initial pose are drawn at random."""
    stream: str = field(kw_only=True)
    """Name of the stream of seeds for the draws."""

    def __post_init__(self) -> None:
        if self.env_id not in TRACKS:
            allowed = ", ".join(TRACKS)
            raise ValueError(f"id: {self.env_id!r} is not allowed; must be one of {allowed}")

    @property
    def has_sides(self) -> bool:
        """Whether some tasks are for training and others for tests."""
        return not self.env_id.endswith("-v0")

    @cached_property
    def env(self) -> CameraTrackEnv:
        """A single environment, which is never stepped."""
        return self._made()

    def env_of(self, actions: Space[Any]) -> CameraTrackEnv:
        """Return a single environment that has the action space `actions`, else the default one."""
        sizes: Any = actions
        if isinstance(actions, spaces.Discrete):
            kind, size = "discrete", int(sizes.n)
        elif isinstance(actions, spaces.MultiDiscrete):
            kind, size = "multidiscrete", prod(map(int, sizes.nvec))
        else:
            return self.env
        return self._made(actions=kind, speeds=max(2, size // self.setup.actions.per_level))

    @cached_property
    def single_actions(self) -> Any:
        """The form of actions in which each action is one number."""
        actions: Any = self.setup.actions
        return replace(actions, kind="discrete") if self.env_id in TRAYS else actions

    def _made(self, **options: Any) -> CameraTrackEnv:
        if not self.randomised:
            options["randomisation"] = "none"
        if self.has_sides:
            options["split"] = self.split
        made = gymnasium.make(self.env_id, disable_env_checker=True, **options)
        return cast("CameraTrackEnv", made.unwrapped)

    @property
    def setup(self) -> Any:
        """The options, tasks and rules that all episodes share."""
        return self.env.setup

    @cached_property
    def numbers(self) -> list[int]:
        """The numbers of the played tasks."""
        available = len(self.env.tasks)
        usual = available if self.has_sides else TASKS
        return choice_of_tasks(available, usual if self.tasks is None else self.tasks)

    def episodes(self, count: int, setup: TaskSetup | None = None, threads: int = 1) -> Any:
        """Return `count` `CameraEpisodes` with the tasks of the track or of another setup."""
        return type(self.env).make_episodes(setup or self.setup, count, threads)

    def draws(self, start: int, stop: int) -> tuple[Ints, list[int]]:
        """Return the task numbers and the seeds of episodes `start` to `stop` − 1."""
        numbers = np.array(self.numbers)[np.arange(start, stop) % len(self.numbers)]
        return numbers, _seeds(self.stream, -(-stop // _AT_ONCE) * _AT_ONCE)[start:stop]


@cache
def _seeds(stream: str, count: int) -> list[int]:
    return episode_seeds(stream, count)
