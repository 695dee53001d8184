"""Base class of single environments, which are batches of one episode."""

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
from magfold_env.envs.tasks.setup import Setup
from magfold_env.replay import write_html
from magfold_env.scene import Scene
from magfold_env.scene.errors import refuse, unless_a
from magfold_env.simulation.view import ChainState

if TYPE_CHECKING:
    from magfold_env.render.snapshot import Snapshot

ObsType = TypeVar("ObsType")
_ROW = np.array([0])


class Limited:
    """Mixin for environments whose limit on the number of steps depends on their options."""

    max_episode_steps: int | None
    """The step limit that `spec` states, if there is one."""
    _spec: EnvSpec | None = None

    @property
    def spec(self) -> EnvSpec | None:
        """Gymnasium's specification; by default, it contains the environment's own step limit."""
        return self._spec

    @spec.setter
    def spec(self, spec: EnvSpec | None) -> None:
        if spec is not None and spec.max_episode_steps is None:
            spec = replace(spec, max_episode_steps=self.max_episode_steps)
        self._spec = spec


class ChainEnv(  # pyright: ignore[reportIncompatibleVariableOverride] (its spec is a property)
    Limited, gymnasium.Env[ObsType, Any], Generic[ObsType]
):
    """Base class of environments with one chain; subclasses define the actions and the goal.

    Parameters
    ----------
    setup : Setup
        Scene, targets, actions, observations and rewards that all episodes share.
    render_mode : {"human", "rgb_array", "rgb_array_list", "ansi"}, optional
        What `render` returns; ``human`` shows every step in a window automatically.

    Raises
    ------
    ValueError
        If the render mode is not allowed.
    """

    metadata = {"render_modes": list(RENDER_MODES), "render_fps": 4}  # noqa: RUF012
    make_episodes: ClassVar[Any]
    """The class of the episodes, which defines what the environment does."""

    def __init__(self, setup: Setup, render_mode: str | None) -> None:
        self.setup = setup
        self.render_mode = render_mode
        if render_mode == "rgb_array_list":
            self.metadata = {**self.metadata, "render_fps": FILM_FPS}
        self.viewer = Viewer(render_mode, self.metadata["render_fps"])
        self.action_space = setup.actions.space
        self.observation_space: gymnasium.Space[Any] = self.layout.space
        # One more, because a `TimeLimit` of the horizon would call the task's end a truncation.
        self.max_episode_steps = None if self.horizon is None else self.horizon + 1
        self._made: Episodes[ObsType] | None = None
        # Random state and target at the last reset, if known, and the actions since.
        self._began: tuple[Mapping[str, Any], Sequence[int] | None] | None = None
        self._choices: list[tuple[NDArray[Any], ...]] = []

    @property
    def scene(self) -> Scene:
        """The scene that episodes are drawn from, including its randomisation."""
        return self.setup.scene

    @property
    def actions(self) -> Any:
        """The encoding of actions; see `magfold_env.envs.spaces.actions`."""
        return self.setup.actions

    @property
    def layout(self) -> Layout:
        """The layout of observations, with the slice of each group of entries."""
        return self.setup.layout

    @property
    def state(self) -> ChainState:
        """The complete state of the chain, including what observations hide."""
        return self._running().state(0)

    @property
    def horizon(self) -> int | None:
        """Largest number of steps in an episode; None if only time limits it."""
        return None

    @property
    def episodes(self) -> Episodes[ObsType]:
        """The batch of one episode."""
        made = self._made
        if made is None:
            made = self._made = self.make_episodes(self.setup, 1, 1, self.viewer.frame_rate)
        return made

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[ObsType, dict[str, Any]]:
        """Begin an episode with a new chain; ``options`` may fix the target or the task.

        This call draws all random physics. The target or task is drawn first, even if it is fixed,
        so that a seed gives the same physics for every target.

        Raises
        ------
        ValueError
            If an option is unknown or its value is not allowed.
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
        """Take a step with `action`.

        Raises
        ------
        ValueError
            If the action is not in the space.
        gymnasium.error.ResetNeeded
            Before the first reset, or after the end of an episode.
        """
        episodes = self._running()
        if episodes.terminated[0]:
            raise gymnasium.error.ResetNeeded("the episode is over; call reset() first")
        choice = self.setup.actions.read_one(action)
        # Copied, because an agent may write its next action into the same array.
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

        Later steps repeat exactly. Returns the observation and info that `step` or `reset` returned
        with that state.
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

        ``rgb_array_list`` returns all frames since the last call or reset. Played at
        ``metadata["render_fps"]``, they show the motion between decisions at half its speed.

        Raises
        ------
        gymnasium.error.ResetNeeded
            Before the first reset.
        """
        self._running()
        return self.viewer.render(self.snapshot)

    def snapshot(self) -> "Snapshot":
        """Return the content of a picture of the episode."""
        return snapshot_of(self._running(), 0)

    def to_html(self, path: str | Path) -> None:
        """Write a web page that plays the episode so far; see `magfold_env.replay.write_html`.

        This repeats the episode bit for bit and records it; any `render_mode` works.

        Parameters
        ----------
        path
            Path of the page; it is first written under a temporary name.

        Raises
        ------
        gymnasium.error.ResetNeeded
            Before the first reset.
        ValueError
            Before the first step, after `set_state`, or with ``fidelity="quasistatic"``, where
            nothing moves.
        """
        self._running()
        if self._began is None or not self._choices:
            raise ValueError("to_html: an episode needs a step, and no set_state since its reset")
        state, given = self._began
        again = self.make_episodes(self.setup, 1, 1, FRAME_RATE)
        again.rngs[0] = copy.deepcopy(self.np_random)
        again.rngs[0].bit_generator.state = state
        again.begin(_ROW, given)
        write_html(recording(again, self._choices), path)

    def close(self) -> None:
        """Close the window, if there is one; the environment does not change."""
        self.viewer.close()

    def _running(self) -> Episodes[ObsType]:
        """Return the batch of one episode; raise ``ResetNeeded`` if it has not begun."""
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
        """Play or record the motion since the last call, if the render mode requires it."""
        if self.render_mode in ("human", "rgb_array_list"):
            self.viewer.follow(self.episodes.chains.motion(), self.snapshot())
