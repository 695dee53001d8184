"""The flat observation of a chain that is being fed: its layout and how it is filled."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from magfold_env.engine.compile.by_pointer import pointer
from magfold_env.engine.compile.jit import kernel
from magfold_env.envs.chains.arrays import ChainArrays

Singles = NDArray[np.float32]

VELOCITY_SCALE = 1.0
"""Velocity that is shown as one half [m/s]."""

RATE_SCALE = 100.0
"""Angular rate that is shown as one half [rad/s]."""

MEASURED = ("joint", "heading", "rate", "position", "velocity")
"""Groups that a camera would have to measure; the others are known."""


@dataclass(frozen=True)
class ObservationLayout:
    """Where each group of entries lies in the observation of a chain of `n` components.

    Attributes
    ----------
    n : int
        Number of components.
    side : float
        Edge length of a casing [m].
    words : tuple of str
        Groups of 3 (n − 1) entries that come first, each a word, one-hot over L, S, R.
    extra : tuple of (str, int)
        Groups that come last, and their sizes.
    """

    n: int
    side: float
    words: tuple[str, ...] = ("target",)
    extra: tuple[tuple[str, int], ...] = ()

    @cached_property
    def slices(self) -> dict[str, slice]:
        """Slice of each group, by name, in the order in which they lie."""
        n = self.n
        sizes = {
            **dict.fromkeys(self.words, 3 * (n - 1)),
            "released": n,
            "magnets": 4 * n,
            "speed": n,
            "joint": n - 1,
            "heading": 2 * n,
            "rate": n,
            "position": 2 * n,
            "velocity": 2 * n,
            **dict(self.extra),
        }
        ends = np.cumsum(list(sizes.values())).tolist()
        return {
            name: slice(end - size, end)
            for (name, size), end in zip(sizes.items(), ends, strict=True)
        }

    @cached_property
    def size(self) -> int:
        """Number of entries."""
        return max(group.stop for group in self.slices.values())

    @property
    def space(self) -> spaces.Box:
        """The observation space: every entry lies in [−1, 1]."""
        return spaces.Box(-1.0, 1.0, shape=(self.size,), dtype=np.float32)

    def fill(self, arrays: ChainArrays, words: Singles, out: Singles) -> None:
        """Fill in observations, but for the extra groups.

        Parameters
        ----------
        arrays : ChainArrays
            The chains.
        words : array, shape (m, words)
            The entries of the words.
        out : array, shape (m, size)
            The observations.
        """
        _fill(self.side, pointer(arrays), words, out)


@kernel
def _fill(side: float, arrays: ChainArrays, words: Singles, out: Singles) -> None:
    count, first = words.shape
    for k in range(count):
        for j in range(first):
            out[k, j] = words[k, j]
        fill_chain(side, arrays, k, out[k, first : first + 14 * arrays.angles.shape[1] - 1])


@kernel
def fill_chain(side: float, arrays: ChainArrays, row: int, out: Singles) -> None:
    """Fill in a chain's own groups, (14 n − 1,), from `released` to `velocity`."""
    released, signs, speeds = arrays.released[row], arrays.signs[row], arrays.speeds[row]
    angles, rates = arrays.angles[row], arrays.rates[row]
    base, base_velocity = arrays.base[row], arrays.base_velocity[row]
    n = angles.size
    pitch = np.sqrt(2.0) * side
    length = n * pitch
    joint = 6 * n
    heading = joint + n - 1
    rate = heading + 2 * n
    position = rate + n
    velocity = position + 2 * n
    x, y = base[0], base[1]
    vx, vy = base_velocity[0], base_velocity[1]
    for i in range(n):
        out[i] = 1.0 if released[i] else 0.0
        for face in range(4):
            out[n + 4 * i + face] = signs[i, face]
        out[5 * n + i] = speeds[i]
        sin, cos = np.sin(angles[i]), np.cos(angles[i])
        if i > 0:
            turn = angles[i] - angles[i - 1]
            out[joint + i - 1] = np.arctan2(np.sin(turn), np.cos(turn)) / np.pi
        out[heading + 2 * i] = sin
        out[heading + 2 * i + 1] = cos
        out[rate + i] = squash(rates[i] / RATE_SCALE)
        half, swing = 0.5 * pitch, 0.5 * pitch * rates[i]
        out[position + 2 * i] = squash((x + half * cos) / length)
        out[position + 2 * i + 1] = squash((y + half * sin) / length)
        out[velocity + 2 * i] = squash((vx - swing * sin) / VELOCITY_SCALE)
        out[velocity + 2 * i + 1] = squash((vy + swing * cos) / VELOCITY_SCALE)
        x += pitch * cos
        y += pitch * sin
        vx -= 2.0 * swing * sin
        vy += 2.0 * swing * cos
    # Rounding to single precision may leave the interval by one unit in the last place.
    for k in range(out.size):
        out[k] = min(max(out[k], -1.0), 1.0)


@kernel
def squash(value: float) -> float:
    """Return ``x / (1 + |x|)``: inside (−1, 1), strictly increasing, so nothing is clipped away."""
    return value / (1.0 + abs(value))
