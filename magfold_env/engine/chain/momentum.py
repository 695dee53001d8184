"""Momenta and kinetic energy of a chain, and instantaneous changes of its velocities.

Only external forces change the momenta of a free chain.
"""

from magfold_env.engine import indices as ix
from magfold_env.engine.chain import articulated
from magfold_env.engine.chain.tube import is_free, place_all
from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.elementary import square
from magfold_env.engine.state import Array, Model, State, Work


@kernel
def kinetic_of(lo: int, model: Model, work: Work, q: Array, v: Array) -> float:
    """Return the kinetic energy [J] for coordinates and velocities; also fill in the pose."""
    place_all(lo, model, q, work.pose)
    energy = energy_outside(lo, model, work, v)
    for i in range(lo):
        energy += 0.5 * model.bodies.mass[i] * (square(v[model.n]) + square(v[model.n + 1]))
    return energy


@kernel
def energy_outside(lo: int, model: Model, work: Work, v: Array) -> float:
    """Return the free components' kinetic energy [J] at the known pose; overwrite the loads."""
    bodies, vx, vy, energy = model.bodies, work.loads.fx, work.loads.fy, 0.0
    articulated.centre_velocities(lo, bodies, work.pose, v, vx, vy)
    for i in range(lo, model.n):
        energy += bodies.mass[i] * (square(vx[i]) + square(vy[i])) + bodies.inertia[i] * square(
            v[i]
        )
    return 0.5 * energy


@inlined
def momentum_along(lo: int, model: Model, work: Work, v: Array) -> float:
    """Return the momentum of the free components along the tube [N·s] at the known pose."""
    bodies, pose = model.bodies, work.pose
    total, hinge = 0.0, v[model.n]
    for i in range(lo, model.n):
        total += bodies.mass[i] * (hinge - bodies.reach[i] * pose.sin[i] * v[i])
        hinge -= bodies.length[i] * pose.sin[i] * v[i]
    return total


@kernel
def kinetic(lo: int, model: Model, state: State, work: Work) -> tuple[float, float]:
    """Return the chain's kinetic energy [J] and momentum along the tube [N·s]; fill in the pose."""
    energy = kinetic_of(lo, model, work, state.q, state.v)
    along = momentum_along(lo, model, work, state.v)
    for i in range(lo):
        along += model.bodies.mass[i] * state.v[model.n]
    return energy, along


@kernel
def spread(
    lo: int, model: Model, state: State, work: Work, x: float, y: float, base: float
) -> None:
    """Change each free component's velocity by (x, y) [m/s], as far as the hinges allow.

    The chain gets the nearest velocity that its hinges allow, in the metric of the mass matrix.
    ``base`` is the base's mass (see `articulated.solve`). The pose must be known.
    """
    bodies, pose, chain, force = model.bodies, work.pose, work.chain, work.chain.force
    for i in range(lo, model.n):
        work.loads.fx[i] = bodies.mass[i] * x
        work.loads.fy[i] = bodies.mass[i] * y
        work.loads.torque[i] = 0.0
    articulated.generalise(lo, bodies, pose, work.loads, force)
    articulated.factor(lo, bodies, pose, chain.unlocked, chain)
    articulated.solve(lo, bodies, pose, chain.unlocked, base, force, force, chain)
    for k in range(lo, model.n + 2):
        state.v[k] += force[k]


@kernel
def outer_force(lo: int, model: Model, work: Work) -> tuple[float, float, float]:
    """Return friction and gravity on the whole chain; call it after `smooth_accelerations`.

    The result is their sum [N] and their torque about the centre of mass [N·m]; the magnets' mutual
    forces cancel in both. The loads then hold all forces except those of inertia.
    """
    x, y, twist = 0.0, 0.0, 0.0
    centre_x, centre_y, _ = centre_of_mass(lo, model, work)
    for i in range(lo, model.n):
        work.loads.fx[i] += model.bodies.mass[i] * work.centres.ax[i]
        work.loads.fy[i] += model.bodies.mass[i] * work.centres.ay[i]
        fx, fy = work.loads.fx[i], work.loads.fy[i]
        x += fx
        y += fy
        twist += (work.pose.x[i] - centre_x) * fy - (work.pose.y[i] - centre_y) * fx
        twist += work.loads.torque[i]
    return x, y, twist


