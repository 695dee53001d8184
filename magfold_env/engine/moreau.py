"""Moreau's time-stepping, for phases in which squares touch or stops rattle.

One step: the smooth accelerations of its begin give a trial velocity; the velocity of the step is
the one nearest to it, in the metric of the mass matrix, that lets no gap become negative by the
end and leaves at rest what friction holds. Impacts, simultaneous ones too, take place inside
steps, and nothing has to be located.
"""

from __future__ import annotations

import math

from magfold_env.engine import contact
from magfold_env.engine.complementarity import solve_nonnegative
from magfold_env.engine.constraints import first_joint, hold_joints, open_joints
from magfold_env.engine.dynamics import apply_multipliers, rate_of, respond
from magfold_env.engine.friction import friction_rows
from magfold_env.engine.jit import inlined, kernel
from magfold_env.engine.outcomes import BROKEN, TOO_SHORT, TOUCHED
from magfold_env.engine.recorder import record_line
from magfold_env.engine.state import LO, STEP, STEPS, TIME, Array, Model, Record, State, Work

FINEST = 10.0  # shortest step: tolerances of a typical rate
COARSEST = 0.01  # [s]
SHARE = 0.05  # of the tolerance, that a step's change of velocity may move an angle by
PUSH_OUT = 0.2  # share of an overlap that one step takes back


@kernel
def moreau_step(model: Model, state: State, work: Work, record: Record, until: float) -> int:
    """Take one step from the state, whose smooth accelerations are in ``work.smooth``.

    Its length is halved, at no cost in forces, until the velocity changes little, but not below
    what an impact, which changes it at once, would ask for.
    """
    lo, n = state.counter[LO], model.n
    state.counter[STEPS] += 1
    remaining = until - state.clock[TIME]
    finest = FINEST * model.tolerance / model.rate_scale
    h = min(max(2.0 * state.clock[STEP], finest), COARSEST)
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
    work.new_q[:] = state.q
    for k in range(lo, n + 2):
        work.new_q[k] += h * work.new_v[k]
    record_line(record, state, work, h)
    state.q[lo:] = work.new_q[lo:]
    state.v[lo:] = work.new_v[lo:]
    state.clock[TIME] = until if last else state.clock[TIME] + h
    land_joints(lo, model, state)
    open_joints(lo, model, state)
    for i in range(lo, n):
        if state.stuck[i] == 1:
            state.v[i] = 0.0
    hold_joints(lo, model, state.lock, state.q, state.v)
    return TOUCHED


@kernel
def velocity_after(model: Model, state: State, work: Work, h: float) -> bool:
    """Velocity of a step of length ``h`` into ``work.new_v``; False if it could not be found.

    Needs the pose and the articulated inertias of the state, as the accelerations leave them.
    """
    lo, n = state.counter[LO], model.n
    v = work.new_v
    v[:] = state.v
    for k in range(lo, n + 2):
        v[k] += h * work.smooth[k]
    rows = collect_within(lo, model, state, work, v, h)
    if rows < 0:
        return False
    work.row_count[2] = 0
    count = rows
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
def allowance(gap: float, h: float) -> float:
    """Return gap over step, the closing velocity allowed; overlaps are taken back gently."""
    return gap / h if gap >= 0.0 else PUSH_OUT * gap / h


@kernel
def collect_within(lo: int, model: Model, state: State, work: Work, v: Array, h: float) -> int:
    """Rows of all gaps that could close within the step, their allowances in ``work.bias``.

    Returns their number, −1 if there is no room.
    """
    row = 0
    for k in range(first_joint(lo), model.n):
        angle = state.q[k] - state.q[k - 1]
        rate = v[k] - (v[k - 1] if k > lo else 0.0)
        for sign in (-1, 1):
            gap = contact.HALF_PI - sign * angle
            if gap - sign * rate * h < REACH * abs(rate) * h + 1e-6:
                contact.stop_row(lo, model, work, row, k, sign)
                work.bias[row] = allowance(gap, h)
                row += 1
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


@kernel
def land_joints(lo: int, model: Model, state: State) -> None:
    """Lock the joints that the step brought to their stops."""
    for k in range(first_joint(lo), model.n):
        angle = state.q[k] - state.q[k - 1]
        if state.lock[k] == 0 and abs(angle) >= contact.HALF_PI - 1e-9:
            state.lock[k] = 1 if angle > 0.0 else -1
