"""Locate the first new touch within a step, and suppress hops that are too small to follow."""

from magfold_env.engine import indices as ix
from magfold_env.engine.chain import articulated, feed, ledger
from magfold_env.engine.chain.momentum import momentum_along
from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.contact import boxes, constraints, jacobian, sweep
from magfold_env.engine.contact.complementarity import solve_nonnegative, take_least
from magfold_env.engine.state import Array, Model, State, Work, copy
from magfold_env.engine.stepping.dynamics import apply_multipliers, lost, rate_of
from magfold_env.engine.stepping.stages import interpolate

STALLED = -1.0
NEAR_ENOUGH = 1e-10  # [rad, or of the side]
ROUNDING = 1e-14
UNSEEN = 5e-5  # [rad, or of the side] smaller overlaps at a sample do not count as touches
HOP = 0.05  # share of the tolerance: smaller hops are suppressed


@kernel
def margin(model: Model, state: State, q: Array, work: Work) -> float:
    """Return how far coordinates are from a new touch, as a fraction of the side or in radians.

    A negative value means that something touched earlier. Contacts and stops that are already in
    the step's rows do not count.
    """
    lo = state.counter[ix.N_HELD]
    worst = 1.0
    for k in range(constraints.first_joint(lo), model.n):
        if state.lock[k] == 0:
            worst = min(worst, jacobian.HALF_PI - abs(q[k] - q[k - 1]))
    return min(worst, square_margin(model, state, q, work)) if may_collide(model) else worst


@inlined
def may_collide(model: Model) -> bool:
    """Whether any square could ever touch another one or a solid."""
    return model.n > boxes.APART or model.obstacles.shape[0] > 0


@kernel
def square_margin(model: Model, state: State, q: Array, work: Work) -> float:
    """Like `margin`, for squares only."""
    lo, worst = state.counter[ix.N_HELD], 1.0
    constraints.place_touching(lo, model, q, work)
    for i in range(boxes.first_box(lo), model.n):
        for j in range(*boxes.partners(model, lo, i)):
            if not boxes.may_touch(model, work, i, j):
                continue
            for c in range(8):
                box, other = (i, j) if c < 4 else (j, i)
                gap = boxes.corner_gap(model, work, box, other, c % 4)
                if c >= 4 and j >= model.n:
                    gap = min(gap, -boxes.behind_face(model, work, j, i, c % 4))
                gap /= model.side
                if gap < worst and not jacobian.is_row(work, box, other, c % 4):
                    worst = gap
    return worst


@kernel
def first_touch(model: Model, state: State, step: float, work: Work) -> float:
    """Return the fraction of the step at which something new touches; 1 if nothing does.

    Returns `STALLED`, which `moreau_step` handles, if something touches that has hardly separated.

    The search samples the end of the step, then its middle and the intervals in which `sweep` finds
    that a touch is possible. It then locates the touch on the dense output, which needs no forces.
    """
    lo, found, squares = state.counter[ix.N_HELD], 1.0, may_collide(model)
    interpolate(state.q, work.stages.slope_q, step, 1.0, work.stages.q)
    at_end = margin(model, state, work.stages.q, work)
    if at_end >= 0.0:
        sweep.follow_step(lo, model, step, 1.0, work)
        squares = squares and sweep.may_meet(model, state, work)
        if not squares and sweep.joints_clear(model, state, work, 0.0, 1.0, 0.0) == sweep.CLEAR:
            return 1.0
    interpolate(state.q, work.stages.slope_q, step, 0.5, work.stages.q)
    at_middle = margin(model, state, work.stages.q, work)
    if at_middle < 0.0:
        at_begin = margin(model, state, state.q, work)
        found = locate(model, state, step, 0.0, at_begin, 0.5, at_middle, work)
    elif at_end < 0.0:
        found = locate(model, state, step, 0.5, at_middle, 1.0, at_end, work)
    if found == STALLED:
        return STALLED
    if found < 1.0:
        sweep.follow_step(lo, model, step, found, work)
        squares = squares and sweep.may_meet(model, state, work)
    low, high, at_high = first_missed(model, state, squares, True, work)
    if at_high >= 0.0:
        return found
    interpolate(state.q, work.stages.slope_q, step, low * found, work.stages.q)
    at_low = margin(model, state, work.stages.q, work)
    if at_low < NEAR_ENOUGH:
        # By then something may have overlapped by less than the search notices.
        low, at_low = 0.0, margin(model, state, state.q, work)
    return locate(model, state, step, low * found, at_low, high * found, at_high, work)


