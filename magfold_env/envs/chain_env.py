"""A single environment: row 0 of episodes of one."""

import copy
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Generic, TypeVar, cast

import gymnasium
import numpy as np
from gymnasium.envs.registration import EnvSpec
from numpy.typing import NDArray

from magfold_env.envs.episodes import Columns, Episodes, EpisodesState
from magfold_env.envs.pictures.snapshots import recording, snapshot_of
from magfold_env.envs.pictures.viewer import FILM_FPS, FRAME_RATE, RENDER_MODES, Viewer
from magfold_env.envs.spaces.observation import Layout
from magfold_env.envs.tasks.checks import seeds_of
from magfold_env.envs.tasks.world import World
from magfold_env.replay import write_html
from magfold_env.scene import Scene
from magfold_env.scene.errors import refuse, unless_a
from magfold_env.simulation.view import ChainState

if TYPE_CHECKING:
    from magfold_env.render.snapshot import Snapshot

ObsType = TypeVar("ObsType")
_ROW = np.array([0])


class Limited:
    """What has a limit of its own on the number of steps, which depends on its options."""

    max_episode_steps: int | None
    """The limit for `spec`, if there is one."""
    _spec: EnvSpec | None = None

    @property
    def spec(self) -> EnvSpec | None:
        """How the environment was made; its ``max_episode_steps`` is the environment's own."""
        return self._spec

    @spec.setter
    def spec(self, spec: EnvSpec | None) -> None:
        if spec is not None and spec.max_episode_steps is None:
            spec = replace(spec, max_episode_steps=self.max_episode_steps)
        self._spec = spec


