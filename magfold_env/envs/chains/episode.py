"""What every kind of episode offers to the environment around it."""

from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

from magfold_env.envs.chains.progress import Progress
from magfold_env.fold import FoldStatus, Trajectory
from magfold_env.scene import Scene
from magfold_env.simulation.chain_state import ChainState


class EpisodeView(Protocol):
    """What there is to see of one chain, from the tube to the end of its fold."""

    @property
    def progress(self) -> Progress:
        """What has left the tube and what was chosen."""
        ...

    @property
    def state(self) -> ChainState:
        """The chain as it is, or as it last was while its numbers were finite."""
        ...

    @property
    def fed(self) -> int:
        """Number of components whose magnets and speed are chosen."""
        ...

    @property
    def status(self) -> FoldStatus | None:
        """How the fold ended; None while it goes on."""
        ...

    @property
    def message(self) -> str:
        """How it ended, in words."""
        ...

    @property
    def word(self) -> str:
        """The fold word nearest to the chain as it is."""
        ...

    @property
    def energy(self) -> float:
        """Magnetic energy of the chain as it is [J]; no number where the simulation failed."""
        ...

    @property
    def held(self) -> NDArray[np.bool_]:
        """Which components friction holds, shape (n,)."""
        ...

    @property
    def scene_so_far(self) -> Scene:
        """The drawn scene, with the magnets and speeds of the components fed so far."""
        ...


class Episode(EpisodeView, Protocol):
    """The same, and what can be done with it."""

    @property
    def motion(self) -> Trajectory | None:
        """What was recorded of the way so far; None if nothing is."""
        ...

    @property
    def next_component(self) -> int:
        """Index of the component to be fed next (its number − 1).

        Raises
        ------
        RuntimeError
            If all have been fed.
        """
        ...

    def feed(self, faces: str, speed: float) -> None:
        """Set the next component's faces and speed [m/s] and feed it out.

        After the last one the chain settles.
        """
        ...

    def run(self, sequence: tuple[str, ...], speed: float) -> None:
        """Feed a whole chain out at one speed [m/s] and let it settle."""
        ...

    def to_scene(self) -> Scene:
        """Return the concrete scene of the episode, which replays it.

        Raises
        ------
        RuntimeError
            While components remain to be fed: half a chain is not a scene.
        """
        ...

    def copy(self) -> Self:
        """Return an episode in the same state that goes its own way from here."""
        ...
