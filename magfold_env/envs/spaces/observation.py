"""Flat observations of a chain in a tube: their layouts and the kernels that fill them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from magfold_env.engine.compile.jit import kernel
from magfold_env.envs.chains.arrays import ChainArrays, Floats, Ints

Singles = NDArray[np.float32]

VELOCITY_SCALE = 1.0
"""Velocity that an observation encodes as 0.5 [m/s]."""

RATE_SCALE = 100.0
"""Angular rate that an observation encodes as 0.5 [rad/s]."""

POSITION_NOISE = 3e-4
"""Standard deviation of a position in a frame, along x and along y [m]."""

HEADING_NOISE = np.pi / 180.0
"""Standard deviation of a heading in a frame [rad]."""


MEASURED = ("joint", "heading", "rate", "position", "velocity", "seen", "force", "borne")
"""Groups that a sensor measures; the agent knows the others without measurement."""


@dataclass(frozen=True)
class Layout:
    """The position of each group of entries in the observation of a chain."""

    n: int
    """Number of components."""
    side: float
    """Edge length of a casing [m]."""
    sizes: Mapping[str, int]
    """Number of entries of each group, by name, in the order of the observation."""

    @property
    def measured(self) -> tuple[str, ...]:
        """Names of the groups that a sensor measures."""
        return tuple(name for name in self.sizes if name in MEASURED)

    def hide(self, entries: Singles) -> None:
        """Set the groups that a sensor measures to 0 in observations, (…, size)."""
        for name in self.measured:
            entries[..., self.slices[name]] = 0.0

    @cached_property
    def slices(self) -> dict[str, slice]:
        """Slice of each group, by name, in the order of the observation."""
        ends = np.cumsum(list(self.sizes.values())).tolist()
        return {
            name: slice(end - size, end)
            for (name, size), end in zip(self.sizes.items(), ends, strict=True)
        }

    @cached_property
    def size(self) -> int:
        """Number of entries."""
        return sum(self.sizes.values())

    @cached_property
    def frame(self) -> slice:
        """The slice of a camera's frame; see `take_frames`."""
        return slice(self.slices["seen"].start, self.slices["position"].stop)

    @property
    def space(self) -> spaces.Box:
        """The observation space: every entry is within [−1, 1]."""
        return spaces.Box(-1.0, 1.0, shape=(self.size,), dtype=np.float32)


def chain_layout(n: int, side: float, words: Sequence[str] = ("target",)) -> Layout:
    """Return the layout for a fully visible chain whose components are chosen; see `fill`.

    `words` names the groups that come first. Each has 3 (n − 1) entries: one-hot letters L, S, R.
    """
    sizes = {"released": n, "magnets": 4 * n, "speed": n, "joint": n - 1, "heading": 2 * n}
    sizes |= {"rate": n, "position": 2 * n, "velocity": 2 * n}
    return Layout(n, side, {**dict.fromkeys(words, 3 * (n - 1)), **sizes})


def camera_layout(
    n: int, side: float, before: Mapping[str, int], after: Mapping[str, int]
) -> Layout:
    """Return the layout for a chain seen by a camera, with groups before and after its frame."""
    frame = {"seen": n, "heading": 2 * n, "position": 2 * n}
    return Layout(n, side, {**before, **frame, **after})


@kernel
def take_frames(
    side: float, rows: Ints, arrays: ChainArrays, noise: Floats, frames: Floats
) -> None:
    """Write the camera's frames of the given chains to their rows of ``frames``, (m, 5 n).

    ``side`` is the edge length of a casing [m]. ``noise`` (rows, 3 n) contains standard normal
    numbers for the heading, x and y of each component.
    """
    n = arrays.angles.shape[1]
    pitch = np.sqrt(2.0) * side
    length = n * pitch
    for j in range(rows.size):
        k: int = rows[j]
        frame = frames[k]
        x, y = arrays.base[k, 0], arrays.base[k, 1]
        for i in range(n):
            angle = arrays.angles[k, i]
            across, up = pitch * np.cos(angle), pitch * np.sin(angle)
            # A casing that was drawn in again is invisible, even if the tube does not hold it.
            if arrays.released[k, i] and x + 0.5 * across > 0.0:
                angle += HEADING_NOISE * noise[j, 3 * i]
                frame[i] = 1.0
                frame[n + 2 * i], frame[n + 2 * i + 1] = np.sin(angle), np.cos(angle)
                seen_x = x + 0.5 * across + POSITION_NOISE * noise[j, 3 * i + 1]
                seen_y = y + 0.5 * up + POSITION_NOISE * noise[j, 3 * i + 2]
                frame[3 * n + 2 * i] = squash(seen_x / length)
                frame[3 * n + 2 * i + 1] = squash(seen_y / length)
            else:
                frame[i] = 0.0
                frame[n + 2 * i] = frame[n + 2 * i + 1] = 0.0
                frame[3 * n + 2 * i] = frame[3 * n + 2 * i + 1] = 0.0
            x += across
            y += up


@kernel
def fill(side: float, arrays: ChainArrays, words: Singles, out: Singles) -> None:
    """Write observations of all chains to ``out`` (m, size), in the layout of `chain_layout`.

    ``side`` is the edge length of a casing [m]. ``words`` (m, words) are the first entries.
    """
    count, first = words.shape
    for k in range(count):
        for j in range(first):
            out[k, j] = words[k, j]
        fill_chain(side, arrays, k, out[k, first : first + 14 * arrays.angles.shape[1] - 1])


@kernel
def fill_chain(side: float, arrays: ChainArrays, row: int, out: Singles) -> None:
    """Write one chain's own groups, from `released` to `velocity`, to ``out`` (14 n − 1,)."""
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
    """Return ``x / (1 + |x|)``, which is strictly increasing and within (−1, 1)."""
    return value / (1.0 + abs(value))
