"""Moreau's time-stepping, for phases in which squares touch or stops rattle.

One step, after Moreau and Jean, has two halves. The velocity nearest to the free one, in the
metric of the mass matrix, that lets no gap become negative and leaves at rest what friction holds,
leads over the first half to a middle position. Forces, masses and gaps are taken anew there, and
the velocity found again; it leads over the second half and stays. Impacts, simultaneous ones too,
take place inside steps, and nothing has to be located. The momentum of a free chain is kept apart
from all this: only forces from outside change it.
"""

from __future__ import annotations

import math

from magfold_env.engine import chain, contact
from magfold_env.engine.arrays import copy
from magfold_env.engine.complementarity import solve_nonnegative
from magfold_env.engine.constraints import first_joint, hold_joints, open_joints
from magfold_env.engine.dynamics import (
    apply_multipliers,
    rate_of,
    respond,
    smooth_accelerations,
    unconstrained,
)
from magfold_env.engine.feed import is_free, place_all
from magfold_env.engine.friction import friction_rows
from magfold_env.engine.jit import inlined, kernel, merged
from magfold_env.engine.outcomes import BROKEN, TOO_SHORT, TOUCHED
from magfold_env.engine.recorder import record_line
from magfold_env.engine.state import (
    BRAKE,
    EVALUATIONS,
    LO,
    STEP,
    STEPS,
    TIME,
    Array,
    Model,
    Record,
    State,
    Work,
)

FINEST = 10.0  # shortest step: tolerances of a typical rate
COARSEST = 0.01  # [s]
SHARE = 0.05  # of the tolerance, that a step's change of velocity may move an angle by
PUSH_OUT = 0.2  # share of an overlap that one step takes back


@kernel
def moreau_step(model: Model, state: State, work: Work, record: Record, until: float) -> int:
    """Take one step from the state, whose pose and forces are in ``work``.

    It is repeated at half its length until the velocity changes little, but not below what an
    impact, which changes it at once, would ask for.
    """
    lo, n = state.counter[LO], model.n
    unconstrained(lo, model, work, work.smooth)
    state.counter[STEPS] += 1
    remaining = until - state.clock[TIME]
    finest = FINEST * model.tolerance / model.rate_scale
    # Friction turns around when a component stops: no step goes far beyond.
    h = min(max(1.5 * state.clock[STEP], finest), COARSEST, max(state.clock[BRAKE], 0.1 * finest))
    while True:
        last = h >= remaining
        h = min(h, remaining)
        if not velocity_after(model, state, work, h):
            return TOO_SHORT
        moved = 0.0
        for k in range(lo, n):
            moved = max(moved, 0.5 * h * abs(work.new_v[k] - state.v[k]))
        if not math.isfinite(moved):
            return BROKEN
        if moved <= SHARE * model.tolerance or h <= finest:
            break
        h = max(0.5 * h, finest)
    state.clock[STEP] = h
    for k in range(n + 2):
        work.new_q[k] = work.stage_q[k]
        if k >= lo:
            work.new_q[k] += 0.5 * h * work.new_v[k]
    record_line(record, state, work, h)
    copy(work.new_q, state.q, lo)
    copy(work.new_v, state.v, lo)
    state.clock[TIME] = until if last else state.clock[TIME] + h
    # A joint that lands on its stop keeps its speed until the next step's impact takes it.
    open_joints(lo, model, state)
    for i in range(lo, n):
        if state.stuck[i] == 1:
            state.v[i] = 0.0
    hold_joints(lo, model, state.lock, state.q, state.v)
    return TOUCHED


@merged
def velocity_after(model: Model, state: State, work: Work, h: float) -> bool:
    """Middle of a step of length ``h`` into ``work.stage_q``, its new velocity into ``work.new_v``.

    Returns False if it could not be found. Needs the smooth accelerations of the state in
    ``work.smooth``.
    """
    lo, n = state.counter[LO], model.n
    # A repeated step finds the middle's pose and inertias; put the state's back.
    place_all(lo, model, state.q, work.pose)
    chain.factor(lo, model.bodies, work.pose, work.open, work.art)
    if not constrain(model, state, state.q, work.smooth, work, h, h):
        return False
    copy(state.q, work.stage_q, 0)
    copy(state.v, work.stage_v, 0)
    for k in range(lo, n + 2):
        work.stage_q[k] += 0.5 * h * work.new_v[k]
        work.stage_v[k] = 0.5 * (state.v[k] + work.new_v[k])
    state.counter[EVALUATIONS] += 1
    middle = work.slope_v[1]
    smooth_accelerations(lo, model, work.stage_q, work.stage_v, work, middle)
    push_x, push_y = outer_force(lo, model, work)
    if not constrain(model, state, work.stage_q, middle, work, h, 0.5 * h):
        return False
    if is_free(lo, model) and not held_or_walled(model, state, work):
        keep_momentum(model, state, work, h, h * push_x, h * push_y)
    return True


@merged
def outer_force(lo: int, model: Model, work: Work) -> tuple[float, float]:
    """Friction and gravity on the whole chain [N], after `smooth_accelerations`."""
    n = model.n
    x, y = work.force[n], work.force[n + 1]
    for i in range(lo, n):
        x += model.bodies.mass[i] * work.ax[i]
        y += model.bodies.mass[i] * work.ay[i]
    return x, y


