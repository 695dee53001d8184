"""Coulomb friction with the floor: the associated law on the ellipsoid in (vx, vy, c·ω).

c is the friction radius. The friction on a released component that moves with S = |(vx, vy, c ω)| >
0 is −µ m g (vx, vy, c² ω) / S. On a component at rest, it prevents motion as long as |(fx, fy,
τ/c)| ≤ µ m g; a complementarity problem finds this force together with the accelerations.
"""

import math

from magfold_env.engine.chain import articulated
from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.elementary import square
from magfold_env.engine.state import Array, Model, Pose, State, Work

AT_REST = 1e-13  # [m/s] slower motion is rounding error
ALONG = 1e-20  # smaller sines are rounding errors too


@inlined
def speed(model: Model, work: Work, v: Array, i: int) -> float:
    """Return S of component i [m/s], from the centres' velocities in ``work``."""
    spin = model.friction_radius * v[i]
    return math.sqrt(square(work.centres.vx[i]) + square(work.centres.vy[i]) + spin * spin)


@kernel
def find_velocities(lo: int, model: Model, state: State, work: Work) -> None:
    """Compute the pose of the free components and the velocities of their centres."""
    centres = work.centres
    articulated.place(lo, model.bodies, state.q, work.pose)
    articulated.centre_velocities(lo, model.bodies, work.pose, state.v, centres.vx, centres.vy)


@inlined
def size_of(force: Array, r: int) -> float:
    """Return the size of the friction force in rows r to r + 2."""
    return math.sqrt(square(force[r]) + square(force[r + 1]) + square(force[r + 2]))


@inlined
def add_sliding(lo: int, model: Model, v: Array, work: Work) -> None:
    """Add the friction of the moving components to ``work.loads``.

    Components in ``work.friction.slow`` are omitted, because a solver finds their friction.
    """
    for i in range(lo, model.n):
        s = speed(model, work, v, i)
        if s > AT_REST and work.friction.slow[i] == 0:
            f = model.friction_limit[i] / s
            work.loads.fx[i] -= f * work.centres.vx[i]
            work.loads.fy[i] -= f * work.centres.vy[i]
            work.loads.torque[i] -= f * model.friction_radius * model.friction_radius * v[i]


@inlined
def slide_of(model: Model, work: Work, v: Array, i: int) -> float:
    """Return how far component i would slide if only friction slowed it down [m]."""
    s = speed(model, work, v, i)
    return s * s * model.bodies.mass[i] / (2.0 * max(model.friction_limit[i], 1e-300))


@inlined
def above_rounding(part: float) -> float:
    """Return a sine or cosine, or 0 if it is so small that it could only be rounding error.

    Sticking components turn at rates that are only rounding errors. If a row had only such entries,
    arbitrarily large forces could be needed to balance the centripetal acceleration.
    """
    return part if abs(part) > ALONG else 0.0


@kernel
def friction_rows(lo: int, model: Model, pose: Pose, work: Work, r: int, i: int) -> None:
    """Fill in rows r to r + 2 for (vx, vy, c ω) of component i; for the bias see `contact_row`."""
    n = model.n
    for k in range(3):
        work.rows.jacobian[r + k, :] = 0.0
        work.rows.id[r + k, 0] = i
    for k in range(lo, i + 1):
        d = model.bodies.reach[k] if k == i else model.bodies.length[k]
        work.rows.jacobian[r, k] = -d * above_rounding(pose.sin[k])
        work.rows.jacobian[r + 1, k] = d * above_rounding(pose.cos[k])
    work.rows.jacobian[r, n] = 1.0
    work.rows.jacobian[r + 1, n + 1] = 1.0
    work.rows.jacobian[r + 2, i] = model.friction_radius
    work.rows.bias[r] = work.centres.ax[i]
    work.rows.bias[r + 1] = work.centres.ay[i]
    work.rows.bias[r + 2] = 0.0
