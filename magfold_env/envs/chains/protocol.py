"""Many episodes side by side: what a vector environment steps, whatever folds the chains."""

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from magfold_env.envs.chains.arrays import Board
from magfold_env.envs.chains.row_view import STATUSES, RowView

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

FOLDED, MISFOLDED, UNSETTLED, FAILED = range(1, len(STATUSES))


class Fleet(Protocol):
    """Chains that are begun and fed by rows, each a `magfold_env.envs.chains.episode.Episode`.

    Attributes
    ----------
    board : Board
        What the chains look like.
    status : array of int, shape (m,)
        How each fold ended, a number of `STATUSES`.
    fed : array of int, shape (m,)
        Number of components whose magnets and speed are chosen.
    """

    board: Board
    status: Ints
    fed: Ints

    def begin(self, rows: Ints, rngs: Sequence[np.random.Generator]) -> None:
        """Put chains into their tubes; all that is random is drawn here, row k from ``rngs[k]``."""
        ...

    def feed(self, rows: Ints, patterns: Ints, speeds: Floats, scaled: Floats) -> None:
        """Feed the next component of each chain; after its last one a chain settles.

        Parameters
        ----------
        patterns : array of int, shape (rows,)
            Numbers of the patterns.
        speeds, scaled : array, shape (rows,)
            Feed speeds [m/s], and the same on the log scale from −1 to 1.
        """
        ...

    def run(self, rows: Ints, patterns: Ints, speeds: Floats, scaled: Floats) -> None:
        """Feed whole chains, `patterns` (rows, n), each at one speed, and let them settle."""
        ...

    def energies(self, rows: Ints) -> Floats:
        """Return the magnetic energies [J]; no number where a simulation failed."""
        ...

    def message(self, row: int) -> str:
        """Return how a fold ended, in words."""
        ...

    def view(self, row: int) -> RowView:
        """Return what there is to see of one chain."""
        ...

    def close(self) -> None:
        """End the threads, if there are any."""
        ...
