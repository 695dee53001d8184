"""What all environments have in common: a world, one episode in it and a view of that."""

from abc import abstractmethod
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import gymnasium

from magfold_env.envs.chains.episode import Episode
from magfold_env.envs.control.episode import ControlEpisode
from magfold_env.envs.pictures.rendering import RENDER_MODES, Viewer
from magfold_env.envs.spaces.observation import ObservationLayout
from magfold_env.envs.tasks.control_setup import ControlSetup
from magfold_env.envs.tasks.task import FoldTask
from magfold_env.scene import Scene
from magfold_env.simulation.chain_state import ChainState

if TYPE_CHECKING:
    from magfold_env.render.snapshot import Snapshot

ObsType = TypeVar("ObsType")
EpisodeType = TypeVar("EpisodeType", Episode, ControlEpisode)


class ChainEnv(gymnasium.Env[ObsType, Any], Generic[ObsType, EpisodeType]):
    """One chain in the world of a task; what is chosen and wanted is left to subclasses.

    Parameters
    ----------
    world : FoldTask or ControlSetup
        What all episodes share.
    render_mode : {"human", "rgb_array", "ansi"}, optional
        What `render` returns; ``human`` shows every step in a window by itself.

    Raises
    ------
    ValueError
        If there is no such render mode.
    """

    metadata = {"render_modes": list(RENDER_MODES), "render_fps": 4}  # noqa: RUF012

    def __init__(self, world: FoldTask | ControlSetup, render_mode: str | None) -> None:
        self._world = world
        self.render_mode = render_mode
        self.viewer = Viewer(render_mode, self.metadata["render_fps"])
        self.action_space = world.actions.space
        self.observation_space: gymnasium.Space[Any] = world.layout.space
        self._episode: EpisodeType | None = None

    @property
    def scene(self) -> Scene:
        """The scene that episodes are drawn from, randomisation included."""
        return self._world.scene

    @property
    def layout(self) -> ObservationLayout:
        """Where each group of entries lies in an observation."""
        return self._world.layout

    @property
    def state(self) -> ChainState:
        """The chain as it is, beyond what an observation tells of it."""
        return self._running().state

    def render(self) -> Any:
        """Return the chain as an image or as text, or show it, as `render_mode` says.

        Raises
        ------
        gymnasium.error.ResetNeeded
            Before the first reset.
        """
        self._running()
        return self.viewer.render(self.moment)

    @abstractmethod
    def moment(self) -> "Snapshot":
        """Return what a picture of this moment shows."""

    def close(self) -> None:
        """Close the window, if there is one; the environment stays as it is."""
        self.viewer.close()

    def _running(self) -> EpisodeType:
        """Return the current episode."""
        if self._episode is None:
            raise gymnasium.error.ResetNeeded("no episode has begun; call reset() first")
        return self._episode
