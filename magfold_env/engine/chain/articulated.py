"""Dynamics of a planar chain in O(n): kinematics, generalised forces, accelerations.

The equation of motion is equation 39 of the paper, (Γ + Rᵀ E R) ω̇ = Q with absolute headings as
coordinates. A planar articulated-body recursion solves it: the part of the chain beyond a hinge
responds to a hinge acceleration ``a`` with the force ``P a + p`` (``P`` symmetric 2×2), so one
sweep from tip to root and one back suffice. All arrays are indexed from the inner end; ``lo`` is
the first component that moves freely. Coordinates, velocities and generalised forces are packed
into arrays (n + 2,): the headings, then the inner hinge of component ``lo``, the *base*.
"""

import math

from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.elementary import sincos
from magfold_env.engine.state import Array, Bodies, Centres, IntArray, Loads, Pose, Recursion

FREE, DRIVEN = 0.0, math.inf  # values of ``base``, see `solve`


@kernel
def place(lo: int, bodies: Bodies, q: Array, pose: Pose) -> None:
    """Fill in ``pose`` from component ``lo`` on for the coordinates ``q`` (n + 2,)."""
    n = bodies.mass.size
    for i in range(lo, n):
        pose.sin[i], pose.cos[i] = sincos(q[i])
    x, y = q[n], q[n + 1]
    for i in range(lo, n):
        c, s = pose.cos[i], pose.sin[i]
        pose.x[i] = x + bodies.reach[i] * c
        pose.y[i] = y + bodies.reach[i] * s
        x += bodies.length[i] * c
        y += bodies.length[i] * s


@kernel
def centre_velocities(lo: int, bodies: Bodies, pose: Pose, v: Array, vx: Array, vy: Array) -> None:
    """Compute the centres' velocities [m/s] from the chain's velocities ``v`` (n + 2,)."""
    n = bodies.mass.size
    x, y = v[n], v[n + 1]
    for i in range(lo, n):
        w = v[i]
        vx[i] = x - bodies.reach[i] * pose.sin[i] * w
        vy[i] = y + bodies.reach[i] * pose.cos[i] * w
        x -= bodies.length[i] * pose.sin[i] * w
        y += bodies.length[i] * pose.cos[i] * w


@kernel
def centripetal(lo: int, bodies: Bodies, pose: Pose, v: Array, ax: Array, ay: Array) -> None:
    """Compute the centres' accelerations [m/s²] if ω̇ and the base's acceleration are zero."""
    x, y = 0.0, 0.0
    for i in range(lo, bodies.mass.size):
        w2 = v[i] * v[i]
        ax[i] = x - w2 * bodies.reach[i] * pose.cos[i]
        ay[i] = y - w2 * bodies.reach[i] * pose.sin[i]
        x -= w2 * bodies.length[i] * pose.cos[i]
        y -= w2 * bodies.length[i] * pose.sin[i]


@inlined
def centre_motion(lo: int, bodies: Bodies, pose: Pose, v: Array, centres: Centres) -> None:
    """Compute the centres' velocities, and the accelerations that remain when ``v`` is constant."""
    centre_velocities(lo, bodies, pose, v, centres.vx, centres.vy)
    centripetal(lo, bodies, pose, v, centres.ax, centres.ay)


@kernel
def generalise(lo: int, bodies: Bodies, pose: Pose, loads: Loads, out: Array) -> None:
    """Convert centre forces [N] and torques about centres [N·m] to generalised forces (n + 2,)."""
    n, fx, fy = bodies.mass.size, loads.fx, loads.fy
    sx, sy = 0.0, 0.0
    for i in range(n - 1, lo - 1, -1):
        c, s = pose.cos[i], pose.sin[i]
        out[i] = (
            loads.torque[i]
            + bodies.reach[i] * (c * fy[i] - s * fx[i])
            + bodies.length[i] * (c * sy - s * sx)
        )
        sx += fx[i]
        sy += fy[i]
    out[n] = sx
    out[n + 1] = sy


