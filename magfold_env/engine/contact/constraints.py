"""Find and release the constraints of the coming step, apply impacts, and correct drift.

Each constraint is a row of the Jacobian. In a Moreau step, rows include gaps that may close in the
step, and limit the speed at which each closes.
"""

import math

from magfold_env.engine import indices as ix
from magfold_env.engine.chain import articulated, feed, ledger
from magfold_env.engine.chain.momentum import momentum_along
from magfold_env.engine.chain.tube import place_all
from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.contact import boxes, jacobian
from magfold_env.engine.contact.complementarity import solve_passive, take_least
from magfold_env.engine.elementary import square
from magfold_env.engine.state import Array, IntArray, Model, State, Work, copy
from magfold_env.engine.stepping import dynamics

AT_STOP = 1e-9  # [rad] a joint this near to its stop is there
SHUT = 1e-10  # [m/s] smaller rates do not count
WEDGED = 1e-3  # share of the feed's speed: faster approaches left by an impact are wedged
OPENING = 1e-7  # [rad/s] a joint that turns away faster leaves its stop
CORRECTIONS = 3
ATTEMPTS = 3  # at finding the velocities after an impact
NEAR = 0.25  # of the distance within which contacts act: smaller drifts do not count
ASTRAY = 4.0  # times this distance: a larger remaining drift means that the correction failed
SUNK = 1e-4  # share of the side: larger overlaps are not explained by a step's error
PUSH_OUT = 0.2  # share of an overlap that one step removes
GENTLE = 30.0  # tolerances of a typical rate: overlaps are removed no faster, as that heats
REACH = 1.0  # share by which projection may turn a joint faster than its trial rate
OK, IMPACT, CROWDED, UNSOLVED = range(4)


@inlined
def first_joint(lo: int) -> int:
    """Return the first joint with stops: the inner joint of component ``lo``, if it has one."""
    return max(lo, 1)


@inlined
def joint_rate(lo: int, v: Array, k: int) -> float:
    """Return the rate of component k's inner joint [rad/s]; those before ``lo`` do not turn."""
    return v[k] - (v[k - 1] if k > lo else 0.0)


@inlined
def place_touching(lo: int, model: Model, q: Array, work: Work) -> None:
    """Find the pose and the boxes of everything that may touch."""
    place_all(lo, model, q, work.pose)
    boxes.place_boxes(boxes.first_box(lo), model, work.pose, work)


@kernel
def begin_step(model: Model, state: State, work: Work) -> int:
    """Collect the rows of the coming step, and apply impacts.

    Returns OK, IMPACT (velocities jumped), CROWDED (more contacts than rows) or UNSOLVED.
    """
    for kind in range(work.rows.counts.size):
        work.rows.counts[kind] = 0
    if not model.contact:
        return OK
    lo = state.counter[ix.N_HELD]
    rows = collect_rows(lo, model, state, work)
    if rows < 0:
        return CROWDED
    closing = False
    for r in range(work.rows.counts[ix.JOINT_STOPS]):
        k = work.rows.id[r, 0]
        closing = closing or joint_rate(lo, state.v, k) * work.rows.id[r, 1] > 0.0
    if rows > work.rows.counts[ix.JOINT_STOPS]:
        prepare(lo, model, state.v, work)
        for r in range(work.rows.counts[ix.JOINT_STOPS], rows):
            closing = closing or dynamics.rate_of(lo, work, r, state.v) < -SHUT
    result = OK
    if closing:
        driven, speed = feed.drives(model, state), float(state.v[model.n])
        lost = float(state.account[ix.IMPACTS])
        if driven:
            copy(state.v, work.stages.new_v, 0)
        solved, impulse = collide(lo, rows, model, state, work)
        if driven and approaches(lo, rows, state.v, work, WEDGED * abs(speed) + SHUT):
            # A chain in line with an obstacle cannot yield; only the drive can give way.
            impulse = math.copysign(math.inf, speed)
        if driven and (not solved or feed.is_too_much(model, state, impulse)):
            # If the drive gives way, the components that it carries take part in the impact.
            copy(work.stages.new_v, state.v, 0)
            state.account[ix.IMPACTS] = lost
            feed.slip(model, state, work, impulse)
            solved, _ = collide(lo, rows, model, state, work)
        elif driven:
            ledger.note_impulse(state, impulse, float(state.v[model.n]))
        if not solved:
            return UNSOLVED
        state.counter[ix.EVENTS] += 1
        result = IMPACT
    leave(lo, model, state, work)
    return result


