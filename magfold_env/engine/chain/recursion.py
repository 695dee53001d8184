"""Accelerations of one pinned chain in a single pass each way, for where the chain alone counts.

The same articulated-body recursion as ``engine.chain``, which keeps its stages apart because the
constraints need them. With r the vector from a component's inner hinge to its centre, d to its
outer hinge, v = j d (j turns by a right angle) and Q its generalised force, a sweep from tip to
root finds

    D = I + m r² + vᵀ P v,   h = P v + m j r,   q = p − ω² (P d + m r),   k = (Q − v·q) / D,
    P ← P + m·1 − h hᵀ / D,   p ← q + h k,

and one back the accelerations: α = k − h·a / D, a ← a + v α − ω² d. The next body must wait for
its neighbour's P, so what counts is the longest chain of dependent operations, not their number:
D is written as a quadratic form, and the way back as a ← E a + b with E and b found on the way in.
"""

from __future__ import annotations

from magfold_env.engine.chain.sincos import sincos
from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.state import Array, Bodies, Model, Work

ROWS = 10  # of the scratch space (ROWS, n)


@kernel
def accelerate(
    bodies: Bodies,
    base_x: float,
    base_y: float,
    heading: Array,
    rate: Array,
    force: Array,
    scratch: Array,
    out: Array,
) -> None:
    """Angular accelerations (n,) [rad/s²] under generalised forces ``force`` (n,) [N·m].

    ``base_x``, ``base_y`` is the acceleration of the innermost hinge [m/s²]; its negative acts
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
def only_swings(model: Model) -> bool:
    """Whether nothing but gravity and its pin acts on the chain, and nothing ever will."""
    return model.pinned and not (model.magnetic or model.frictional or model.contact)


@inlined
def swing(model: Model, q: Array, v: Array, work: Work, out: Array) -> None:
    """Accelerations (n + 2,) of such a chain, the shortest way.

    A hinge that accelerates upwards is gravity; ``work.torque`` stays zero.
    """
    accelerate(model.bodies, -model.gravity_x, -model.gravity_y, q, v, work.torque, work.sweep, out)
    out[model.n] = 0.0
    out[model.n + 1] = 0.0
