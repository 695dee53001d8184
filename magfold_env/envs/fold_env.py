"""What the environments in which magnets are chosen have in common."""

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal, TypeVar, Unpack

import gymnasium
import numpy as np
from numpy.typing import NDArray

from magfold_env.envs.baselines.baseline import Baseline
from magfold_env.envs.chain_env import ChainEnv
from magfold_env.envs.chains.episode import Episode
from magfold_env.envs.pictures.moments import fold_moment
from magfold_env.envs.spaces.action_table import ActionTable
from magfold_env.envs.tasks.goals import Goal
from magfold_env.envs.tasks.options import FoldOptions
from magfold_env.envs.tasks.task import FoldTask
from magfold_env.scene import Scene

if TYPE_CHECKING:
    from magfold_env.render.snapshot import Snapshot

ObsType = TypeVar("ObsType")


@dataclass(frozen=True)
class EnvState:
    """Everything that decides how an environment goes on; see `FoldEnv.get_state`.

    Attributes
    ----------
    rng : dict
        State of the random numbers of episodes to come.
    goal : Goal
        What is wanted.
    episode : Episode
        The chain.
    """

    rng: Mapping[str, Any]
    goal: Goal
    episode: Episode


class FoldEnv(ChainEnv[ObsType, Episode]):
    """A chain whose magnets and feed speeds are chosen so that it folds into a target.

    Parameters
    ----------
    scene : str, Path or Scene, optional
        A tube scene: a shipped name, a path or the scene. Its sequence and feed speeds are the
        agent's to choose and so are ignored: every face gets a magnet. By default the scene that
        the target suite is meant for, or the environment's own.
    render_mode : {"human", "rgb_array", "ansi"}, optional
        What `render` returns; ``human`` shows every step in a window by itself.
    **options
        See `magfold_env.envs.tasks.options.FoldOptions`.

    Raises
    ------
    ValueError
        For any option that is not allowed; the message names it and what is.
    """

    at_a_time: ClassVar[Literal["component", "chain"]] = "component"
    default_scene: ClassVar[str] = "tube-feed"

    def __init__(
        self,
        scene: str | Path | Scene | None = None,
        *,
        render_mode: str | None = None,
        **options: Unpack[FoldOptions],
    ) -> None:
        self.task = FoldTask(scene, self.default_scene, self.at_a_time, **options)
        super().__init__(self.task, render_mode)

    @property
    def targets(self) -> tuple[str, ...]:
        """The words that `reset` draws from."""
        return self.task.targets

    @property
    def actions(self) -> ActionTable:
        """How actions are read."""
        return self.task.actions

    @property
    def target(self) -> str:
        """The word that this episode wants."""
        self._running()
        return self._goal.word

    @property
    def baseline(self) -> Baseline:
        """The energy minimiser's result for the target of this episode."""
        self._running()
        return self._baseline

    def baseline_of(self, target: str) -> Baseline:
        """Return the energy minimiser's result for `target`.

        May take some seconds where neither the package nor the disk cache has it.
        """
        return self.task.baseline_of(target)

    @property
    def next_component(self) -> int:
        """Index of the component that the next step feeds (component number − 1)."""
        return self._running().next_component

    def action_masks(self) -> NDArray[np.bool_]:
        """Return which actions ask for nothing but components of the catalogue.

        In the form that sb3-contrib's ``MaskablePPO`` looks for; `ActionTable.masks`.
        """
        return self.actions.masks()

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[ObsType, dict[str, Any]]:
        """Load a new chain; ``options={"target": word}`` fixes the target.

        Everything random is drawn here, the target first and whether or not it is fixed, so one
        seed gives one physics whatever the target.

        Raises
        ------
        ValueError
            For an unknown option or a target that is not among the env's.
        """
        super().reset(seed=seed)
        goal = self.task.pick(self.np_random, options)
        self._enter(goal, self.task.begin(self.np_random, self.viewer.frame_rate))
        self._show()
        return self._observation(), self._info()

    def step(self, action: Any) -> tuple[ObsType, float, bool, bool, dict[str, Any]]:
        """Do what `action` asks for.

        Raises
        ------
        ValueError
            If the action lies outside the space.
        gymnasium.error.ResetNeeded
            Before the first reset and after the end of an episode.
        """
        episode = self._running()
        if episode.status is not None:
            raise gymnasium.error.ResetNeeded("the episode is over; call reset() first")
        faces, speed = self.actions.decode(action)
        before = self.task.potential(episode, self._goal)
        self._act(episode, faces, speed)
        info = self._info()
        reward = self._reward(before, info)
        self._show()
        return self._observation(), reward, episode.status is not None, False, info

    def get_state(self) -> EnvState:
        """Return everything that decides how the environment goes on.

        It does not change when the environment does, and may be set as often as wanted.
        """
        episode = self._running().copy()
        return EnvState(self.np_random.bit_generator.state, self._goal, episode)

    def set_state(self, state: EnvState) -> tuple[ObsType, dict[str, Any]]:
        """Go back to a state of this environment, or of one made with the same options.

        From there every step gives exactly what it gave then. Returns what `step` or `reset` had
        returned of it.
        """
        self.np_random.bit_generator.state = state.rng
        self._enter(state.goal, state.episode.copy())
        return self._observation(), self._info()

    def moment(self) -> "Snapshot":
        """Return what a picture of this moment shows."""
        return fold_moment(self.task, self._running(), self._goal, self._baseline)

    def to_scene(self) -> Scene:
        """Return the finished episode as a concrete scene.

        `magfold_env.simulation.simulate` replays it bit for bit; if the fidelity is quasistatic,
        `magfold_env.envs.chains.quasistatic_episode.fold` does.
        """
        return self._running().to_scene()

    @abstractmethod
    def _observation(self) -> ObsType:
        """Return a new observation."""

    @abstractmethod
    def _act(self, episode: Episode, faces: tuple[str, ...], speed: float) -> None:
        """Feed what an action describes."""

    def _reward(self, before: float, info: Mapping[str, Any]) -> float:
        """Return the reward of a step that began at the potential `before`."""
        episode, rule = self._running(), self.task.rule
        reward = rule.step(before, self.task.potential(episode, self._goal))
        if episode.status is not None:
            reward += rule.end(info["score"], info["is_success"], self._baseline.score)
        return reward

    def _info(self) -> dict[str, Any]:
        return self.task.summary(self._running(), self._goal, self._baseline)

    def _enter(self, goal: Goal, episode: Episode) -> None:
        """Make `episode` the present one."""
        self._goal = goal
        self._words = self.layout.one_hot([goal.word])
        self._baseline = self.task.baseline_of(goal.word)
        self._episode = episode
        self.viewer.begin()

    def _show(self) -> None:
        """Play what has happened since the last time, if there is a window."""
        if self.render_mode == "human":
            self.viewer.play(self._running().motion, self.moment())