@kernel
def collide(lo: int, rows: int, model: Model, state: State, work: Work) -> tuple[bool, float]:
    """Apply an impact; return whether a solution was found, and the drive's impulse [N·s]."""
    slow = model.tolerance * model.typical_rate * model.side
    v = state.v
    impulse = -momentum_along(lo, model, work, v)
    solved, attempts = False, 0
    # Even a failed attempt leaves much slower approaches.
    while not solved and attempts < ATTEMPTS:
        solved = dynamics.project(model, state, v, work, slow)
        attempts += 1
        state.account[ix.IMPACTS] += dynamics.lost(lo, rows, work, v)
        if feed.drives(model, state):
            # Of all equivalent multipliers, the smallest ones give the impact's impulse on the
            # drive. The energy sums over rates include the work of the other multipliers too.
            told = passed_on(model, rows, work)
            take_least(rows, work)
            passed = passed_on(model, rows, work)
            impulse -= passed
            state.account[ix.IMPACTS] += (told - passed) * v[model.n]
    # If rows nearly repeat each other, rounding may hide that the impact is complete.
    solved = solved or not approaches(lo, rows, v, work, SHUT)
    return solved, impulse + momentum_along(lo, model, work, v)


@inlined
def passed_on(model: Model, rows: int, work: Work) -> float:
    """Return the impulse along the tube that contacts transmit to the drive [N·s]."""
    total = 0.0
    for r in range(work.rows.counts[ix.JOINT_STOPS], rows):
        total += work.rows.multiplier[r] * work.rows.jacobian[r, model.n]
    return total


@kernel
def approaches(lo: int, rows: int, v: Array, work: Work, least: float) -> bool:
    """Whether the gap of any row still closes faster than ``least`` [rad/s, m/s]."""
    for r in range(rows):
        if dynamics.rate_of(lo, work, r, v) < -least:
            return True
    return False


@kernel
def note_gaps(model: Model, state: State, work: Work) -> bool:
    """Store the gaps of the contacts at the beginning of a step; return whether there are any.

    Contacts are kept at these gaps, because normals at corners turn within distances far smaller
    than `jacobian.TOUCH` and must not change.
    """
    if work.rows.counts[ix.CONTACTS] == work.rows.counts[ix.JOINT_STOPS]:
        return False
    lo, touch = state.counter[ix.N_HELD], jacobian.TOUCH * model.side
    place_touching(lo, model, state.q, work)
    for r in range(work.rows.counts[ix.JOINT_STOPS], work.rows.counts[ix.CONTACTS]):
        work.rows.gap[r] = min(max(jacobian.gap_of(model, work, r), 0.0), touch)
    return True


@kernel
def keep_contacts(model: Model, state: State, work: Work, q: Array, v: Array) -> bool:
    """Correct a step's errors in the gaps of contacts that pressed throughout the step.

    The step's accelerations kept these gaps and their rates only to within the step's error.
    Coordinates and velocities become the nearest ones at which the squares touch and stay in touch.
    Returns False if a gap is so wrong that an event must have happened within the step.
    """
    lo = state.counter[ix.N_HELD]
    stops, rows = work.rows.counts[ix.JOINT_STOPS], work.rows.counts[ix.CONTACTS]
    near = NEAR * jacobian.TOUCH * model.side
    for r in range(rows):
        # These rows pressed at the end of the step; the other contacts may separate.
        work.rows.passive[r] = int(work.rows.multiplier[r] > 0.0)
    off = math.inf
    for correction in range(CORRECTIONS + 1):
        for r in range(stops):
            # Put the joint exactly at its stop, as after the step; the squares beyond it move.
            k = work.rows.id[r, 0]
            if work.rows.passive[r] == 1:
                q[k] = q[k - 1] + work.rows.id[r, 1] * jacobian.HALF_PI
        place_touching(lo, model, q, work)
        work.rows.counts[ix.ALL_ROWS] = rows
        prepare(lo, model, v, work)
        off = 0.0
        for r in range(rows):
            work.rows.bias[r] = 0.0
            if r >= stops:
                gap = jacobian.gap_of(model, work, r)
                if gap < -SUNK * model.side:
                    return False
                if work.rows.passive[r] == 1:
                    work.rows.bias[r] = gap - work.rows.gap[r]
                    off = max(off, abs(work.rows.bias[r]))
        if off < near or correction == CORRECTIONS:
            break
        solve_passive(rows, work, work.rows.multiplier)
        dynamics.apply_multipliers(lo, rows, work, q)
    # If constraints nearly contradict each other, the corrections may diverge.
    if off > ASTRAY * near:
        return False
    for r in range(rows):
        work.rows.bias[r] = dynamics.rate_of(lo, work, r, v)
    solve_passive(rows, work, work.rows.multiplier)
    dynamics.apply_multipliers(lo, rows, work, v)
    return True


