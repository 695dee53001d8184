"""A chain in the public order, component 1 first: its state, and its place in the engine.

The engine counts components from the held end. Seen from the other end, a chain has the reverse
order, headings turned by π and joint angles of opposite sign.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from magfold_env.engine import indices as ix
from magfold_env.engine.compile.jit import kernel
from magfold_env.engine.state import Array, IntArray, is_finite
from magfold_env.shapes import centres

Bools = NDArray[np.bool_]


@dataclass(frozen=True)
class Orientation:
    """The orientation of a chain in the engine."""

    flip: bool
    """Whether the engine counts from component n."""
    length: Array
    """Distances between hinges [m], in the engine's order, shape (n,)."""

    def index(self, i: int) -> int:
        """Map a component's index to the engine's, or back."""
        return self.length.size - 1 - i if self.flip else i

    def headings(self, inside: Array) -> Array:
        """Return the public headings for the engine's headings, shape (..., n)."""
        return inside[..., ::-1] + math.pi if self.flip else inside.copy()

    def rates(self, inside: Array) -> Array:
        """Return the public rates for the engine's rates, shape (..., n)."""
        return inside[..., ::-1].copy() if self.flip else inside.copy()

    def outer_hinge(self, q: Array, lo: IntArray) -> Array:
        """Return component 1's outer hinge [m], (m, 2), for coordinates (m, n + 2).

        ``lo`` (m,) is the first component that moves freely, and the base is its inner hinge.
        """
        n = self.length.size
        links = self.length * np.exp(1j * q[:, :n])
        held = np.arange(n) < lo[:, None]
        base = q[:, n] + 1j * q[:, n + 1]
        if self.flip:
            hinge = base + np.where(held, 0.0, links).sum(axis=1)
        else:
            hinge = base - np.where(held, links, 0.0).sum(axis=1)
        return np.stack([hinge.real, hinge.imag], axis=1)

    def outer_velocity(self, q: Array, v: Array) -> Array:
        """Return the velocity of component 1's outer hinge [m/s], (m, 2), for ``v`` (m, n + 2)."""
        n = self.length.size
        velocity = v[:, n:].copy()
        if self.flip:
            turning = 1j * self.length * v[:, :n] * np.exp(1j * q[:, :n])
            velocity += turning.sum(axis=1).view(np.float64).reshape(-1, 2)
        return velocity


@kernel
def public_state(
    flip: bool,
    lo: int,
    length: Array,
    q: Array,
    v: Array,
    angles: Array,
    rates: Array,
    base: Array,
    base_velocity: Array,
) -> None:
    """Fill in headings [rad], rates [rad/s], and component 1's outer hinge [m] and its velocity.

    ``flip`` and ``length`` are as in `Orientation`. ``q`` and ``v`` (n + 2,) are coordinates and
    velocities in the engine, where ``lo`` is the first component that moves freely and the base is
    its inner hinge.
    """
    n = length.size
    x, y, vx, vy = q[n], q[n + 1], v[n], v[n + 1]
    for k in range(n):
        c, s = length[k] * math.cos(q[k]), length[k] * math.sin(q[k])
        if flip:
            if k >= lo:
                x += c
                y += s
            vx -= s * v[k]
            vy += c * v[k]
            angles[n - 1 - k] = q[k] + math.pi
            rates[n - 1 - k] = v[k]
        else:
            if k < lo:
                x -= c
                y -= s
            angles[k] = q[k]
            rates[k] = v[k]
    base[0], base[1] = x, y
    base_velocity[0], base_velocity[1] = vx, vy


@kernel
def public_states(
    rows: IntArray,
    flip: Bools,
    length: Array,
    counters: IntArray,
    q: Array,
    v: Array,
    angles: Array,
    rates: Array,
    base: Array,
    base_velocity: Array,
) -> None:
    """Apply `public_state` to chains whose numbers are finite; arrays have one row per chain."""
    for j in range(rows.size):
        k: int = rows[j]
        if is_finite(q[k]) and is_finite(v[k]):
            public_state(
                flip[k], counters[k, ix.N_HELD], length, q[k], v[k],
                angles[k], rates[k], base[k], base_velocity[k],
            )  # fmt: skip


@kernel
def advances(length: Array, counters: IntArray, q: Array, depth: Array, out: Array) -> None:
    """Fill in the advance of the feeds of some chains [m], (m,).

    The advance of a chain that is out of the tube is its length. ``depth`` (m,) is the initial
    length of the chains in the tube; see `public_states` for the other arguments.
    """
    for k in range(out.size):
        held = counters[k, ix.N_HELD]
        x = depth[k] + q[k, length.size]
        for i in range(held):
            x -= length[i] * math.cos(q[k, i])
        if held == 0:
            x = length.sum()
        out[k] = x if x > 0.0 else 0.0  # 0 also if x is not a number


@dataclass(frozen=True)
class ChainState:
    """The state of a chain's motion, component 1 first."""

    angles: NDArray[np.float64]
    rates: NDArray[np.float64]
    """Headings [rad] and their rates [rad/s], shape (n,)."""
    base: NDArray[np.float64]
    base_velocity: NDArray[np.float64]
    """Outer hinge of component 1 [m], with the tube's mouth at the origin, and its velocity [m/s],
    shape (2,)."""

    @property
    def joint_angles(self) -> NDArray[np.float64]:
        """Relative angles [rad], shape (n - 1,)."""
        return np.diff(self.angles)

    @property
    def is_finite(self) -> bool:
        """Whether every number is finite."""
        return all(np.isfinite(values).all() for values in vars(self).values())

    def centres(self, side: float) -> NDArray[np.float64]:
        """Return the components' centres [m], shape (n, 2)."""
        return centres(self.angles, side=side, base=self.base)

    def velocities(self, side: float) -> NDArray[np.float64]:
        """Return the velocities of the centres [m/s], shape (n, 2)."""
        turning = np.column_stack((-np.sin(self.angles), np.cos(self.angles)))
        links = np.sqrt(2.0) * side * self.rates[:, None] * turning
        return self.base_velocity + np.cumsum(links, axis=0) - links / 2
