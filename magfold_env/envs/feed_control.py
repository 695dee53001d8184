"""``MagFold/FeedControl-v0``: steer a given chain into one of its folds by the feed speed alone."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

import gymnasium
import numpy as np
from numpy.typing import NDArray

from magfold_env.envs.chain_env import ChainEnv
from magfold_env.envs.control.episode import ControlEpisode
from magfold_env.envs.pictures.moments import control_moment
from magfold_env.envs.pictures.rendering import RENDER_MODES
from magfold_env.envs.spaces.speed_table import SpeedTable
from magfold_env.envs.tasks.control_setup import HORIZON, ControlSetup
from magfold_env.envs.tasks.control_tasks import ControlTask
from magfold_env.envs.tasks.options import ControlOptions
from magfold_env.scene import Scene

if TYPE_CHECKING:
    from magfold_env.render.snapshot import Snapshot


@dataclass(frozen=True)
class ControlState:
    """Everything that decides how the environment goes on; see `FeedControlEnv.get_state`.

    Attributes
    ----------
    rng : dict
        State of the random numbers of episodes to come.
    task : ControlTask
        What is wanted.
    episode : ControlEpisode
        The chain.
    """

    rng: Mapping[str, Any]
    task: ControlTask
    episode: ControlEpisode


class FeedControlEnv(ChainEnv[NDArray[np.float32], ControlEpisode]):
    """Feed a chain whose magnets are given, so that it reaches one fold and not another.

    `reset` picks a task: a sequence, the direction of its feed, the fold to reach and the one to
    avoid, both of which the feed speed can bring about. Every step sets the feed speed for
    20 ms. The episode terminates when the whole chain is out and at rest, when the push
    needed is beyond ``push_limit`` (status ``jammed``; measured at the end of each step), or when
    the simulation breaks down. After 5 s, 250 steps, it is truncated.

    **Action**: ``Discrete(speeds + 1)``: 0 is standstill, k the k-th of ``speeds`` levels that are
    log-spaced from 0.01 to 0.6 m/s. `magfold_env.envs.spaces.speed_table` has the other ways.

    **Observation**: a flat ``Box(−1, 1)`` of ``20 n − 2`` entries. First ``target`` and ``avoid``,
    3 (n − 1) entries each, one-hot over L, S, R; then ``released`` to ``velocity`` as in
    `magfold_env.envs.tube_feed.TubeFeedEnv` (all magnets are shown from the beginning, the
    speed of a component is the last before it left); then ``feed``: the direction (1 forward, −1
    backward), how far the component in the mouth is out (0 to 1), the last speed asked for
    (over 0.6 m/s), the push needed (x / (1 N), squashed) and the time (over 5 s).

    **Reward**: at termination the score: 1 in the target, 0 in the fold to avoid, else half the
    similarity to the target, 0 if the simulation fails; ``reward="sparse"``: 1 in the target, else
    0. Truncation is worth nothing. Shaping: `magfold_env.envs.tasks.reward`.

    **Info**: ``target``, ``avoid``, ``word``, ``time`` [s], ``force`` [N]; at the end also
    ``status``, ``message``, ``energy`` [J], ``score`` and ``is_success``.

    Parameters
    ----------
    scene : str, Path or Scene
        A tube scene; its sequence, direction and speeds are ignored.
    render_mode : {"human", "rgb_array", "ansi"}, optional
        What `render` returns; ``human`` shows every step in a window by itself.
    **options
        See `magfold_env.envs.tasks.options.ControlOptions`.

    Raises
    ------
    ValueError
        For any argument that is not allowed; the message names it and what is.
    """

    metadata = {"render_modes": list(RENDER_MODES), "render_fps": 50}  # noqa: RUF012

    def __init__(
        self,
        scene: str | Path | Scene = "tube-built",
        *,
        render_mode: str | None = None,
        **options: Unpack[ControlOptions],
    ) -> None:
        self.setup = ControlSetup(scene, **options)
        super().__init__(self.setup, render_mode)

    @property
    def tasks(self) -> tuple[ControlTask, ...]:
        """The tasks that `reset` draws from."""
        return self.setup.tasks

    @property
    def actions(self) -> SpeedTable:
        """How actions are read."""
        return self.setup.actions

    @property
    def task(self) -> ControlTask:
        """The task of this episode."""
        self._running()
        return self._task

    @property
    def history(self) -> tuple[float, ...]:
        """The speeds asked for so far [m/s]; with `to_scene` they replay the episode."""
        return tuple(self._running().asked)

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Load a new chain; ``options={"task": number}`` fixes the task.

        Everything random is drawn here, the task first and whether or not it is fixed.

        Raises
        ------
        ValueError
            For an unknown option, or a number that no task has.
        """
        super().reset(seed=seed)
        task = self.setup.pick(self.np_random, options)
        entered = self._enter(task, self.setup.begin(task, self.np_random))
        self._show()
        return entered

    def step(self, action: Any) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Feed for 20 ms.

        Raises
        ------
        ValueError
            If the action lies outside the space.
        gymnasium.error.ResetNeeded
            Before the first reset and after the end of an episode.
        """
        episode = self._running()
        if episode.status is not None or len(episode.asked) >= HORIZON:
            raise gymnasium.error.ResetNeeded("the episode is over; call reset() first")
        speed = self.actions.decode(action)
        rule = self.setup.rule
        before = self.setup.potential(episode, self._task)
        episode.push(speed)
        info = self.setup.summary(episode, self._task)
        reward = rule.step(before, self.setup.potential(episode, self._task))
        terminated = episode.status is not None
        if terminated:
            reward += rule.end(info["score"], info["is_success"], baseline=0.0)
        self._show()
        truncated = not terminated and len(episode.asked) == HORIZON
        return self._observation(episode), reward, terminated, truncated, info

    def get_state(self) -> ControlState:
        """Return everything that decides how the environment goes on.

        It does not change when the environment does, and may be set as often as wanted.
        """
        episode = self._running().copy()
        return ControlState(self.np_random.bit_generator.state, self._task, episode)

    def set_state(self, state: ControlState) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Go back to a state of this environment, or of one made with the same options.

        From there every step gives exactly what it gave then. Returns what `step` or `reset` had
        returned of it.
        """
        self.np_random.bit_generator.state = state.rng
        return self._enter(state.task, state.episode.copy())

    def moment(self) -> "Snapshot":
        """Return what a picture of this moment shows."""
        return control_moment(self.setup, self._running(), self._task)

    def to_scene(self) -> Scene:
        """Return the concrete scene of the episode.

        `magfold_env.envs.control.episode.replay` repeats the episode from it and `history`, bit
        for bit. The feed speeds in it hold the factors that were drawn.
        """
        return self._running().scene_so_far

    def _enter(
        self, task: ControlTask, episode: ControlEpisode
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Make `episode` the present one; return its observation and info."""
        self._task = task
        self._words = self.layout.one_hot([task.target, task.avoid])
        self._episode = episode
        return self._observation(episode), self.setup.summary(episode, task)

    def _show(self) -> None:
        if self.render_mode == "human":
            self.viewer.play(None, self.moment())

    def _observation(self, episode: ControlEpisode) -> NDArray[np.float32]:
        return self.setup.observe(episode, self._words)
