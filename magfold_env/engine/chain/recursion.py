"""Accelerations of pinned chains without constraints, in a single sweep in each direction.

This is the articulated-body recursion of ``engine.chain.articulated``, which has separate stages
because the constraints need them. Let r be the vector from a component's inner hinge to its centre,
d the vector to its outer hinge, v = j d (j turns by a right angle) and Q its generalised force. A
sweep from tip to root finds

    D = I + m r² + vᵀ P v,   h = P v + m j r,   q = p − ω² (P d + m r),   k = (Q − v·q) / D,
    P ← P + m·1 − h hᵀ / D,   p ← q + h k,

and a sweep back finds the accelerations: α = k − h·a / D, a ← a + v α − ω² d. Each body must wait
for its neighbour's P, so the time depends on the longest sequence of dependent operations, not on
their number. To shorten it, D is a quadratic form, and the first sweep also finds the E and b with
which the sweep back is a ← E a + b.

Many chains of the same bodies run side by side, one chain per vector lane: each number becomes a
row of `LANES` numbers, which the compiler vectorises without reordering any arithmetic. A chain's
accelerations therefore have the same bits in any lane, in any batch and with any number of threads.
"""

import numba
import numpy as np

from magfold_env.engine.compile.jit import inlined, kernel, parallel_kernel
from magfold_env.engine.elementary import sincos
from magfold_env.engine.state import Array, Bodies, Model, Work

ROWS = 10  # of the scratch space (ROWS, n)
LANES = 32

# Slots of a record. Record i holds component i's inputs and values at its inner hinge. The inward
# sweep writes P and p there and, once the next component has read them, that component's h / D and
# k; the outward sweep writes the hinge's acceleration.
HEADING, RATE, FORCE, PXX, PXY, PYY, PX, PY, SINE, COSINE = range(10)
JX, JY, ACCELERATION = PXX, PXY, PYY
AX, AY = PXX, PXY
SLOTS = 10

_CACHE_LINE = 8  # numbers in a cache line


@kernel
def accelerate(
    bodies: Bodies, base_x: float, base_y: float, heading: Array, rate: Array, force: Array,
    scratch: Array, out: Array,
) -> None:  # fmt: skip
    """Compute angular accelerations (n,) [rad/s²] under generalised forces ``force`` (n,) [N·m].

    (``base_x``, ``base_y``) is the acceleration of the innermost hinge [m/s²]; its negative acts
    like in-plane gravity. ``scratch`` has the shape (ROWS, n).
    """
    n = bodies.mass.size
    sine, cosine = scratch[0], scratch[1]
    for i in range(n):
        sine[i], cosine[i] = sincos(heading[i])
    pxx, pxy, pyy = 0.0, 0.0, 0.0
    px, py = 0.0, 0.0
    for i in range(n - 1, -1, -1):
        m, d = bodies.mass[i], bodies.length[i]
        mr = m * bodies.reach[i]
        us, uc = sine[i], cosine[i]
        s, c = d * us, d * uc
        w2 = rate[i] * rate[i]
        inverse = 1.0 / (
            (bodies.inertia[i] + mr * bodies.reach[i] + pxx * (s * s))
            + (pyy * (c * c) - pxy * (2.0 * s * c))
        )
        hx = (pxy * c - pxx * s) - mr * us
        hy = (pyy * c - pxy * s) + mr * uc
        qx = px - w2 * (pxx * c + pxy * s + mr * uc)
        qy = py - w2 * (pxy * c + pyy * s + mr * us)
        k = (force[i] + (s * qx - c * qy)) * inverse
        pxx = (pxx + m) - hx * hx * inverse
        pxy = pxy - hx * hy * inverse
        pyy = (pyy + m) - hy * hy * inverse
        px = qx + hx * k
        py = qy + hy * k
        jx, jy = hx * inverse, hy * inverse
        out[i] = k
        scratch[2, i] = jx
        scratch[3, i] = jy
        scratch[4, i] = s * jx
        scratch[5, i] = s * jy
        scratch[6, i] = c * jx
        scratch[7, i] = c * jy
        scratch[8, i] = s * k + w2 * c
        scratch[9, i] = c * k - w2 * s
    ax, ay = base_x, base_y
    for i in range(n):
        out[i] -= scratch[2, i] * ax + scratch[3, i] * ay
        turned_x = scratch[4, i] * ax + scratch[5, i] * ay
        turned_y = scratch[6, i] * ax + scratch[7, i] * ay
        ax = (ax - scratch[8, i]) + turned_x
        ay = (ay + scratch[9, i]) - turned_y


@inlined
def swing(model: Model, q: Array, v: Array, work: Work, out: Array) -> None:
    """Compute the accelerations (n + 2,) of a chain on which only gravity and its pin act.

    An upward acceleration of the hinge represents gravity; ``work.loads.torque`` stays zero.
    """
    x, y = -model.gravity_x, -model.gravity_y
    accelerate(model.bodies, x, y, q, v, work.loads.torque, work.chain.sweep, out)
    out[model.n] = 0.0
    out[model.n + 1] = 0.0


def new_lanes(chains: int, n: int) -> Array:
    """Return zeros for ``chains`` chains of n components, shape (blocks, n + 1, SLOTS, LANES).

    Rows begin at a cache line, because a vector that straddles two lines takes twice the time.
    """
    shape = (-(-chains // LANES), n + 1, SLOTS, LANES)
    size = int(np.prod(shape))
    space = np.zeros(size + _CACHE_LINE)
    first = -(space.ctypes.data // space.itemsize) % _CACHE_LINE
    return space[first : first + size].reshape(shape)


def accelerate_many(
    bodies: Bodies, base: tuple[float, float], headings: Array, rates: Array,
    forces: Array | None = None,
) -> Array:  # fmt: skip
    """Return angular accelerations (chains, n) [rad/s²] of many chains of the same bodies.

    The arguments are those of `accelerate`, with arrays (chains, n); ``forces`` are zero by default
    and headings may be up to 1e14 rad.
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
    """Compute each record's ACCELERATION from HEADING, RATE and FORCE of the record before it."""
    for b in numba.prange(blocks.shape[0]):
        accelerate_lanes(bodies, base_x, base_y, blocks[b])


@inlined
def accelerate_lanes(bodies: Bodies, base_x: float, base_y: float, lanes: Array) -> None:
    """Do the work of `accelerate_blocks` for one block (n + 1, SLOTS, LANES).

    The compiler must know the block's shape and thus the spacing of its rows; otherwise it would
    have to assume that rows overlap, and would handle one lane after another.
    """
    if lanes.shape[1] == SLOTS and lanes.shape[2] == LANES:
        _sweep_inwards(bodies, lanes)
        _sweep_outwards(bodies.mass.size, base_x, base_y, lanes)


@inlined
def _sweep_inwards(bodies: Bodies, lanes: Array) -> None:
    n = bodies.mass.size
    for k in range(LANES):
        lanes[n, PXX, k] = 0.0
        lanes[n, PXY, k] = 0.0
        lanes[n, PYY, k] = 0.0
        lanes[n, PX, k] = 0.0
        lanes[n, PY, k] = 0.0
    for i in range(n - 1, -1, -1):
        m, r, d = bodies.mass[i], bodies.reach[i], bodies.length[i]
        at_hinge = bodies.inertia[i] + m * r * r
        share = m * (r / d)
        for k in range(LANES):
            s, c = sincos(lanes[i, HEADING, k])
            lanes[i, SINE, k] = d * s
            lanes[i, COSINE, k] = d * c
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
