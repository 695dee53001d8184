"""Which constraints act in the coming step: found, entered by impact, left, kept from drifting."""

from __future__ import annotations

import math

from magfold_env.engine import chain, contact
from magfold_env.engine.complementarity import solve_nonnegative
from magfold_env.engine.dynamics import apply_multipliers, fill_rows, project, rate_of
from magfold_env.engine.feed import place_all
from magfold_env.engine.jit import inlined, kernel
from magfold_env.engine.state import EVENTS, LO, Array, Model, State, Work

AT_STOP = 1e-9  # [rad] a joint this near to its stop is there
SHUT = 1e-10  # [m/s] rates this small are none
FARTHEST = 20.0  # a correction may turn a component by this many gaps over the side
OPENING = 1e-7  # [rad/s] a stop whose joint turns away faster is left
OK, IMPACT, CROWDED, UNSOLVED = range(4)


@inlined
def first_joint(lo: int) -> int:
    """First joint with stops: the one behind component ``lo``, if there is a component there."""
    return max(lo, 1)


@kernel
def begin_step(model: Model, state: State, work: Work, force: bool) -> int:
    """Collect the rows of the coming step; impacts happen here.

    ``force`` shuts whatever touches, also if it is coming apart: the last word on rattling.
    Returns OK, IMPACT (velocities jumped), CROWDED (more contacts than rows) or UNSOLVED.
    """
    work.row_count[:] = 0
    if not model.contact:
        return OK
    lo = state.count[LO]
    collect_stops(lo, model, state, work, force)
    place_all(lo, model, state.q, work.pose)
    contact.place_boxes(max(lo - 1, 0), model, work.pose, work)
    rows = contact.collect_contacts(lo, model, work, work.row_count[0])
    if rows < 0:
        return CROWDED
    work.row_count[1] = rows
    closing = force
    for r in range(work.row_count[0]):
        k = work.row_id[r, 0]
        behind = state.v[k - 1] if k > lo else 0.0
        closing = closing or (state.v[k] - behind) * work.row_id[r, 1] > 0.0
    if rows > work.row_count[0]:
        work.row_count[1] = rows
        prepare(lo, model, state.v, work)
        for r in range(work.row_count[0], rows):
            closing = closing or rate_of(lo, work, r, state.v) < -SHUT
    result = OK
    if closing:
        slow = 0.1 * model.tolerance * model.rate_scale * model.side
        if force:
            slow = math.inf
        if not project(model, state, state.v, work, slow):
            return UNSOLVED
        state.count[EVENTS] += 1
        result = IMPACT
    leave(lo, model, state, work)
    for r in range(work.row_count[1]):
        work.passive[r] = 1
    work.row_count[2] = work.row_count[1]
    return result


@kernel
def collect_stops(lo: int, model: Model, state: State, work: Work, force: bool) -> None:
    """Rows for the joints at their stops, unless they are on their way out."""
    row = 0
    for k in range(first_joint(lo), model.n):
        sign = state.lock[k]
        if sign == 0:
            angle = state.q[k] - state.q[k - 1]
            side = 1 if angle > 0.0 else -1
            behind = state.v[k - 1] if k > lo else 0.0
            inward = force or (state.v[k] - behind) * side >= 0.0
            if inward and abs(angle) >= contact.HALF_PI - AT_STOP:
                sign = side
                state.lock[k] = sign
                state.q[k] = state.q[k - 1] + sign * contact.HALF_PI
        if sign != 0:
            work.row_id[row, 0] = k
            work.row_id[row, 1] = sign
            row += 1
    work.row_count[0] = row


@kernel
def prepare(lo: int, model: Model, v: Array, work: Work) -> None:
    """Jacobians of all rows at the current pose and velocity."""
    chain.centre_velocities(lo, model.bodies, work.pose, v, work.vx, work.vy)
    chain.centripetal(lo, model.bodies, work.pose, v, work.ax, work.ay)
    chain.factor(lo, model.bodies, work.pose, work.art)
    fill_rows(lo, model, v, work)


@kernel
def leave(lo: int, model: Model, state: State, work: Work) -> None:
    """Drop the rows that are coming apart, and make the rates of kept joints exactly equal."""
    stops, rows = work.row_count[0], work.row_count[1]
    keep = 0
    for r in range(stops):
        k, sign = work.row_id[r, 0], work.row_id[r, 1]
        behind = state.v[k - 1] if k > lo else 0.0
        if (behind - state.v[k]) * sign > OPENING:
            state.lock[k] = 0
        else:
            work.row_id[keep] = work.row_id[r]
            keep += 1
    work.row_count[0] = keep
    for r in range(stops, rows):
        if rate_of(lo, work, r, state.v) <= SHUT:
            work.row_id[keep] = work.row_id[r]
            keep += 1
    work.row_count[1] = keep
    hold_joints(lo, model, state.lock, state.q, state.v)


@kernel
def hold_joints(lo: int, model: Model, lock: Array, q: Array, v: Array) -> None:
    """Put joints at their stops there exactly, free of rounding."""
    for k in range(first_joint(lo), model.n):
        if lock[k] != 0:
            q[k] = q[k - 1] + lock[k] * contact.HALF_PI
            v[k] = v[k - 1] if k > lo else 0.0


@kernel
def open_joints(lo: int, model: Model, state: State) -> None:
    """After a step: open the joints that came apart in it, hold the others exactly."""
    for k in range(first_joint(lo), model.n):
        sign = state.lock[k]
        if sign == 0:
            continue
        behind = state.v[k - 1] if k > lo else 0.0
        if (behind - state.v[k]) * sign > OPENING:
            state.lock[k] = 0
            if (state.q[k] - state.q[k - 1]) * sign > contact.HALF_PI:
                state.q[k] = state.q[k - 1] + sign * contact.HALF_PI
    hold_joints(lo, model, state.lock, state.q, state.v)


@kernel
def correct_drift(model: Model, state: State, work: Work) -> bool:
    """Bring touching corners back to their faces after a step; returns whether any moved.

    One Newton step on the gaps, nearest in the metric of the mass matrix, joints at their stops
    kept there.
    """
    lo = state.count[LO]
    stops, rows = work.row_count[0], work.row_count[1]
    if rows == stops:
        return False
    touch = contact.TOUCH * model.side
    place_all(lo, model, state.q, work.pose)
    prepare(lo, model, state.v, work)
    drifted = 0.0
    for r in range(rows):
        work.bias[r] = 0.0
        work.equality[r] = 1
        if r >= stops:
            gap = contact.contact_gap(work, r)
            pressed = work.multiplier[r] > 0.0
            if gap < 0.0 or (pressed and gap > 0.75 * touch):
                work.bias[r] = gap - 0.25 * touch
                drifted = max(drifted, abs(work.bias[r]))
            elif not pressed:
                work.equality[r] = 0
    if drifted == 0.0:
        return False
    solve_nonnegative(rows, work)
    work.force[:] = 0.0
    apply_multipliers(lo, rows, work, work.force)
    # Rows that nearly repeat each other ask for the impossible; a small gap is better.
    for k in range(lo, model.n):
        if abs(work.force[k]) * model.side > FARTHEST * drifted:
            return False
    state.q[lo:] += work.force[lo:]
    hold_joints(lo, model, state.lock, state.q, state.v)
    return True