@kernel
def collect_rows(lo: int, model: Model, state: State, work: Work) -> int:
    """Collect rows for whatever touches, stops first; return their number, or −1 if too many."""
    collect_stops(lo, model, state, work)
    place_touching(lo, model, state.q, work)
    stops, touch = work.rows.counts[ix.JOINT_STOPS], jacobian.TOUCH * model.side
    rows = jacobian.collect_contacts(lo, model, work, stops, touch)
    work.rows.counts[ix.CONTACTS] = rows
    work.rows.counts[ix.ALL_ROWS] = rows
    return rows


@kernel
def collect_stops(lo: int, model: Model, state: State, work: Work) -> None:
    """Collect rows for the joints at their stops, except for joints that turn away."""
    row = 0
    for k in range(first_joint(lo), model.n):
        sign = state.lock[k]
        if sign == 0:
            angle = state.q[k] - state.q[k - 1]
            side = 1 if angle > 0.0 else -1
            inward = joint_rate(lo, state.v, k) * side >= 0.0
            if inward and abs(angle) >= jacobian.HALF_PI - AT_STOP:
                sign = side
                state.lock[k] = sign
                state.q[k] = state.q[k - 1] + sign * jacobian.HALF_PI
        if sign != 0:
            work.rows.id[row, 0] = k
            work.rows.id[row, 1] = sign
            row += 1
    work.rows.counts[ix.JOINT_STOPS] = row


@kernel
def strikes_stop(model: Model, state: State) -> bool:
    """Whether a joint at its stop turns towards it."""
    lo = state.counter[ix.N_HELD]
    for k in range(first_joint(lo), model.n):
        angle = state.q[k] - state.q[k - 1]
        rate = joint_rate(lo, state.v, k)
        inward = rate if angle > 0.0 else -rate
        if inward > OPENING and abs(angle) >= jacobian.HALF_PI - AT_STOP:
            return True
    return False


@kernel
def prepare(lo: int, model: Model, v: Array, work: Work) -> None:
    """Fill in the Jacobians of all rows at the current pose and velocity."""
    articulated.centre_motion(lo, model.bodies, work.pose, v, work.centres)
    articulated.factor(lo, model.bodies, work.pose, work.chain.unlocked, work.chain)
    dynamics.fill_rows(lo, model, v, work)


@kernel
def leave(lo: int, model: Model, state: State, work: Work) -> None:
    """Drop the rows whose gaps open, and set the rates of the other joints to exactly zero."""
    stops, rows = work.rows.counts[ix.JOINT_STOPS], work.rows.counts[ix.CONTACTS]
    keep = 0
    for r in range(stops):
        k, sign = work.rows.id[r, 0], work.rows.id[r, 1]
        if -joint_rate(lo, state.v, k) * sign > OPENING:
            state.lock[k] = 0
        else:
            move_row(work, r, keep)
            keep += 1
    work.rows.counts[ix.JOINT_STOPS] = keep
    # Released contacts are stored at the end of the rows, after the space for friction rows.
    dropped = 0
    for r in range(stops, rows):
        if dynamics.rate_of(lo, work, r, state.v) <= SHUT:
            move_row(work, r, keep)
            keep += 1
        elif rows + 3 * model.n + dropped < work.rows.bias.size:
            move_row(work, r, work.rows.bias.size - 1 - dropped)
            dropped += 1
    work.rows.counts[ix.LET_GO] = dropped
    work.rows.counts[ix.CONTACTS] = keep
    work.rows.counts[ix.ALL_ROWS] = keep
    work.rows.passive[:keep] = 1
    hold_joints(lo, model, state.lock, state.q, state.v)