@kernel
def factor(lo: int, bodies: Bodies, pose: Pose, lock: IntArray, chain: Recursion) -> None:
    """Compute 1/D, h, D and P from tip to root, and store them in ``chain.articulated``.

    Row i holds 1/D, h (two entries), D and P (xx, xy, yy) of component i's inner hinge; `recursion`
    defines them. A component whose ``lock`` is not 0 turns with the component before it, or not at
    all if it is the first. It is not eliminated, so that locked components move as one rigid body.
    """
    art = chain.articulated
    pxx, pxy, pyy = 0.0, 0.0, 0.0
    carried, carried_x, carried_y = 0.0, 0.0, 0.0
    for i in range(bodies.mass.size - 1, lo - 1, -1):
        c, s = pose.cos[i], pose.sin[i]
        m, r, d = bodies.mass[i], bodies.reach[i], bodies.length[i]
        vx, vy = -d * s, d * c
        gx = pxx * vx + pxy * vy + carried_x
        gy = pxy * vx + pyy * vy + carried_y
        inertia = bodies.inertia[i] + m * r * r + carried
        inertia += vx * (gx + carried_x) + vy * (gy + carried_y)
        hx = gx - m * r * s
        hy = gy + m * r * c
        pxx += m
        pyy += m
        art[i, 1] = hx
        art[i, 2] = hy
        art[i, 3] = inertia
        if lock[i] == 0:
            inverse = 1.0 / inertia
            art[i, 0] = inverse
            pxx -= hx * hx * inverse
            pxy -= hx * hy * inverse
            pyy -= hy * hy * inverse
            carried, carried_x, carried_y = 0.0, 0.0, 0.0
        else:
            art[i, 0] = 0.0
            carried, carried_x, carried_y = inertia, hx, hy
        art[i, 4] = pxx
        art[i, 5] = pxy
        art[i, 6] = pyy


@kernel
def solve(
    lo: int, bodies: Bodies, pose: Pose, lock: IntArray, base: float, force: Array, out: Array,
    chain: Recursion,
) -> None:  # fmt: skip
    """Solve M(φ) a = Q for generalised forces ``force`` (n + 2,); ``out`` may be ``force``.

    ``base`` is the mass [kg] that moves with the base, which then moves only along the tube. FREE
    means a free base without such a mass; DRIVEN means a prescribed motion, so the base does not
    accelerate here. The function also turns impulses into velocity changes. ``chain.hold`` gets the
    torques that hold locked components, on the outer sides of their inner hinges, and 0 elsewhere.
    """
    n, art, hold = bodies.mass.size, chain.articulated, chain.hold
    px, py, carried = 0.0, 0.0, 0.0
    for i in range(n - 1, lo - 1, -1):
        d = bodies.length[i]
        k = force[i] - d * (pose.cos[i] * py - pose.sin[i] * px) + carried
        hold[i] = k
        if lock[i] == 0:
            k *= art[i, 0]
            px += art[i, 1] * k
            py += art[i, 2] * k
            carried = 0.0
        else:
            carried = k
    ax, ay = 0.0, 0.0
    if base == FREE:
        # Only the base's generalised force acts on the innermost hinge: P a + p = force.
        bx = force[n] - px
        by = force[n + 1] - py
        det = art[lo, 4] * art[lo, 6] - art[lo, 5] * art[lo, 5]
        ax = (art[lo, 6] * bx - art[lo, 5] * by) / det
        ay = (art[lo, 4] * by - art[lo, 5] * bx) / det
    elif base < DRIVEN:
        ax = (force[n] - px) / (art[lo, 4] + base)
    out[n] = ax
    out[n + 1] = ay
    w = 0.0
    for i in range(lo, n):
        k = hold[i] - art[i, 1] * ax - art[i, 2] * ay
        if lock[i] == 0:
            w = k * art[i, 0]
            hold[i] = 0.0
        else:
            hold[i] = art[i, 3] * w - k
        out[i] = w
        ax -= bodies.length[i] * pose.sin[i] * w
        ay += bodies.length[i] * pose.cos[i] * w
