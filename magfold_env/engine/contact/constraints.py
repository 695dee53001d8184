"""Which constraints act in the coming step: found, entered by impact, left, kept from drifting."""

from __future__ import annotations

import math

from magfold_env.engine.chain import articulated
from magfold_env.engine.chain.feed import place_all
from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.contact import boxes, jacobian
from magfold_env.engine.contact.complementarity import solve_equalities
from magfold_env.engine.state import EVENTS, LO, Array, IntArray, Model, State, Work
from magfold_env.engine.stepping.dynamics import apply_multipliers, fill_rows, project, rate_of

AT_STOP = 1e-9  # [rad] a joint this near to its stop is there
SHUT = 1e-10  # [m/s] rates this small are none
OPENING = 1e-7  # [rad/s] a stop whose joint turns away faster is left
CORRECTIONS = 3
ATTEMPTS = 3  # at the velocities after an impact
NEAR = 0.25  # of the distance within which contacts act: drifts up to this are none
ASTRAY = 4.0  # times as far: a correction so far off is none
SUNK = 1e-4  # share of the side: overlaps that a step's error does not explain
OK, IMPACT, CROWDED, UNSOLVED = range(4)


@inlined
def first_joint(lo: int) -> int:
    """First joint with stops: the one behind component ``lo``, if there is a component there."""
    return max(lo, 1)


@kernel
def begin_step(model: Model, state: State, work: Work) -> int:
    """Collect the rows of the coming step; impacts happen here.

    Returns OK, IMPACT (velocities jumped), CROWDED (more contacts than rows) or UNSOLVED.
    """
    for kind in range(work.row_count.size):
        work.row_count[kind] = 0
    if not model.contact:
        return OK
    lo = state.counter[LO]
    rows = collect_rows(lo, model, state, work)
    if rows < 0:
        return CROWDED
    closing = False
    for r in range(work.row_count[0]):
        k = work.row_id[r, 0]
        behind = state.v[k - 1] if k > lo else 0.0
        closing = closing or (state.v[k] - behind) * work.row_id[r, 1] > 0.0
    if rows > work.row_count[0]:
        prepare(lo, model, state.v, work)
        for r in range(work.row_count[0], rows):
            closing = closing or rate_of(lo, work, r, state.v) < -SHUT
    result = OK
    if closing:
        slow = model.tolerance * model.rate_scale * model.side
        solved = False
        attempts = 0
        # An attempt that fails leaves far slower approaches than it found.
        while not solved and attempts < ATTEMPTS:
            solved = project(model, state, state.v, work, slow)
            attempts += 1
        # Where rows all but repeat each other rounding may hide that nothing is left to do.
        if not solved and approaches(lo, rows, state.v, work):
            return UNSOLVED
        state.counter[EVENTS] += 1
        result = IMPACT
    leave(lo, model, state, work)
    return result


@kernel
def approaches(lo: int, rows: int, v: Array, work: Work) -> bool:
    """Whether anything that touches still comes nearer."""
    for r in range(rows):
        if rate_of(lo, work, r, v) < -SHUT:
            return True
    return False


@kernel
def note_gaps(model: Model, state: State, work: Work) -> bool:
    """Note how far the contacts of a step are apart when it begins; whether there are any.

    There they will be kept, so that normals at corners, which turn within a far shorter way than
    `contact.TOUCH`, stay as they are.
    """
    if work.row_count[1] == work.row_count[0]:
        return False
    lo, touch = state.counter[LO], jacobian.TOUCH * model.side
    place_all(lo, model, state.q, work.pose)
    boxes.place_boxes(boxes.first_box(lo), model, work.pose, work)
    for r in range(work.row_count[0], work.row_count[1]):
        gap = boxes.corner_gap(model, work, work.row_id[r, 0], work.row_id[r, 1], work.row_id[r, 2])
        work.gap[r] = min(max(gap, 0.0), touch)
    return True


@kernel
def keep_contacts(model: Model, state: State, work: Work, q: Array, v: Array) -> bool:
    """Undo what a step drifted off the contacts that pressed all through it.

    Their gaps and the rates of these obeyed the step's accelerations, so only up to its error.
    Coordinates and velocities become the nearest ones at which the squares touch and stay in
    touch. Returns False if a gap is so wrong that something happened within the step.
    """
    lo = state.counter[LO]
    stops, rows = work.row_count[0], work.row_count[1]
    near = NEAR * jacobian.TOUCH * model.side
    for r in range(rows):
        # What pressed at the end of the step; the rest may part.
        work.passive[r] = int(work.multiplier[r] > 0.0)
    off = math.inf
    for correction in range(CORRECTIONS + 1):
        for r in range(stops):
            # Exactly at its stop, as it will be left: that moves the squares behind it.
            k = work.row_id[r, 0]
            if work.passive[r] == 1:
                q[k] = q[k - 1] + work.row_id[r, 1] * jacobian.HALF_PI
        place_all(lo, model, q, work.pose)
        boxes.place_boxes(boxes.first_box(lo), model, work.pose, work)
        work.row_count[2] = rows
        prepare(lo, model, v, work)
        off = 0.0
        for r in range(rows):
            work.bias[r] = 0.0
            if r >= stops:
                box, other, k = work.row_id[r, 0], work.row_id[r, 1], work.row_id[r, 2]
                gap = boxes.corner_gap(model, work, box, other, k)
                if gap < -SUNK * model.side:
                    return False
                if work.passive[r] == 1:
                    work.bias[r] = gap - work.gap[r]
                    off = max(off, abs(work.bias[r]))
        if off < near or correction == CORRECTIONS:
            break
        solve_equalities(rows, work)
        apply_multipliers(lo, rows, work, q)
    # Where constraints all but contradict each other corrections may lead away.
    if off > ASTRAY * near:
        return False
    for r in range(rows):
        work.bias[r] = rate_of(lo, work, r, v)
    solve_equalities(rows, work)
    apply_multipliers(lo, rows, work, v)
    return True


