"""Decide whether a chain that continues to move as one body may still meet a solid."""

import math

from magfold_env.engine import indices as ix
from magfold_env.engine.chain.momentum import kinetic_of
from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.contact.boxes import seen_from
from magfold_env.engine.elementary import square
from magfold_env.engine.friction.law import find_velocities
from magfold_env.engine.state import Model, State, Work


@kernel
def may_meet_solid(model: Model, state: State, work: Work) -> bool:
    """Whether a chain whose joint angles stay constant may reach a solid.

    The answer is not a forecast: in case of doubt, it is True. No component may be in a tube.
    """
    if model.obstacles.shape[0] == 0:
        return False
    find_velocities(0, model, state, work)
    if model.pinned:
        # The chain turns about its pin.
        x, y = state.q[model.n], state.q[model.n + 1]
        return solid_within(model, x, y, radius_about(model, work, x, y))
    slowing = math.inf
    for i in range(model.n):
        slowing = min(slowing, model.friction_limit[i] / model.bodies.mass[i])
    slowing -= math.sqrt(square(model.gravity_x) + square(model.gravity_y))
    if model.frictional and slowing > 0.0:
        return meets_while_stopping(model, state, work, slowing)
    return meets_in_flight(model, work)


@inlined
def solid_within(model: Model, x: float, y: float, reach: float) -> bool:
    """Whether any solid is at most ``reach`` [m] from a point."""
    for k in range(model.obstacles.shape[0]):
        solid = model.obstacles[k]
        u, v = seen_from(solid[ix.C], solid[ix.S], x - solid[ix.X], y - solid[ix.Y])
        along = max(abs(u) - solid[ix.A] - solid[ix.RADIUS], 0.0)
        across = max(abs(v) - solid[ix.B] - solid[ix.RADIUS], 0.0)
        if math.sqrt(square(along) + square(across)) <= reach:
            return True
    return False


@inlined
def radius_about(model: Model, work: Work, x: float, y: float) -> float:
    """Return the radius with which a circle about a point contains the whole chain [m]."""
    pose, away = work.pose, 0.0
    for i in range(model.n):
        away = max(away, math.sqrt(square(pose.x[i] - x) + square(pose.y[i] - y)))
    return away + 0.5 * model.bodies.length[0]


@inlined
def centre_of_mass(model: Model, work: Work) -> tuple[float, float, float, float]:
    """Return the position [m] and velocity [m/s] of a free chain's centre of mass."""
    bodies, pose, centres = model.bodies, work.pose, work.centres
    x, y, vx, vy, mass = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(model.n):
        m = bodies.mass[i]
        x, y, mass = x + m * pose.x[i], y + m * pose.y[i], mass + m
        vx, vy = vx + m * centres.vx[i], vy + m * centres.vy[i]
    return x / mass, y / mass, vx / mass, vy / mass


@kernel
def meets_while_stopping(model: Model, state: State, work: Work, slowing: float) -> bool:
    """Whether a chain may meet a solid before friction stops it.

    Friction, less gravity, decelerates each component by at least ``slowing`` [m/s²] and thus
    absorbs the kinetic energy over a limited path. The mass-weighted mean of S (see `friction.law`)
    is at least the speed of the centre of mass, and at least the friction radius times the spin.
    """
    pose, energy, mass = work.pose, kinetic_of(0, model, work, state.q, state.v), 0.0
    for i in range(model.n):
        mass += model.bodies.mass[i]
    way = energy / (mass * slowing)
    turn = way / model.friction_radius
    x, y, _, _ = centre_of_mass(model, work)
    for i in range(model.n):
        away = math.sqrt(square(pose.x[i] - x) + square(pose.y[i] - y))
        reach = 0.5 * model.bodies.length[0] + way + turn * away
        if solid_within(model, pose.x[i], pose.y[i], reach):
            return True
    return False


@kernel
def meets_in_flight(model: Model, work: Work) -> bool:
    """Whether a circle around a chain without friction may reach a solid.

    If the chain falls, every solid that is not above its highest point is in its way; without
    gravity, only solids in the circle's straight path are.
    """
    x, y, vx, vy = centre_of_mass(model, work)
    radius = radius_about(model, work, x, y)
    pull = math.sqrt(square(model.gravity_x) + square(model.gravity_y))
    speed = math.sqrt(square(vx) + square(vy))
    # Downward, or the direction in which the chain drifts.
    cx, cy, behind = vx / max(speed, 1e-300), vy / max(speed, 1e-300), radius
    if pull > 0.0:
        cx, cy = model.gravity_x / pull, model.gravity_y / pull
        behind += square(min(vx * cx + vy * cy, 0.0)) / (2.0 * pull)
    elif speed == 0.0:
        return False
    for k in range(model.obstacles.shape[0]):
        solid = model.obstacles[k]
        dx, dy = solid[ix.X] - x, solid[ix.Y] - y
        c, s = seen_from(solid[ix.C], solid[ix.S], cx, cy)
        a, b = solid[ix.A] + solid[ix.RADIUS], solid[ix.B] + solid[ix.RADIUS]
        ahead = dx * cx + dy * cy + a * abs(c) + b * abs(s)
        beside = abs(dx * cy - dy * cx) - a * abs(s) - b * abs(c)
        if ahead >= -behind and (pull > 0.0 or beside <= radius):
            return True
    return False