@inlined
def move_row(work: Work, old: int, new: int) -> None:
    """Copy a row's id, entry by entry, because an array assignment would allocate memory."""
    for k in range(work.rows.id.shape[1]):
        work.rows.id[new, k] = work.rows.id[old, k]


@kernel
def hold_joints(lo: int, model: Model, lock: IntArray, q: Array, v: Array) -> None:
    """Put locked joints exactly at their stops, without rounding errors."""
    for k in range(first_joint(lo), model.n):
        if lock[k] != 0:
            q[k] = q[k - 1] + lock[k] * jacobian.HALF_PI
            v[k] = v[k - 1] if k > lo else 0.0


@kernel
def open_joints(lo: int, model: Model, state: State) -> None:
    """After a step, open the joints that left their stops in it, and hold the others exactly."""
    if not model.contact:
        return
    for k in range(first_joint(lo), model.n):
        sign = state.lock[k]
        if sign == 0:
            # Moreau steps may overshoot slightly, and beyond its stop a joint would not lock.
            angle = state.q[k] - state.q[k - 1]
            if abs(angle) > jacobian.HALF_PI:
                state.q[k] = state.q[k - 1] + math.copysign(jacobian.HALF_PI, angle)
            continue
        # A joint that left its stop within a Moreau step and closes again needs an impact.
        if abs(joint_rate(lo, state.v, k)) > OPENING:
            state.lock[k] = 0
            if (state.q[k] - state.q[k - 1]) * sign > jacobian.HALF_PI:
                state.q[k] = state.q[k - 1] + sign * jacobian.HALF_PI
    hold_joints(lo, model, state.lock, state.q, state.v)


@inlined
def allowance(model: Model, gap: float, time: float, size: float) -> float:
    """Return the closing velocity that a gap allows; overlaps are removed slowly.

    ``size`` is the side of a square [m], or 1 for an angle.
    """
    if gap >= 0.0:
        return gap / time
    return max(PUSH_OUT * gap / time, -GENTLE * model.tolerance * model.typical_rate * size)


@kernel
def collect_within(
    lo: int, model: Model, q: Array, work: Work, v: Array, h: float, near_stop: float
) -> int:
    """Collect rows for gaps that could close in the step; put allowances in ``work.rows.bias``.

    A joint within ``near_stop`` [rad] of a stop always gets a row for it. Returns the number of
    rows, or −1 if there are too many.
    """
    row = 0
    for k in range(first_joint(lo), model.n):
        angle = q[k] - q[k - 1]
        rate = joint_rate(lo, v, k)
        for sign in (-1, 1):
            gap = jacobian.HALF_PI - sign * angle
            if gap - sign * rate * h < REACH * abs(rate) * h + near_stop:
                jacobian.stop_row(lo, model, work, row, k, sign)
                work.rows.bias[row] = allowance(model, gap, h, 1.0)
                row += 1
    work.rows.counts[ix.JOINT_STOPS] = row
    boxes.place_boxes(boxes.first_box(lo), model, work.pose, work)
    fastest = 0.0
    for i in range(lo, model.n):
        fastest = max(fastest, math.sqrt(square(work.centres.vx[i]) + square(work.centres.vy[i])))
        fastest = max(fastest, abs(v[i]) * model.side)
    near = 4.0 * fastest * h + jacobian.TOUCH * model.side
    rows = jacobian.collect_contacts(lo, model, work, row, near)
    for r in range(row, rows):
        jacobian.contact_row(lo, model, work.pose, work, r, v)
        work.rows.bias[r] = allowance(model, work.rows.gap[r], h, model.side)
    return rows