class ChainEnv(  # pyright: ignore[reportIncompatibleVariableOverride] (its spec is a property)
    Limited, gymnasium.Env[ObsType, Any], Generic[ObsType]
):
    """One chain in a world; subclasses define the actions and the goal.

    Parameters
    ----------
    world : World
        What all episodes share.
    render_mode : {"human", "rgb_array", "rgb_array_list", "ansi"}, optional
        What `render` returns; ``human`` shows every step in a window by itself.

    Raises
    ------
    ValueError
        If there is no such render mode.
    """

    metadata = {"render_modes": list(RENDER_MODES), "render_fps": 4}  # noqa: RUF012
    make_episodes: ClassVar[Any]
    """The class of the episodes, which defines the environment."""

    def __init__(self, world: World, render_mode: str | None) -> None:
        self.world = world
        self.render_mode = render_mode
        if render_mode == "rgb_array_list":
            self.metadata = {**self.metadata, "render_fps": FILM_FPS}
        self.viewer = Viewer(render_mode, self.metadata["render_fps"])
        self.action_space = world.actions.space
        self.observation_space: gymnasium.Space[Any] = self.layout.space
        # One more, because a `TimeLimit` of the horizon would call the task's end a truncation.
        self.max_episode_steps = None if self.horizon is None else self.horizon + 1
        self._made: Episodes[ObsType] | None = None
        # The initial state of the episode, if known, and the actions since.
        self._began: tuple[Mapping[str, Any], Sequence[int] | None] | None = None
        self._choices: list[tuple[NDArray[Any], ...]] = []

    @property
    def scene(self) -> Scene:
        """The scene that episodes are drawn from, randomisation included."""
        return self.world.scene

    @property
    def actions(self) -> Any:
        """The form of actions: see `magfold_env.envs.spaces.actions`."""
        return self.world.actions

    @property
    def layout(self) -> Layout:
        """The slice of each group of entries in an observation."""
        return self.world.layout

    @property
    def state(self) -> ChainState:
        """The complete state of the chain, including what observations hide."""
        return self._running().state(0)

    @property
    def horizon(self) -> int | None:
        """Number of steps after which an episode has always ended; None if nothing sets it."""
        return None

    @property
    def episodes(self) -> Episodes[ObsType]:
        """The episodes: a batch of one."""
        made = self._made
        if made is None:
            made = self._made = self.make_episodes(self.world, 1, 1, self.viewer.frame_rate)
        return made

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[ObsType, dict[str, Any]]:
        """Load a new chain; ``options`` may fix the target, or the task.

        Everything random is drawn here. The target or task is drawn first, even if it is fixed, so
        that a seed gives the same physics for every target.

        Raises
        ------
        ValueError
            For an unknown option, or a value that the environment does not have.
        """
        refuse(unless_a("options", options, (Mapping, type(None)), "a mapping"))
        super().reset(seed=seeds_of([seed], 1)[0])
        episodes = self.episodes
        episodes.rngs[0] = self.np_random
        given = episodes.parse_reset_options({key: [each] for key, each in (options or {}).items()})
        self._began, self._choices = (self.np_random.bit_generator.state, given), []
        episodes.begin(_ROW, given)
        self.viewer.begin()
        self._show()
        return self._observation(), self._info()

    def step(self, action: Any) -> tuple[ObsType, float, bool, bool, dict[str, Any]]:
        """Carry out `action`.

        Raises
        ------
        ValueError
            If the action is not in the space.
        gymnasium.error.ResetNeeded
            Before the first reset and after the end of an episode.
        """
        episodes = self._running()
        if episodes.terminated[0]:
            raise gymnasium.error.ResetNeeded("the episode is over; call reset() first")
        choice = self.world.actions.read_one(action)
        # Copies: an agent may write its next action into the same array.
        self._choices.append(tuple(part.copy() for part in choice))
        rewards, ends = episodes.step(_ROW, choice)
        self._show()
        observation, info = self._observation(), self._info(ends)
        return observation, float(rewards[0]), bool(ends), False, info

    def get_state(self) -> EpisodesState:
        """Return the complete state of the environment.

        Later steps do not change the returned state, and it can be set any number of times.
        """
        return self._running().get_state()

    def set_state(self, state: EpisodesState) -> tuple[ObsType, dict[str, Any]]:
        """Restore a state of this environment, or of one made with the same options.

        Steps from there repeat exactly. Returns the observation and info that `step` or `reset`
        returned with that state.
        """
        episodes = self.episodes
        episodes.rngs[0] = self.np_random
        episodes.set_state(state)
        self._began = None
        self.viewer.begin()
        ends = episodes.final_infos(_ROW) if episodes.terminated[0] else {}
        return self._observation(), self._info(ends)

    def render(self) -> Any:
        """Return the chain as an image or as text, or show it, according to `render_mode`.

        ``rgb_array_list`` returns all frames since the last call, or the last reset: the motion
        between decisions, at half its speed if they are shown at ``metadata["render_fps"]``.

        Raises
        ------
        gymnasium.error.ResetNeeded
            Before the first reset.
        """
        self._running()
        return self.viewer.render(self.snapshot)

    def snapshot(self) -> "Snapshot":
        """Return what a picture shows."""
        return snapshot_of(self._running(), 0)

    def to_html(self, path: str | Path) -> None:
        """Write a page that plays the episode so far: see `magfold_env.replay.write_html`.

        The episode is simulated again, bit for bit, and recorded; any `render_mode` works.

        Parameters
        ----------
        path
            Path of the page; it is first written under a temporary name.

        Raises
        ------
        gymnasium.error.ResetNeeded
            Before the first reset.
        ValueError
            Before the first step, after `set_state`, and with ``fidelity="quasistatic"``, where
            nothing moves.
        """
        self._running()
        if self._began is None or not self._choices:
            raise ValueError("to_html: an episode needs a step, and no set_state since its reset")
        state, given = self._began
        again = self.make_episodes(self.world, 1, 1, FRAME_RATE)
        again.rngs[0] = copy.deepcopy(self.np_random)
        again.rngs[0].bit_generator.state = state
        again.begin(_ROW, given)
        write_html(recording(again, self._choices), path)

    def close(self) -> None:
        """Close the window, if there is one; the environment does not change."""
        self.viewer.close()

    def _running(self) -> Episodes[ObsType]:
        """Return the episodes, after a check that one has begun."""
        self.episodes.check_begun()
        return self.episodes

    def _observation(self) -> ObsType:
        """Return a new observation."""
        observations: Any = self.episodes.observe()
        if isinstance(observations, dict):
            parts = cast("dict[str, Any]", observations)
            return cast("Any", {key: values[0].copy() for key, values in parts.items()})
        return observations[0].copy()

    def _info(self, ends: Columns | None = None) -> dict[str, Any]:
        infos = self.episodes.infos(_ROW) | (ends or {})
        return {key: column.tolist()[0] for key, column in infos.items()}

    def _show(self) -> None:
        """Play or record the motion since the last call, if the render mode does so."""
        if self.render_mode in ("human", "rgb_array_list"):
            self.viewer.follow(self.episodes.chains.motion(), self.snapshot())
