"""The visible state of chains: the arrays from which observations are made."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from magfold_env.engine.compile.by_pointer import by_pointer
from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.fold import FoldStatus

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

STATUSES = (
    None,
    FoldStatus.FOLDED,
    FoldStatus.MISFOLDED,
    FoldStatus.UNSETTLED,
    FoldStatus.FAILED,
    FoldStatus.JAMMED,
    FoldStatus.HELD,
    "opened",
)
"""Meanings of the numbers in `ChainArrays.status`; 0 is a running chain. The last status belongs to
chains whose folds a pull has opened; simulations of scenes do not end with it."""

FOLDED, MISFOLDED, UNSETTLED, FAILED, JAMMED, HELD, OPENED = range(1, len(STATUSES))


@by_pointer
class ChainArrays(NamedTuple):
    """The visible state of many chains, as arrays in which component 1 comes first."""

    forward: Bools  # True where component 1 leaves the tube first, (m,)
    fed: Ints  # number of components whose magnets and speed are chosen, (m,)
    status: Ints  # how each fold ended, an index in `STATUSES`, (m,)
    released: Bools  # which components are out, (m, n)
    signs: Floats  # outward poles, N = 1, S = −1, (m, n, 4); 0 if not set or without a magnet
    speeds: Floats  # requested, on the log scale, (m, n); 0 if not set yet
    angles: Floats  # headings [rad], (m, n)
    rates: Floats  # [rad/s], (m, n)
    base: Floats  # outer hinge of component 1 [m], (m, 2)
    base_velocity: Floats  # [m/s], (m, 2)

    @classmethod
    def empty(cls, count: int, n: int) -> "ChainArrays":
        """Return arrays for chains whose episodes have not begun."""
        return cls(
            forward=np.ones(count, dtype=np.bool_),
            fed=np.zeros(count, dtype=np.int64),
            status=np.zeros(count, dtype=np.int64),
            released=np.zeros((count, n), dtype=np.bool_),
            signs=np.zeros((count, n, 4)),
            speeds=np.zeros((count, n)),
            angles=np.zeros((count, n)),
            rates=np.zeros((count, n)),
            base=np.zeros((count, 2)),
            base_velocity=np.zeros((count, 2)),
        )

    def order(self, row: int) -> range:
        """Return the components' indices (number − 1) in the order in which they leave the tube."""
        indices = range(self.angles.shape[1])
        return indices if self.forward[row] else indices[::-1]


@inlined
def component(forward: bool, place: int, n: int) -> int:
    """Return the index of the component at a place in the order of feed; both count from 0."""
    return place if forward else n - 1 - place


@kernel
def clear(rows: Ints, forward: bool, arrays: ChainArrays) -> None:
    """Reset the given chains and set their feed direction."""
    for r in range(rows.size):
        k: int = rows[r]
        arrays.forward[k] = forward
        arrays.fed[k] = arrays.status[k] = 0
        arrays.released[k] = False
        arrays.signs[k] = 0.0
        arrays.speeds[k] = arrays.angles[k] = arrays.rates[k] = 0.0
        arrays.base[k] = arrays.base_velocity[k] = 0.0


@kernel
def write_words(rows: Ints, angles: Floats, out: NDArray[np.uint32]) -> None:
    """Write the letters of the given chains' nearest words as code points, (rows, n - 1)."""
    for r in range(rows.size):
        k: int = rows[r]
        for j in range(angles.shape[1] - 1):
            angle = angles[k, j + 1] - angles[k, j]
            turned = angle - 2.0 * np.pi * np.rint(angle / (2.0 * np.pi))
            letter = 83  # S
            if turned > 0.25 * np.pi:
                letter = 76  # L
            elif turned < -0.25 * np.pi:
                letter = 82  # R
            out[r, j] = letter
