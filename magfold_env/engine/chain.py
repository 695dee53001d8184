"""Dynamics of a planar chain in O(n): kinematics, generalised forces, and the mass matrix solved.

The specification is equation 39 of the paper, (Γ + Rᵀ E R) ω̇ = Q with absolute headings as
coordinates. It is solved by a planar articulated-body recursion: seen from its inner hinge, the
part of the chain beyond it answers a hinge acceleration ``a`` with the force ``P a + p`` (``P``
symmetric 2×2), so one sweep from tip to root and one back suffice. All arrays are indexed from
the inner end; ``lo`` is the first component that moves freely. Coordinates, velocities and
generalised forces are packed as (n + 2,): the headings, then the inner hinge of component ``lo``,
the *base*.
"""

from __future__ import annotations

import math

from magfold_env.engine.jit import kernel
from magfold_env.engine.state import Array, Bodies, Pose


@kernel
def place(lo: int, bodies: Bodies, q: Array, pose: Pose) -> None:
    """Fill ``pose`` from component ``lo`` on for the coordinates ``q`` (n + 2,)."""
    n = bodies.mass.size
    x, y = q[n], q[n + 1]
    for i in range(lo, n):
        c = math.cos(q[i])
        s = math.sin(q[i])
        pose.cos[i] = c
        pose.sin[i] = s
        pose.x[i] = x + bodies.reach[i] * c
        pose.y[i] = y + bodies.reach[i] * s
        x += bodies.length[i] * c
        y += bodies.length[i] * s


@kernel
def centre_velocities(lo: int, bodies: Bodies, pose: Pose, v: Array, vx: Array, vy: Array) -> None:
    """Velocities of the centres [m/s] for the velocities ``v`` (n + 2,)."""
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
    """Accelerations of the centres [m/s²] that remain when ω̇ and the base's are zero."""
    x, y = 0.0, 0.0
    for i in range(lo, bodies.mass.size):
        w2 = v[i] * v[i]
        ax[i] = x - w2 * bodies.reach[i] * pose.cos[i]
        ay[i] = y - w2 * bodies.reach[i] * pose.sin[i]
        x -= w2 * bodies.length[i] * pose.cos[i]
        y -= w2 * bodies.length[i] * pose.sin[i]


@kernel
def generalise(
    lo: int, bodies: Bodies, pose: Pose, fx: Array, fy: Array, torque: Array, out: Array
) -> None:
    """Generalised forces (n + 2,) of forces at the centres [N] and torques about them [N·m]."""
    n = bodies.mass.size
    sx, sy = 0.0, 0.0
    for i in range(n - 1, lo - 1, -1):
        c, s = pose.cos[i], pose.sin[i]
        out[i] = (
            torque[i]
            + bodies.reach[i] * (c * fy[i] - s * fx[i])
            + bodies.length[i] * (c * sy - s * sx)
        )
        sx += fx[i]
        sy += fy[i]
    out[n] = sx
    out[n + 1] = sy


@kernel
def factor(lo: int, bodies: Bodies, pose: Pose, art: Array) -> None:
    """Sweep from tip to root; ``art`` (n, 6) keeps 1/D, h (2) and P (xx, xy, yy).

    Row i holds P as seen from the inner hinge of component i.
    """
    pxx, pxy, pyy = 0.0, 0.0, 0.0
    for i in range(bodies.mass.size - 1, lo - 1, -1):
        c, s = pose.cos[i], pose.sin[i]
        m, r, d = bodies.mass[i], bodies.reach[i], bodies.length[i]
        vx, vy = -d * s, d * c
        gx = pxx * vx + pxy * vy
        gy = pxy * vx + pyy * vy
        inverse = 1.0 / (bodies.inertia[i] + m * r * r + vx * gx + vy * gy)
        hx = gx - m * r * s
        hy = gy + m * r * c
        pxx += m - hx * hx * inverse
        pxy -= hx * hy * inverse
        pyy += m - hy * hy * inverse
        art[i, 0] = inverse
        art[i, 1] = hx
        art[i, 2] = hy
        art[i, 3] = pxx
        art[i, 4] = pxy
        art[i, 5] = pyy


@kernel
def solve(
    lo: int, bodies: Bodies, pose: Pose, art: Array, free: bool, force: Array, out: Array
) -> None:
    """Solve M(φ) a = Q for generalised forces ``force`` (n + 2,); ``out`` may be ``force``.

    Unless ``free``, the base follows its own law and does not accelerate here. The same solve
    turns impulses into changes of velocity.
    """
    n = bodies.mass.size
    px, py = 0.0, 0.0
    for i in range(n - 1, lo - 1, -1):
        d = bodies.length[i]
        k = (force[i] - d * (pose.cos[i] * py - pose.sin[i] * px)) * art[i, 0]
        out[i] = k
        px += art[i, 1] * k
        py += art[i, 2] * k
    ax, ay = 0.0, 0.0
    if free:
        # Nothing but the base's own force acts on the innermost hinge: P a + p = force.
        bx = force[n] - px
        by = force[n + 1] - py
        det = art[lo, 3] * art[lo, 5] - art[lo, 4] * art[lo, 4]
        ax = (art[lo, 5] * bx - art[lo, 4] * by) / det
        ay = (art[lo, 3] * by - art[lo, 4] * bx) / det
    out[n] = ax
    out[n + 1] = ay
    for i in range(lo, n):
        w = out[i] - (art[i, 1] * ax + art[i, 2] * ay) * art[i, 0]
        out[i] = w
        ax -= bodies.length[i] * pose.sin[i] * w
        ay += bodies.length[i] * pose.cos[i] * w
