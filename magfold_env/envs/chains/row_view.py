"""One of many chains as an episode that can be looked at, for pictures."""

from abc import abstractmethod
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from magfold_env.envs.chains.arrays import Board
from magfold_env.envs.chains.progress import Progress
from magfold_env.fold import FoldStatus
from magfold_env.scene import Scene
from magfold_env.shapes import angles_to_word
from magfold_env.simulation.chain_state import ChainState

Ints = NDArray[np.int64]
_LETTERS = {1.0: "N", -1.0: "S"}

STATUSES = (None, FoldStatus.FOLDED, FoldStatus.MISFOLDED, FoldStatus.UNSETTLED, FoldStatus.FAILED)
"""What the numbers stand for that fleets keep; 0 is an episode that goes on."""


class _Fleet(Protocol):
    """What a view needs of a fleet; see `magfold_env.envs.chains.protocol.Fleet`."""

    board: Board
    status: Ints
    fed: Ints

    def message(self, row: int) -> str: ...
    def energies(self, rows: Ints) -> NDArray[np.float64]: ...


class RowView:
    """What there is to see of one chain; see `magfold_env.envs.chains.episode.EpisodeView`.

    Parameters
    ----------
    fleet : Fleet
        The chains.
    row : int
        Which.
    """

    def __init__(self, fleet: _Fleet, row: int) -> None:
        self.fleet, self.row = fleet, row

    @property
    def progress(self) -> Progress:
        """What has left the tube and what was chosen."""
        board, row = self.fleet.board, self.row
        order = self.scene_so_far.feed.direction
        begun = Progress.begin(board.angles.shape[1], order)
        return Progress(begun.order, board.released[row], board.signs[row], board.speeds[row])

    @property
    def state(self) -> ChainState:
        """The chain as it is."""
        board, row = self.fleet.board, self.row
        return ChainState(
            board.angles[row], board.rates[row], board.base[row], board.base_velocity[row]
        )

    @property
    def fed(self) -> int:
        """Number of components whose magnets and speed are chosen."""
        return int(self.fleet.fed[self.row])

    @property
    def status(self) -> FoldStatus | None:
        """How the fold ended; None while it goes on."""
        return STATUSES[int(self.fleet.status[self.row])]

    @property
    def message(self) -> str:
        """How it ended, in words."""
        return "" if self.status is None else self.fleet.message(self.row)

    @property
    def word(self) -> str:
        """The fold word nearest to the chain as it is."""
        return angles_to_word(self.state.joint_angles)

    @property
    def energy(self) -> float:
        """Magnetic energy of the chain as it is [J]; no number where the simulation failed."""
        return float(self.fleet.energies(np.array([self.row]))[0])

    @property
    @abstractmethod
    def held(self) -> NDArray[np.bool_]:
        """Which components friction holds, shape (n,)."""

    @property
    @abstractmethod
    def scene_so_far(self) -> Scene:
        """The scene, with the magnets and speeds of the components fed so far."""


def letters_of(signs: NDArray[np.float64]) -> str:
    """Return the faces of a component, from its outward poles (4,)."""
    return "".join(_LETTERS[sign] for sign in signs.tolist())
