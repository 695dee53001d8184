"""What many chains in their tubes look like: the arrays that observations are made from."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from magfold_env.engine.compile.jit import kernel
from magfold_env.envs.spaces.observation import fill_chain

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]


class Board(NamedTuple):
    """Chains side by side, component 1 first: the `Progress` and the `ChainState` of each."""

    released: Bools  # (m, n)
    signs: Floats  # outward poles, (m, n, 4); 0 where not set yet
    speeds: Floats  # asked for, on the log scale, (m, n); 0 where not set yet
    angles: Floats  # headings [rad], (m, n)
    rates: Floats  # [rad/s], (m, n)
    base: Floats  # outer hinge of component 1 [m], (m, 2)
    base_velocity: Floats  # [m/s], (m, 2)

    @classmethod
    def empty(cls, count: int, n: int) -> "Board":
        """Return the board of chains of which nothing is known."""
        return cls(
            released=np.zeros((count, n), dtype=np.bool_),
            signs=np.zeros((count, n, 4)),
            speeds=np.zeros((count, n)),
            angles=np.zeros((count, n)),
            rates=np.zeros((count, n)),
            base=np.zeros((count, 2)),
            base_velocity=np.zeros((count, 2)),
        )

    def clear(self, rows: Ints) -> None:
        """Forget some chains."""
        for array in self:
            array[rows] = 0

    def show(self, side: float, words: NDArray[np.float32], out: NDArray[np.float32]) -> None:
        """Fill observations (m, size): each begins with its row of `words`."""
        _show(side, *self, words, out)

    def write_words(self, out: NDArray[np.uint32]) -> None:
        """Fill in the letters of the nearest fold words, (m, n - 1), as code points."""
        _write_words(self.angles, out)


@kernel
def _show(  # noqa: PLR0913, PLR0917
    side: float,
    released: Bools,
    signs: Floats,
    speeds: Floats,
    angles: Floats,
    rates: Floats,
    base: Floats,
    base_velocity: Floats,
    words: NDArray[np.float32],
    out: NDArray[np.float32],
) -> None:
    count, first = words.shape
    chain = 14 * angles.shape[1] - 1
    for k in range(count):
        for j in range(first):
            out[k, j] = words[k, j]
        fill_chain(
            side, released[k], signs[k], speeds[k], angles[k], rates[k], base[k],
            base_velocity[k], out[k, first : first + chain],
        )  # fmt: skip


@kernel
def _write_words(angles: Floats, out: NDArray[np.uint32]) -> None:
    for k in range(angles.shape[0]):
        for j in range(angles.shape[1] - 1):
            angle = angles[k, j + 1] - angles[k, j]
            turned = angle - 2.0 * np.pi * np.rint(angle / (2.0 * np.pi))
            letter = 83  # S
            if turned > 0.25 * np.pi:
                letter = 76  # L
            elif turned < -0.25 * np.pi:
                letter = 82  # R
            out[k, j] = letter
