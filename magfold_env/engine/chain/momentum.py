"""The momentum of a free chain, which only forces from outside change."""

from magfold_env.engine import entries as at
from magfold_env.engine.chain import articulated
from magfold_env.engine.chain.feed import is_free
from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.state import Array, Model, State, Work


@inlined
def drop_inertia(lo: int, model: Model, work: Work) -> None:
    """Leave the forces themselves in the loads, after `smooth_accelerations`."""
    for i in range(lo, model.n):
        work.loads.fx[i] += model.bodies.mass[i] * work.centres.ax[i]
        work.loads.fy[i] += model.bodies.mass[i] * work.centres.ay[i]


@kernel
def outer_force(lo: int, model: Model, work: Work) -> tuple[float, float, float]:
    """Friction and gravity on the whole chain, of loads without inertial forces.

    Returns their sum [N] and their torque about the centre of mass [N·m]; what the magnets do to
    each other cancels in both.
    """
    x, y, twist = 0.0, 0.0, 0.0
    centre_x, centre_y, _ = centre_of_mass(lo, model, work)
    for i in range(lo, model.n):
        fx, fy = work.loads.fx[i], work.loads.fy[i]
        x += fx
        y += fy
        twist += (work.pose.x[i] - centre_x) * fy - (work.pose.y[i] - centre_y) * fx
        twist += work.loads.torque[i]
    return x, y, twist


@inlined
def centre_of_mass(lo: int, model: Model, work: Work) -> tuple[float, float, float]:
    """Centre of mass [m] of the free components, and their mass [kg]."""
    x, y, mass = 0.0, 0.0, 0.0
    for i in range(lo, model.n):
        m = model.bodies.mass[i]
        x += m * work.pose.x[i]
        y += m * work.pose.y[i]
        mass += m
    return x / mass, y / mass, mass


@kernel
def held_or_walled(model: Model, work: Work) -> bool:
    """Whether something else from outside acts: friction that is solved for, or a wall."""
    for i in range(model.n):
        if work.friction.slow[i] == 1:
            return True
    for r in range(work.rows.counts[at.JOINT_STOPS], work.rows.counts[at.CONTACTS]):
        if work.rows.id[r, 1] >= model.n or work.rows.id[r, 0] >= model.n:
            return True
    return False


@inlined
def keep_if_left_alone(
    model: Model, state: State, work: Work, end: Array, velocity: Array, time: float
) -> None:
    """As `keep_momentum` if nothing from outside acts but gravity, for so long."""
    lo = state.counter[at.LO]
    if model.frictional or model.field.present or not is_free(lo, model):
        return
    if held_or_walled(model, work):
        return
    push = 0.0
    for i in range(lo, model.n):
        push += model.bodies.mass[i] * time
    push_x, push_y = push * model.gravity_x, push * model.gravity_y
    keep_momentum(model, state, work, end, velocity, push_x, push_y, 0.0)


@kernel
def keep_momentum(
    model: Model, state: State, work: Work, end: Array, velocity: Array,
    push_x: float, push_y: float, twist: float,
) -> None:  # fmt: skip
    """Move the new ``velocity`` so that only the outer impulses [N·s, N·m·s] changed the momenta.

    All else in the step acts between components, and ``end`` is where it ends. The base may be a
    light component that moves fast: the least of its errors carries a heavy one away. Where
    velocities jump, the rotation during the step would leave a trace of first order. The chain is
    moved as one rigid body, so no gap closes faster or slower.
    """
    n, lo = model.n, state.counter[at.LO]
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
    """Linear momentum [kg m/s] of the free components, and angular [kg m²/s] about their centre.

    And their moment of inertia about it [kg m²]. Leaves the pose of ``q`` in ``work``.
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
