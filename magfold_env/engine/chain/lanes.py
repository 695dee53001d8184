"""Accelerations of many chains of the same bodies at once, one chain a vector lane.

The recursion of ``engine.recursion`` for `LANES` chains side by side: every number becomes a row
of `LANES` numbers, which the compiler turns into vector instructions without any leave to reorder
arithmetic. So a chain's accelerations are the same bits in any lane, in any batch and on any
number of threads.

Every sweep begins by checking the shape of its block. That is not only a precaution: it tells the
compiler how far apart the rows lie; else it would have to allow for their overlapping and do one
lane after the other.
"""

from __future__ import annotations

import numba
import numpy as np

from magfold_env.engine.chain.sincos import sincos
from magfold_env.engine.compile.jit import inlined, parallel_kernel
from magfold_env.engine.state import Array, Bodies

LANES = 32

# Rows of a record. Record i holds what is given of component i, and what its inner hinge has from
# the components beyond: the sweep inwards leaves P and p there until the next component has read
# them, then that component's h / D and k, and the sweep outwards the hinge's acceleration.
HEADING, RATE, FORCE, PXX, PXY, PYY, PX, PY, SINE, COSINE = range(10)
JX, JY, ACCELERATION = PXX, PXY, PYY
AX, AY = PXX, PXY
ROWS = 10

_CACHE_LINE = 8  # numbers


def new_lanes(chains: int, n: int) -> Array:
    """Room for ``chains`` chains of n components, shape (blocks, n + 1, ROWS, LANES), zeroed.

    Rows begin with a cache line: a vector that straddles two costs twice the time.
    """
    shape = (-(-chains // LANES), n + 1, ROWS, LANES)
    size = int(np.prod(shape))
    space = np.zeros(size + _CACHE_LINE)
    first = -(space.ctypes.data // space.itemsize) % _CACHE_LINE
    return space[first : first + size].reshape(shape)


def accelerate(
    bodies: Bodies,
    base: tuple[float, float],
    headings: Array,
    rates: Array,
    forces: Array | None = None,
) -> Array:
    """Angular accelerations (chains, n) [rad/s²] of pinned chains.

    Parameters
    ----------
    bodies
        What all chains are made of.
    base
        Acceleration of the innermost hinges [m/s²]; its negative acts like in-plane gravity.
    headings, rates
        [rad] up to 1e14 and [rad/s], shape (chains, n).
    forces
        Generalised forces [N·m], shape (chains, n); none by default.
    """
    chains, n = headings.shape
    blocks = new_lanes(chains, n)
    given = {HEADING: headings, RATE: rates}
    if forces is not None:
        given[FORCE] = forces
    for row, values in given.items():
        padded = np.zeros((blocks.shape[0] * LANES, n))
        padded[:chains] = values
        blocks[:, :n, row] = padded.reshape(-1, LANES, n).transpose(0, 2, 1)
    accelerate_blocks(bodies, base[0], base[1], blocks)
    found = blocks[:, 1:, ACCELERATION].transpose(0, 2, 1)
    return found.reshape(-1, n)[:chains].copy()


@parallel_kernel
def accelerate_blocks(bodies: Bodies, base_x: float, base_y: float, blocks: Array) -> None:
    """Fill the row ACCELERATION of record i + 1 of all blocks from HEADING, RATE, FORCE of i."""
    for b in numba.prange(blocks.shape[0]):
        accelerate_lanes(bodies, base_x, base_y, blocks[b])


@inlined
def accelerate_lanes(bodies: Bodies, base_x: float, base_y: float, lanes: Array) -> None:
    """Do the same for one block (n + 1, ROWS, LANES)."""
    _turn(bodies, lanes)
    _sweep_inwards(bodies, lanes)
    _sweep_outwards(bodies.mass.size, base_x, base_y, lanes)


@inlined
def _turn(bodies: Bodies, lanes: Array) -> None:
    """Sine and cosine of the headings, times the length."""
    if lanes.shape[1] != ROWS or lanes.shape[2] != LANES:
        return
    for i in range(bodies.length.size):
        d = bodies.length[i]
        for k in range(LANES):
            s, c = sincos(lanes[i, HEADING, k])
            lanes[i, SINE, k] = d * s
            lanes[i, COSINE, k] = d * c


@inlined
def _sweep_inwards(bodies: Bodies, lanes: Array) -> None:
    if lanes.shape[1] != ROWS or lanes.shape[2] != LANES:
        return
    n = bodies.mass.size
    for k in range(LANES):
        lanes[n, PXX, k] = 0.0
        lanes[n, PXY, k] = 0.0
        lanes[n, PYY, k] = 0.0
        lanes[n, PX, k] = 0.0
        lanes[n, PY, k] = 0.0
    for i in range(n - 1, -1, -1):
        m, r = bodies.mass[i], bodies.reach[i]
        at_hinge = bodies.inertia[i] + m * r * r
        share = m * (r / bodies.length[i])
        for k in range(LANES):
            s, c = lanes[i, SINE, k], lanes[i, COSINE, k]
            w2 = lanes[i, RATE, k] * lanes[i, RATE, k]
            pxx, pxy, pyy = lanes[i + 1, PXX, k], lanes[i + 1, PXY, k], lanes[i + 1, PYY, k]
            mx, my = share * c, share * s
            vx = pxy * c - pxx * s
            vy = pyy * c - pxy * s
            inverse = 1.0 / (at_hinge + (c * vy - s * vx))
            hx, hy = vx - my, vy + mx
            qx = lanes[i + 1, PX, k] - w2 * (pxx * c + pxy * s + mx)
            qy = lanes[i + 1, PY, k] - w2 * (pxy * c + pyy * s + my)
            turn = (lanes[i, FORCE, k] + (s * qx - c * qy)) * inverse
            jx, jy = hx * inverse, hy * inverse
            lanes[i, PXX, k] = (pxx + m) - hx * jx
            lanes[i, PXY, k] = pxy - hx * jy
            lanes[i, PYY, k] = (pyy + m) - hy * jy
            lanes[i, PX, k] = qx + hx * turn
            lanes[i, PY, k] = qy + hy * turn
            lanes[i + 1, JX, k] = jx
            lanes[i + 1, JY, k] = jy
            lanes[i + 1, ACCELERATION, k] = turn


@inlined
def _sweep_outwards(n: int, base_x: float, base_y: float, lanes: Array) -> None:
    if lanes.shape[1] != ROWS or lanes.shape[2] != LANES:
        return
    for k in range(LANES):
        lanes[0, AX, k] = base_x
        lanes[0, AY, k] = base_y
    for i in range(n):
        for k in range(LANES):
            ax, ay = lanes[i, AX, k], lanes[i, AY, k]
            s, c = lanes[i, SINE, k], lanes[i, COSINE, k]
            w2 = lanes[i, RATE, k] * lanes[i, RATE, k]
            turn = lanes[i + 1, ACCELERATION, k] - (
                lanes[i + 1, JX, k] * ax + lanes[i + 1, JY, k] * ay
            )
            lanes[i + 1, ACCELERATION, k] = turn
            lanes[i + 1, AX, k] = ax - (s * turn + w2 * c)
            lanes[i + 1, AY, k] = ay + (c * turn - w2 * s)