@merged
def held_or_walled(model: Model, state: State, work: Work) -> bool:
    """Whether something else from outside acts: friction that holds, or a wall."""
    for i in range(model.n):
        if state.stuck[i] == 1:
            return True
    for r in range(work.row_count[0], work.row_count[1]):
        if work.row_id[r, 1] >= model.n or work.row_id[r, 0] >= model.n:
            return True
    return False


@merged
def keep_momentum(
    model: Model, state: State, work: Work, h: float, push_x: float, push_y: float
) -> None:
    """Shift the new base velocity so that only the outer impulse [N·s] changed the momentum.

    All else in the step acts between components; their rotation during it, if velocities jump,
    would else leave a trace of first order.
    """
    n, lo, mass = model.n, state.counter[LO], 0.0
    before_x, before_y = momentum(lo, model, state.q, state.v, work)
    for k in range(n + 2):
        work.slope_q[2, k] = work.stage_q[k] + 0.5 * h * work.new_v[k]
    after_x, after_y = momentum(lo, model, work.slope_q[2], work.new_v, work)
    for i in range(lo, n):
        mass += model.bodies.mass[i]
    work.new_v[n] += (before_x + push_x - after_x) / mass
    work.new_v[n + 1] += (before_y + push_y - after_y) / mass


@kernel
def momentum(lo: int, model: Model, q: Array, v: Array, work: Work) -> tuple[float, float]:
    """Linear momentum [kg m/s] of the free components."""
    chain.place(lo, model.bodies, q, work.pose)
    chain.centre_velocities(lo, model.bodies, work.pose, v, work.vx, work.vy)
    x, y = 0.0, 0.0
    for i in range(lo, model.n):
        x += model.bodies.mass[i] * work.vx[i]
        y += model.bodies.mass[i] * work.vy[i]
    return x, y


@kernel
def constrain(
    model: Model, state: State, q: Array, acceleration: Array, work: Work, h: float, left: float
) -> bool:
    """Velocity after a step ``h`` into ``work.new_v``: the nearest that closes no gap of ``q``.

    ``left`` is the time that the gaps have to last. Needs pose and inertias of ``q``. Returns
    False if it could not be found.
    """
    lo, n = state.counter[LO], model.n
    v = work.new_v
    copy(state.v, v, 0)
    for k in range(lo, n + 2):
        v[k] += h * acceleration[k]
    rows = collect_within(lo, model, q, work, v, left)
    if rows < 0:
        return False
    count = rows
    work.row_count[1] = rows
    work.row_count[2] = 0
    for i in range(lo, n):
        if state.stuck[i] == 1:
            if count + 3 > work.bias.size:
                return False
            friction_rows(lo, model, work.pose, work, count, i)
            count += 3
    respond(lo, model, work, 0, count)
    for r in range(count):
        gap = work.bias[r] if r < rows else 0.0
        work.bias[r] = gap + rate_of(lo, work, r, v)
        work.equality[r] = 0 if r < rows else 1
        work.passive[r] = 1
    solved = solve_nonnegative(count, work)
    apply_multipliers(lo, count, work, v)
    return solved


@inlined
def allowance(gap: float, time: float) -> float:
    """Return the closing velocity that a gap allows; overlaps are taken back gently."""
    return gap / time if gap >= 0.0 else PUSH_OUT * gap / time


@merged
def collect_within(lo: int, model: Model, q: Array, work: Work, v: Array, h: float) -> int:
    """Rows of all gaps that could close within the step, their allowances in ``work.bias``.

    Returns their number, −1 if there is no room.
    """
    row = 0
    for k in range(first_joint(lo), model.n):
        angle = q[k] - q[k - 1]
        rate = v[k] - (v[k - 1] if k > lo else 0.0)
        for sign in (-1, 1):
            gap = contact.HALF_PI - sign * angle
            if gap - sign * rate * h < REACH * abs(rate) * h + 1e-6:
                contact.stop_row(lo, model, work, row, k, sign)
                work.bias[row] = allowance(gap, h)
                row += 1
    work.row_count[0] = row
    contact.place_boxes(max(lo - 1, 0), model, work.pose, work)
    fastest = 0.0
    for i in range(lo, model.n):
        fastest = max(fastest, math.sqrt(work.vx[i] ** 2 + work.vy[i] ** 2))
        fastest = max(fastest, abs(v[i]) * model.side)
    near = 4.0 * fastest * h + contact.TOUCH * model.side
    for i in range(max(lo - 1, 0), model.n):
        j = contact.next_partner(model, lo, i, i)
        while j < model.n + 2:
            if contact.may_touch(model, work, i, j):
                for c in range(8):
                    box, other = (i, j) if c < 4 else (j, i)
                    gap = contact.corner_gap(model, work, box, other, c % 4)
                    if gap < near:
                        if row >= work.bias.size:
                            return -1
                        work.row_id[row, 0] = box
                        work.row_id[row, 1] = other
                        work.row_id[row, 2] = c % 4
                        contact.contact_row(lo, model, work.pose, work, row, v)
                        work.bias[row] = allowance(gap, h)
                        row += 1
            j = contact.next_partner(model, lo, i, j)
    return row


REACH = 1.0  # how much faster than the trial velocity a joint may turn after the projection