@kernel
def locate(
    model: Model, state: State, step: float, low: float, at_low: float, high: float,
    at_high: float, work: Work,
) -> float:  # fmt: skip
    """Return the fraction of the step at which a touch begins, found by the Illinois method.

    At the fraction ``low``, nothing touches; at ``high``, the margin is negative.
    """
    if at_low < NEAR_ENOUGH:
        return STALLED if low == 0.0 else low
    left = at_low
    kept = 0
    for _ in range(60):
        # The state at the event must be admissible, so stay before the touch.
        if left < NEAR_ENOUGH or high - low < ROUNDING:
            break
        middle = high - at_high * (high - low) / (at_high - at_low)
        if not low < middle < high:
            middle = 0.5 * (low + high)
        interpolate(state.q, work.stages.slope_q, step, middle, work.stages.q)
        value = margin(model, state, work.stages.q, work)
        if value >= 0.0:
            low, at_low, left = middle, value, value
            at_high = at_high * 0.5 if kept == 1 else at_high
            kept = 1
        else:
            high, at_high = middle, value
            at_low = at_low * 0.5 if kept == -1 else at_low
            kept = -1
    return low


@kernel
def first_missed(
    model: Model, state: State, squares: bool, smooth: bool, work: Work
) -> tuple[float, float, float]:
    """Return an interval that contains the first touch in the motion that `sweep` follows.

    ``squares`` says whether any squares may touch. For a ``smooth`` step, joint stops count too,
    and nothing new may touch at its end.

    Returns two fractions of the motion between which the touch lies, and the margin at the second;
    it is negative if anything touches, and positive otherwise.
    """
    begin, slot, last, width, growth = 0.0, 0, 1, 1.0, 2.0
    past = sweep.PAST * model.tolerance
    if squares:
        sweep.place_at(model, state, work, 0.0, 0)
    while begin < 1.0:
        end = min(begin + width, 1.0)
        found = sweep.joints_clear(model, state, work, begin, end, past) if smooth else sweep.CLEAR
        if squares and found != sweep.UNSURE:
            sweep.place_at(model, state, work, end, last)
            clear = sweep.squares_clear(model, state, work, begin, end, slot, last)
            found = max(found, clear)
        if found == sweep.UNSURE:
            width, growth = 0.5 * (end - begin), 1.0
            continue
        if found == sweep.GRAZES and not (smooth and end == 1.0):
            sweep.coordinates_at(model, state, end, work.stages.q, work)
            if smooth:
                at_end = margin(model, state, work.stages.q, work)
            else:
                at_end = square_margin(model, state, work.stages.q, work)
            if at_end < -UNSEEN:
                return begin, end, at_end
        # An interval that has just been too long would probably be too long again.
        width, growth = growth * (end - begin), 2.0
        begin, slot, last = end, last, 2 if last == 1 else 1
    return 1.0, 1.0, 1.0


