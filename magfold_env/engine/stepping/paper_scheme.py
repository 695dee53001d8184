"""The paper's own scheme, for reproduction: double Euler, snapping joints, kinetic friction.

Equations 39 to 41 and Figure 9 of the paper. Only neighbours collide, by having their angle set;
friction acts on the centres, has no torque and no static part; 0/0 in equation 41 is taken as 0.
Component 1 is pinned.
"""

from __future__ import annotations

import math

from magfold_env.engine.arrays import copy
from magfold_env.engine.chain import articulated
from magfold_env.engine.compile.jit import kernel
from magfold_env.engine.magnets.outer_field import add_magnet_forces
from magfold_env.engine.outcomes import CAPPED, FULL, NOT_FINITE, REACHED, RESTED
from magfold_env.engine.state import (
    EVALUATIONS,
    STEPS,
    TIME,
    Array,
    Model,
    Record,
    State,
    Work,
)
from magfold_env.engine.stepping.recorder import record_instant
from magfold_env.engine.work_cap import out_of_work

SNAP = 0.9 * math.pi / 2.0  # equation 40
QUIET_TIME = 0.1  # [s] a chain that turned by less than QUIET_ANGLE in it is at rest
QUIET_ANGLE = 1e-3  # [rad]


@kernel
def paper_advance(
    model: Model, state: State, work: Work, record: Record, until: float, dt: float
) -> int:
    """Step to the time ``until`` [s] or to rest; returns which.

    The scheme itself knows no rest: the chain rests when all joints have snapped, or when no
    heading changed by more than `QUIET_ANGLE` within `QUIET_TIME`.
    """
    n = model.n
    # new_q keeps the headings of the last look, new_v[0] its time.
    if state.counter[STEPS] == 0:
        copy(state.q, work.new_q, 0)
        work.new_v[0] = 0.0
    while state.clock[TIME] < until:
        if out_of_work(model, state):
            return CAPPED
        if not record_instant(record, state):
            return FULL
        evaluate(model, state, work)
        for i in range(n):
            rate = state.v[i] + dt * work.force[i]
            if not math.isfinite(state.q[i] + dt * rate):
                return NOT_FINITE
            state.v[i] = rate
            state.q[i] += dt * rate
        snapped = snap(n, state.q, state.v)
        state.counter[STEPS] += 1
        state.clock[TIME] = state.counter[STEPS] * dt
        if snapped == n - 1 and n > 1:
            return RESTED
        if state.clock[TIME] - work.new_v[0] >= QUIET_TIME:
            turned = 0.0
            for i in range(n):
                turned = max(turned, abs(state.q[i] - work.new_q[i]))
            if turned < QUIET_ANGLE:
                return RESTED
            copy(state.q, work.new_q, 0)
            work.new_v[0] = state.clock[TIME]
    return REACHED


@kernel
def evaluate(model: Model, state: State, work: Work) -> None:
    """Angular accelerations of equation 39 into ``work.force``, friction after equation 41."""
    bodies, pose = model.bodies, work.pose
    state.counter[EVALUATIONS] += 1
    articulated.place(0, bodies, state.q, pose)
    articulated.centre_velocities(0, bodies, pose, state.v, work.vx, work.vy)
    articulated.centripetal(0, bodies, pose, state.v, work.ax, work.ay)
    for i in range(model.n):
        m = bodies.mass[i]
        work.fx[i] = m * (model.gravity_x - work.ax[i])
        work.fy[i] = m * (model.gravity_y - work.ay[i])
        work.torque[i] = 0.0
        speed = math.hypot(work.vx[i], work.vy[i])
        if speed > 0.0:
            work.fx[i] -= model.grip[i] * work.vx[i] / speed
            work.fy[i] -= model.grip[i] * work.vy[i] / speed
    if model.magnetic:
        add_magnet_forces(0, model, pose, work.nodes, work.fx, work.fy, work.torque)
    articulated.generalise(0, bodies, pose, work.fx, work.fy, work.torque, work.force)
    articulated.factor(0, bodies, pose, work.open, work.art)
    articulated.solve(
        0, bodies, pose, work.open, work.art, False, work.force, work.force, work.hold
    )


@kernel
def snap(n: int, q: Array, v: Array) -> int:
    """Set joints past 81° to 90° and average the two rates; returns how many there were."""
    snapped = 0
    for i in range(1, n):
        angle = q[i] - q[i - 1]
        if abs(angle) > SNAP:
            q[i] = q[i - 1] + math.copysign(math.pi / 2.0, angle)
            mean = 0.5 * (v[i] + v[i - 1])
            v[i] = mean
            v[i - 1] = mean
            snapped += 1
    return snapped