@inlined
def centre_of_mass(lo: int, model: Model, work: Work) -> tuple[float, float, float]:
    """Return the centre of mass [m] of the free components, and their mass [kg]."""
    x, y, mass = 0.0, 0.0, 0.0
    for i in range(lo, model.n):
        m = model.bodies.mass[i]
        x += m * work.pose.x[i]
        y += m * work.pose.y[i]
        mass += m
    return x / mass, y / mass, mass


@kernel
def held_or_walled(model: Model, work: Work) -> bool:
    """Whether friction that is solved for, or a wall, may exert a force on the chain."""
    for i in range(model.n):
        if work.friction.slow[i] == 1:
            return True
    for r in range(work.rows.counts[ix.JOINT_STOPS], work.rows.counts[ix.CONTACTS]):
        if work.rows.id[r, 1] >= model.n or work.rows.id[r, 0] >= model.n:
            return True
    return False


@inlined
def keep_if_left_alone(
    model: Model, state: State, work: Work, end: Array, velocity: Array, time: float
) -> None:
    """Call `keep_momentum` if gravity is the only external force during ``time`` [s]."""
    if model.frictional or model.field.present or not is_free(state.counter[ix.N_HELD], model):
        return
    push = 0.0
    for i in range(model.n):
        push += model.bodies.mass[i] * time
    push_x, push_y = push * model.gravity_x, push * model.gravity_y
    keep_momentum(model, state, work, end, velocity, push_x, push_y, 0.0)


@kernel
def keep_momentum(
    model: Model, state: State, work: Work, end: Array, velocity: Array,
    push_x: float, push_y: float, twist: float,
) -> None:  # fmt: skip
    """Correct the new ``velocity`` so that only external impulses [N·s, N·m·s] change the momenta.

    All other forces act between components. ``end`` holds the coordinates at the step's end.
    Without the correction, the smallest errors of a light, fast component at the base would carry a
    heavy one away, and jumps of the velocities would leave a first-order error. The correction is a
    rigid motion of the chain, so it does not change the rate of any gap.
    """
    n, lo = model.n, state.counter[ix.N_HELD]
    if not is_free(lo, model) or held_or_walled(model, work):
        return
    before_x, before_y, before, _ = momentum(lo, model, state.q, state.v, work)
    after_x, after_y, after, inertia = momentum(lo, model, end, velocity, work)
    x, y, mass = centre_of_mass(lo, model, work)
    spin = (before + twist - after) / inertia
    for k in range(lo, n):
        velocity[k] += spin
    velocity[n] += (before_x + push_x - after_x) / mass - spin * (end[n + 1] - y)
    velocity[n + 1] += (before_y + push_y - after_y) / mass + spin * (end[n] - x)


@kernel
def momentum(
    lo: int, model: Model, q: Array, v: Array, work: Work
) -> tuple[float, float, float, float]:
    """Return the free components' momentum [kg m/s] and angular momentum [kg m²/s].

    The latter is about their centre of mass. Also returns their moment of inertia about it [kg m²],
    and leaves the pose of ``q`` in ``work``.
    """
    bodies, pose = model.bodies, work.pose
    articulated.place(lo, bodies, q, pose)
    articulated.centre_velocities(lo, bodies, pose, v, work.centres.vx, work.centres.vy)
    centre_x, centre_y, _ = centre_of_mass(lo, model, work)
    x, y, angular, inertia = 0.0, 0.0, 0.0, 0.0
    for i in range(lo, model.n):
        m, dx, dy = bodies.mass[i], pose.x[i] - centre_x, pose.y[i] - centre_y
        x += m * work.centres.vx[i]
        y += m * work.centres.vy[i]
        angular += (
            m * (dx * work.centres.vy[i] - dy * work.centres.vx[i]) + bodies.inertia[i] * v[i]
        )
        inertia += m * (dx * dx + dy * dy) + bodies.inertia[i]
    return x, y, angular, inertia