@kernel
def end_hops(model: Model, state: State, work: Work, acceleration: Array) -> int:
    """Hold joints and contacts that have just separated but would return after a tiny hop.

    An impact throws distant joints and corners off their contacts, and the magnets or the feed then
    close them again, in ever smaller hops, each with an impact. Hops of less than `HOP` times the
    tolerance are suppressed: the velocity becomes the nearest one at which these and all other
    contacts stay closed. ``acceleration`` is the state's. Returns OK, IMPACT (velocities changed),
    or UNSOLVED (no such velocity was found, the hops remain, and rows must be filled in again).
    """
    lo = state.counter[ix.N_HELD]
    work.rows.hopping[:] = 0
    found = False
    for k in range(constraints.first_joint(lo), model.n):
        angle = state.q[k] - state.q[k - 1]
        if state.lock[k] != 0 or abs(angle) < jacobian.HALF_PI - constraints.AT_STOP:
            continue
        side = 1 if angle > 0.0 else -1
        rate = side * constraints.joint_rate(lo, state.v, k)
        pull = side * constraints.joint_rate(lo, acceleration, k)
        if pull > 0.0 and rate * rate < 2.0 * pull * HOP * model.tolerance:
            state.lock[k] = side
            work.rows.hopping[k] = 1
            found = True
    found = mark_hopping_contacts(lo, model, state, work, acceleration) or found
    if not found:
        return constraints.OK
    dropped = work.rows.counts[ix.LET_GO]
    rows = constraints.collect_rows(lo, model, state, work)
    constraints.prepare(lo, model, state.v, work)
    for r in range(rows):
        work.rows.bias[r] = rate_of(lo, work, r, state.v)
        work.rows.equality[r] = int(r < work.rows.counts[ix.JOINT_STOPS] or stays(work, r, dropped))
        work.rows.passive[r] = 1
    solved, lost_then = solve_nonnegative(rows, work), 0.0
    if solved:
        copy(state.v, work.stages.new_v, 0)
        impulse = -momentum_along(lo, model, work, state.v)
        apply_multipliers(lo, rows, work, state.v)
        lost_then = lost(lo, rows, work, state.v)
        if feed.drives(model, state):
            impulse += momentum_along(lo, model, work, state.v)
            # A hop cannot close contacts that only the drive keeps apart, or rows that nearly
            # repeat each other.
            told = constraints.passed_on(model, rows, work)
            solved = not feed.is_too_much(model, state, impulse - told)
            if solved:
                take_least(rows, work)
                passed = constraints.passed_on(model, rows, work)
                lost_then += (told - passed) * state.v[model.n]
                ledger.note_impulse(state, impulse - passed, float(state.v[model.n]))
            else:
                copy(work.stages.new_v, state.v, 0)
    if not solved:
        for k in range(model.n):
            if work.rows.hopping[k] == 1:
                state.lock[k] = 0
        if constraints.strikes_stop(model, state):
            # A joint that an impact elsewhere drives back to its stop has an impact of its own.
            constraints.begin_step(model, state, work)
        else:
            constraints.collect_rows(lo, model, state, work)
            constraints.leave(lo, model, state, work)
        return constraints.UNSOLVED
    state.account[ix.IMPACTS] += lost_then
    constraints.leave(lo, model, state, work)
    return constraints.IMPACT


@kernel
def mark_hopping_contacts(
    lo: int, model: Model, state: State, work: Work, acceleration: Array
) -> bool:
    """Mark released contacts that will return after a tiny hop; return whether there are any."""
    if work.rows.counts[ix.LET_GO] == 0:
        return False
    found = False
    constraints.place_touching(lo, model, state.q, work)
    articulated.centre_motion(lo, model.bodies, work.pose, state.v, work.centres)
    for d in range(work.rows.counts[ix.LET_GO]):
        r = work.rows.bias.size - 1 - d
        jacobian.contact_row(lo, model, work.pose, work, r, state.v)
        rate = rate_of(lo, work, r, state.v)
        pull = -work.rows.bias[r] - rate_of(lo, work, r, acceleration)
        hop = pull > 0.0 and rate * rate < 2.0 * pull * HOP * model.tolerance * model.side
        work.rows.id[r, 3] = int(hop)
        found = found or hop
    return found


@inlined
def stays(work: Work, r: int, dropped: int) -> bool:
    """Whether row r was not released, or `mark_hopping_contacts` has marked it."""
    for d in range(dropped):
        s = work.rows.bias.size - 1 - d
        same = work.rows.id[s, 3] == 0
        for k in range(3):
            same = same and work.rows.id[s, k] == work.rows.id[r, k]
        if same:
            return False
    return True