@kernel
def collect_rows(lo: int, model: Model, state: State, work: Work) -> int:
    """Rows of all that touches, stops first; returns their number, −1 if there is no room."""
    collect_stops(lo, model, state, work)
    place_all(lo, model, state.q, work.pose)
    boxes.place_boxes(boxes.first_box(lo), model, work.pose, work)
    rows = jacobian.collect_contacts(lo, model, work, work.row_count[0])
    work.row_count[1] = rows
    return rows


@kernel
def collect_stops(lo: int, model: Model, state: State, work: Work) -> None:
    """Rows for the joints at their stops, but not for those on their way out."""
    row = 0
    for k in range(first_joint(lo), model.n):
        sign = state.lock[k]
        if sign == 0:
            angle = state.q[k] - state.q[k - 1]
            side = 1 if angle > 0.0 else -1
            behind = state.v[k - 1] if k > lo else 0.0
            inward = (state.v[k] - behind) * side >= 0.0
            if inward and abs(angle) >= jacobian.HALF_PI - AT_STOP:
                sign = side
                state.lock[k] = sign
                state.q[k] = state.q[k - 1] + sign * jacobian.HALF_PI
        if sign != 0:
            work.row_id[row, 0] = k
            work.row_id[row, 1] = sign
            row += 1
    work.row_count[0] = row


@kernel
def prepare(lo: int, model: Model, v: Array, work: Work) -> None:
    """Jacobians of all rows at the current pose and velocity."""
    articulated.centre_velocities(lo, model.bodies, work.pose, v, work.vx, work.vy)
    articulated.centripetal(lo, model.bodies, work.pose, v, work.ax, work.ay)
    articulated.factor(lo, model.bodies, work.pose, work.open, work.art)
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
            move_row(work, r, keep)
            keep += 1
    work.row_count[0] = keep
    # What is let go is remembered at the other end of the rows, behind room for friction's.
    dropped = 0
    for r in range(stops, rows):
        if rate_of(lo, work, r, state.v) <= SHUT:
            move_row(work, r, keep)
            keep += 1
        elif rows + 3 * model.n + dropped < work.bias.size:
            move_row(work, r, work.bias.size - 1 - dropped)
            dropped += 1
    work.row_count[3] = dropped
    work.row_count[1] = keep
    work.row_count[2] = keep
    work.passive[:keep] = 1
    hold_joints(lo, model, state.lock, state.q, state.v)


@inlined
def move_row(work: Work, old: int, new: int) -> None:
    """Copy a row's id, entry by entry: an array assignment would allocate."""
    for k in range(work.row_id.shape[1]):
        work.row_id[new, k] = work.row_id[old, k]


@kernel
def hold_joints(lo: int, model: Model, lock: IntArray, q: Array, v: Array) -> None:
    """Put joints at their stops there exactly, free of rounding."""
    for k in range(first_joint(lo), model.n):
        if lock[k] != 0:
            q[k] = q[k - 1] + lock[k] * jacobian.HALF_PI
            v[k] = v[k - 1] if k > lo else 0.0


@kernel
def open_joints(lo: int, model: Model, state: State) -> None:
    """After a step: open the joints that came apart in it, hold the others exactly."""
    if not model.contact:
        return
    for k in range(first_joint(lo), model.n):
        sign = state.lock[k]
        if sign == 0:
            # Moreau steps may overshoot by a little: from there no joint would lock.
            angle = state.q[k] - state.q[k - 1]
            if abs(angle) > jacobian.HALF_PI:
                state.q[k] = state.q[k - 1] + math.copysign(jacobian.HALF_PI, angle)
            continue
        behind = state.v[k - 1] if k > lo else 0.0
        # One that shuts parted within a Moreau step and comes back: a matter for an impact.
        if abs(behind - state.v[k]) > OPENING:
            state.lock[k] = 0
            if (state.q[k] - state.q[k - 1]) * sign > jacobian.HALF_PI:
                state.q[k] = state.q[k - 1] + sign * jacobian.HALF_PI
    hold_joints(lo, model, state.lock, state.q, state.v)
