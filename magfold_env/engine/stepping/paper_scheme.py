"""The paper's scheme, for reproducing its results: double Euler, snapping joints, kinetic friction.

It consists of equations 39 to 41 and Figure 9 of the paper. Only neighbours collide; the angle of
their joint is then set to 90°. Friction acts on the centres, without torque or a static part; 0/0
in equation 41 counts as 0. Component 1 is pinned.
"""

import math

from magfold_env.engine import indices as ix
from magfold_env.engine import outcomes
from magfold_env.engine.chain import articulated
from magfold_env.engine.compile.jit import kernel
from magfold_env.engine.magnets.outer_field import add_magnet_forces
from magfold_env.engine.state import Model, Record, State, Work, copy
from magfold_env.engine.stepping.recorder import record_instant

SNAP = 0.9 * math.pi / 2.0  # equation 40
QUIET_TIME = 0.1  # [s] a chain that turns by less than QUIET_ANGLE in this time is at rest
QUIET_ANGLE = 1e-3  # [rad]


@kernel
def paper_advance(
    model: Model, state: State, work: Work, record: Record, until: float, dt: float
) -> int:
    """Step to the time ``until`` [s] or to rest; return the outcome, or PAUSED like `runs.run`.

    The scheme itself does not define rest; here, the chain counts as at rest when all joints have
    snapped, or when no heading has changed by more than `QUIET_ANGLE` within `QUIET_TIME`.
    """
    n = model.n
    # new_q stores the headings at the last check for rest, and new_v[0] stores its time.
    if state.counter[ix.STEPS] == 0:
        copy(state.q, work.stages.new_q, 0)
        work.stages.new_v[0] = 0.0
    turn = outcomes.end_of_turn(model, state)
    while state.clock[ix.TIME] < until:
        if outcomes.out_of_work(model, state):
            return outcomes.CAPPED
        if state.counter[ix.EVALUATIONS] >= turn or not record_instant(record, state):
            return outcomes.PAUSED
        evaluate(model, state, work)
        for i in range(n):
            rate = state.v[i] + dt * work.chain.force[i]
            if not math.isfinite(state.q[i] + dt * rate):
                return outcomes.NOT_FINITE
            state.v[i] = rate
            state.q[i] += dt * rate
        snapped = snap(n, state)
        state.counter[ix.STEPS] += 1
        state.clock[ix.TIME] = state.counter[ix.STEPS] * dt
        if snapped == n - 1 and n > 1:
            return outcomes.RESTED
        if state.clock[ix.TIME] - work.stages.new_v[0] >= QUIET_TIME:
            turned = 0.0
            for i in range(n):
                turned = max(turned, abs(state.q[i] - work.stages.new_q[i]))
            if turned < QUIET_ANGLE:
                return outcomes.RESTED
            copy(state.q, work.stages.new_q, 0)
            work.stages.new_v[0] = state.clock[ix.TIME]
    return outcomes.REACHED


@kernel
def evaluate(model: Model, state: State, work: Work) -> None:
    """Find the angular accelerations of equation 39, with friction by equation 41."""
    bodies, pose = model.bodies, work.pose
    state.counter[ix.EVALUATIONS] += 1
    articulated.place(0, bodies, state.q, pose)
    articulated.centre_motion(0, bodies, pose, state.v, work.centres)
    for i in range(model.n):
        m = bodies.mass[i]
        work.loads.fx[i] = m * (model.gravity_x - work.centres.ax[i])
        work.loads.fy[i] = m * (model.gravity_y - work.centres.ay[i])
        work.loads.torque[i] = 0.0
        vx, vy = work.centres.vx[i], work.centres.vy[i]
        speed = math.sqrt(vx * vx + vy * vy)
        if speed > 0.0:
            work.loads.fx[i] -= model.friction_limit[i] * work.centres.vx[i] / speed
            work.loads.fy[i] -= model.friction_limit[i] * work.centres.vy[i] / speed
    if model.magnetic:
        add_magnet_forces(0, model, pose, work.nodes, work.loads)
    chain, force = work.chain, work.chain.force
    articulated.generalise(0, bodies, pose, work.loads, force)
    articulated.factor(0, bodies, pose, chain.unlocked, chain)
    articulated.solve(0, bodies, pose, chain.unlocked, articulated.DRIVEN, force, force, chain)


@kernel
def snap(n: int, state: State) -> int:
    """Set joints past 81° to 90° and average the two rates; return the number of snapped joints."""
    q, v, snapped = state.q, state.v, 0
    for i in range(1, n):
        angle = q[i] - q[i - 1]
        if abs(angle) > SNAP:
            q[i] = q[i - 1] + math.copysign(math.pi / 2.0, angle)
            mean = 0.5 * (v[i] + v[i - 1])
            v[i] = mean
            v[i - 1] = mean
            snapped += 1
    return snapped
