"""A chain as it is seen from outside: component 1 first, headings, rates and the outer hinge.

The engine counts from the held end. Seen from its other end a chain has its order reversed and its
headings turned by π.
"""

from __future__ import annotations

import math

from magfold_env.engine.compile.jit import kernel
from magfold_env.engine.state import LO, Array, IntArray, is_finite


@kernel
def look(
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
    """Fill headings [rad] and rates [rad/s], (n,), the outer hinge [m] and its velocity, (2,).

    That is component 1's hinge.

    Parameters
    ----------
    flip
        Whether the engine counts from component n.
    lo
        The first component, in the engine's order, that moves freely; the base is its inner hinge.
    length
        Hinge to hinge [m], in the engine's order, (n,).
    q, v
        Coordinates and velocities in the engine, (n + 2,).
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
def look_at(
    rows: IntArray,
    flip: bool,
    length: Array,
    counters: IntArray,
    q: Array,
    v: Array,
    angles: Array,
    rates: Array,
    base: Array,
    base_velocity: Array,
) -> None:
    """`look` at those of some chains whose numbers are finite; every array has a row for each."""
    for j in range(rows.size):
        k: int = rows[j]
        if is_finite(q[k]) and is_finite(v[k]):
            look(
                flip, counters[k, LO], length, q[k], v[k],
                angles[k], rates[k], base[k], base_velocity[k],
            )  # fmt: skip
