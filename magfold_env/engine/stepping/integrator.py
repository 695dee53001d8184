"""Integrate one chain to a given time, or to rest.

Between events the accelerations are smooth and Dormand and Prince's 5(4) pair takes steps whose
error it controls. A step ends where something new touches; there the impact is a projection of
the velocities and integration starts afresh, at full order. Joints at their stops move as rigid
bodies, which the pair keeps exactly; squares that touch are kept from drifting after each step.
Where something rattles, touching again as soon as it parted, Moreau's time-stepping takes over
for a few steps: of first order, but it needs no events.
"""

import math

from magfold_env.engine import entries as at
from magfold_env.engine import outcomes
from magfold_env.engine.chain import feed, ledger
from magfold_env.engine.chain.feed import is_free
from magfold_env.engine.chain.momentum import keep_if_left_alone
from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.contact import boxes, constraints, events, jacobian
from magfold_env.engine.contact.constraints import first_joint, joint_rate
from magfold_env.engine.elementary import inverse_root
from magfold_env.engine.friction.sticking import (
    first_accelerations,
    is_at_rest,
    is_creeping,
    stop_slow,
    torn_loose,
)
from magfold_env.engine.state import Array, Model, Record, State, Work, copy, is_finite
from magfold_env.engine.stepping import chebyshev
from magfold_env.engine.stepping.moreau import moreau_step
from magfold_env.engine.stepping.recorder import has_room, record_rest, record_step
from magfold_env.engine.stepping.stages import (
    ORDER,
    close_milliseconds,
    drive_impulse,
    interpolate,
    stages,
    step_error,
)

SHORTEST_STEP = 1e-13  # [s]
BREAK_AWAY = 1e-6  # [s] how exactly the moment is found when friction no longer holds
HOPELESS_STEP = 1e-9  # [s] not finite even here: broken
RUNAWAY = 300.0  # times a typical rate: faster than any force but that of a feed can make it
PATIENCE = 4  # Moreau steps after a rattle
INSTANT = 0.1  # tolerances of a typical rate: time in which next to nothing happens
LOW_BITS = 2**58 - 1
TOUCHES = 20  # in a row, with no more than an instant before each: a rattle


@kernel
def advance(model: Model, state: State, work: Work, record: Record, until: float, turn: int) -> int:
    """Integrate until the time ``until`` [s], rest, or breakdown; returns which.

    Returns PAUSED when the record is full or ``turn`` evaluations were made: empty the record and
    call again to go on. While the tube feeds, a chain at rest relative to it is moved on to
    ``until`` at once.
    """
    while state.clock[at.TIME] < until:
        if 0 < state.counter[at.LO] < model.n and state.counter[at.FEEDING] == 0:
            # In the last step the drive gave way: it begins anew.
            return outcomes.REACHED
        if outcomes.out_of_work(model, state):
            return outcomes.CAPPED
        if state.counter[at.EVALUATIONS] >= turn or not has_room(record, state, LONGEST_STEP):
            return outcomes.PAUSED
        ended, anew = gather_constraints(model, state, work)
        if ended != outcomes.REACHED:
            return ended
        acceleration = work.stages.slope_v[0]
        if anew and not renew_accelerations(model, state, work, acceleration):
            return outcomes.NO_SOLUTION
        if model.frictional:
            anew = stop_slow(model, state, work, acceleration) or anew
        copy(state.v, work.stages.slope_q[0], 0)
        fed = 0 < state.counter[at.LO] < model.n
        if fed and not feed.drives_on(model, state, work, acceleration, anew):
            return outcomes.REACHED
        slipping = fed and state.counter[at.SLIPPING] != 0
        if slipping and state.clock[at.TIME] >= state.feed[at.SINCE] + ledger.patience(model):
            return outcomes.LOCKED if math.isinf(model.force_limit) else outcomes.JAMMED
        goes_on = slipping or (fed and nears_something(model, state))
        goes_on = goes_on or state.clock[at.BUMP] < state.clock[at.END]
        if not goes_on and is_at_rest(model, state, work, acceleration):
            return rest(model, state, work, record, until)
        rattling = state.counter[at.MOREAU_LEFT] > 0
        if rattling or (model.frictional and is_creeping(model, state, work, acceleration)):
            outcome = moreau_step(model, state, work, record, until, rattling)
            state.counter[at.MOREAU_LEFT] -= int(rattling)
        else:
            outcome = step(model, state, work, record, until)
        ended = after_step(model, state, outcome)
        if ended != outcomes.REACHED:
            return ended
    return outcomes.REACHED


@inlined
def nears_something(model: Model, state: State) -> bool:
    """Whether a chain that rests relative to its base may run into what does not move."""
    speed = state.v[model.n]
    return speed < 0.0 or (speed > 0.0 and model.obstacles.shape[0] > at.WALLS)


@kernel
def gather_constraints(model: Model, state: State, work: Work) -> tuple[int, bool]:
    """Find what acts in the coming step; REACHED if it may be taken, else how it all ends.

    And whether accelerations must be found anew. Impacts happen here.
    """
    rows = signature(work)
    begun = constraints.begin_step(model, state, work)
    if begun == constraints.CROWDED:
        return outcomes.TOO_CROWDED, False
    if begun == constraints.UNSOLVED:
        return outcomes.NO_SOLUTION, False
    anew = (
        state.counter[at.FRESH] == 1 or begun != constraints.OK or state.counter[at.MOREAU_LEFT] > 0
    )
    # What only comes to lie on another, without an impact, is pushed by it all the same.
    anew = anew or signature(work) != rows
    anew = anew or (model.frictional and resting(state.counter[at.LO], state))
    return outcomes.REACHED, anew


@inlined
def signature(work: Work) -> int:
    """Return a number that tells what touches from what may touch a step later."""
    found = work.rows.counts[at.CONTACTS]
    for r in range(work.rows.counts[at.CONTACTS]):
        for k in range(2 if r < work.rows.counts[at.JOINT_STOPS] else 3):
            # Cut off where the next product would overflow.
            found = (31 * found + work.rows.id[r, k]) & LOW_BITS
    return found


@kernel
def resting(lo: int, state: State) -> bool:
    """Whether friction held any component in the last step."""
    for i in range(lo, state.stuck.size):
        if state.stuck[i] == 1:
            return True
    return False


@kernel
def renew_accelerations(model: Model, state: State, work: Work, out: Array) -> bool:
    """Accelerations of the state; ends hops. False if not found."""
    # Every round holds something more.
    for _ in range(2 * model.n):
        if not first_accelerations(model, state, work, out):
            return False
        hops = events.end_hops(model, state, work, out) if model.contact else constraints.OK
        if hops == constraints.OK:
            return True
        if hops != constraints.IMPACT:
            break
    return first_accelerations(model, state, work, out)


@kernel
def rest(model: Model, state: State, work: Work, record: Record, until: float) -> int:
    """End the run of a chain at rest; one that a tube feeds goes on with it, as far as asked."""
    n = model.n
    if is_free(state.counter[at.LO], model) or not model.tube or state.counter[at.PARKED] == 1:
        return outcomes.RESTED
    force = 0.0
    if feed.drives(model, state):
        force = feed.borne(model, state, float(work.stages.drive[0]))
    if not record_rest(record, state, until, force):
        return outcomes.PAUSED
    time = until - state.clock[at.TIME]
    ledger.pass_time(state, until, force * time)
    feed.note_step(state, work, force * time, state.v[n] * time)
    state.q[n] += state.v[n] * time
    state.clock[at.TIME] = until
    return outcomes.REACHED


@kernel
def after_step(model: Model, state: State, outcome: int) -> int:
    """Note how a step ended; REACHED if another may follow, else how it all ends."""
    if not is_finite(state.v):
        return outcomes.NOT_FINITE
    if runs_away(model, state):
        return outcomes.RAN_AWAY
    state.counter[at.FRESH] = int(outcome != outcomes.ACCEPTED)
    if outcome != outcomes.ACCEPTED:
        state.clock[at.LAST_STEP] = 0.0
    if outcome == outcomes.RATTLED:
        state.counter[at.MOREAU_LEFT] = PATIENCE
    elif outcome == outcomes.TOO_SHORT:
        return outcomes.UNDERFLOW
    elif outcome == outcomes.UNSOLVABLE:
        return outcomes.NO_SOLUTION
    elif outcome == outcomes.BROKEN:
        return outcomes.NOT_FINITE
    return outcomes.REACHED


@kernel
def runs_away(model: Model, state: State) -> bool:
    """Whether something turns faster than it can: a feed drives parts that cannot give way."""
    n = model.n
    if not model.tube:
        return False
    limit = model.light_rate + (abs(state.v[n]) + abs(state.v[n + 1])) / model.side
    for k in range(state.counter[at.LO], n):
        if abs(state.v[k]) > RUNAWAY * limit:
            return True
    return False


@kernel
def step(model: Model, state: State, work: Work, record: Record, until: float) -> int:
    """Take one step from the state, whose accelerations are in ``work.stages.slope_v[0]``."""
    lo, remaining = state.counter[at.LO], until - state.clock[at.TIME]
    new_q, new_v = work.stages.new_q, work.stages.new_v
    rate = chebyshev.friction_rate(lo, model, state, work) if model.frictional else 0.0
    limit = longest_step(lo, model, state, work)
    touching = constraints.note_gaps(model, state, work)
    state.counter[at.STEPS] += 1
    outcome, h, error, growth = find_step(model, state, work, remaining, limit, rate)
    if outcome != outcomes.ACCEPTED:
        return outcome
    fraction = events.first_touch(model, state, h, work) if model.contact else 1.0
    # Links stretched between what friction holds pull the harder the less they move.
    if fraction == events.STALLED:
        return outcomes.RATTLED
    smooth, last = takes_smooth(state, h, rate), h >= remaining
    if state.counter[at.STIFF] < 0:
        state.counter[at.STIFF] += 1
    elif not smooth:
        state.counter[at.STIFF] = int(h * rate > STIFF)
    if fraction < 1.0:
        growth = 1.0
    elif error > EASY:
        growth = min(growth, next_growth(state, h, error, smooth))
    # A step cut short by an event or by the time limit says nothing against a longer one.
    state.clock[at.STEP] = max(
        h * growth, 0.5 * state.clock[at.STEP] if h < state.clock[at.STEP] else SHORTEST_STEP
    )
    if fraction < 1.0:
        interpolate(state.q, work.stages.slope_q, h, fraction, new_q)
        interpolate(state.v, work.stages.slope_v, h, fraction, new_v)
    # A correction of contacts moves the base too, but no force does work on it.
    moved, way = 0.0, new_q[model.n] - state.q[model.n]
    if touching:
        moved = keep_touching(model, state, work)
        if moved < 0.0:
            return outcomes.RATTLED
    keep_if_left_alone(model, state, work, new_q, new_v, fraction * h)
    record_step(model, state, work, record, h, fraction)
    if 0 < lo < model.n:
        impulse = drive_impulse(model, state, work, h, fraction)
        close_milliseconds(model, state, work, h, fraction)
        feed.note_step(state, work, impulse, way)
    copy(new_q, state.q, lo)
    copy(new_v, state.v, lo)
    state.clock[at.TIME] = (
        until if last and fraction == 1.0 else state.clock[at.TIME] + fraction * h
    )
    if model.frictional:
        settle_held(lo, model, state, work)
    constraints.open_joints(lo, model, state)
    if (fraction < 1.0 or touching) and is_rattle(model, state, fraction, fraction * h):
        return outcomes.RATTLED
    if fraction < 1.0 or moved > STALE:
        return outcomes.TOUCHED
    state.clock[at.LAST_STEP] = 0.0 if smooth else h
    state.clock[at.LAST_ERROR] = max(error, EASY)
    # First same as last: the seventh stage is the next step's first.
    copy(work.stages.slope_v[6], work.stages.slope_v[0], 0)
    work.stages.drive[0] = work.stages.drive[6]
    return outcomes.ACCEPTED


@kernel
def keep_touching(model: Model, state: State, work: Work) -> float:
    """Undo what the step drifted off its contacts; by how much, over the error that it may have.

    Negative if something happened within the step, or if a contact that hardly says how the chain
    lies, its force all but through a hinge, asks for far more than drift.
    """
    stages = work.stages
    copy(stages.new_q, stages.q, 0)
    copy(stages.new_v, stages.v, 0)
    if not constraints.keep_contacts(model, state, work, stages.new_q, stages.new_v):
        return -1.0
    lo = state.counter[at.LO]
    before = feed.kinetic_of(lo, model, work, stages.new_q, stages.v)
    after = feed.kinetic_of(lo, model, work, stages.new_q, stages.new_v)
    for k in range(state.q.size):
        stages.q[k] -= stages.new_q[k]
        stages.v[k] -= stages.new_v[k]
        scale = 1.0 if k < model.n else model.side
        if not abs(stages.q[k]) <= FARTHEST * model.tolerance * scale:
            return -1.0
    state.account[at.IMPACTS] += before - after
    return step_error(model, state, work)


@kernel
def find_step(
    model: Model, state: State, work: Work, remaining: float, limit: float, rate: float
) -> tuple[int, float, float, float]:
    """Find a step that is exact enough, and that friction which holds holds through.

    Returns ACCEPTED or how else the step ended, its length [s], its error over what is allowed, and
    by how much the next one may be longer.
    """
    growth = LARGEST_GROWTH
    while True:
        h = min(state.clock[at.STEP], remaining, limit)
        if h < SHORTEST_STEP and h < remaining:
            if work.rows.counts[at.CONTACTS] == work.rows.counts[at.JOINT_STOPS]:
                return outcomes.TOO_SHORT, h, 0.0, growth
            # A contact that presses in one stage and not in the next, edge on edge.
            state.clock[at.STEP] = HOPELESS_STEP
            return outcomes.RATTLED, h, 0.0, growth
        smooth = takes_smooth(state, h, rate)
        error, good = try_step(model, state, work, h, rate if smooth else 0.0)
        if smooth and good * rate <= MILD:
            state.counter[at.STIFF] = -OTHERS
        if good < h:
            if not math.isfinite(error) and h < HOPELESS_STEP:
                return outcomes.BROKEN, h, error, growth
            if math.isfinite(error) and error > 1.0:
                growth = 1.0
            state.clock[at.STEP] = good
        elif not torn_loose(state.counter[at.LO], model, work, h):
            return outcomes.ACCEPTED, h, error, growth
        elif h <= BREAK_AWAY:
            return outcomes.RATTLED, h, error, growth
        else:
            growth = 1.0
            state.clock[at.STEP] = 0.5 * h


@inlined
def takes_smooth(state: State, h: float, rate: float) -> bool:
    """Whether a step is Chebyshev's: explicit ones would be unstable, or cost more."""
    return state.counter[at.STIFF] > 0 and h * rate > MILD


@kernel
def try_step(model: Model, state: State, work: Work, h: float, rate: float) -> tuple[float, float]:
    """Take the stages of a step of length ``h``: its error, and a length that may do [s].

    The error is over what is allowed. A length of ``h`` itself says that this step will do. At a
    ``rate`` of friction above 0 [1/s] the step is Chebyshev's.
    """
    if rate > 0.0:
        taken, order = chebyshev.smooth_stages(model, state, work, h, rate), chebyshev.ORDER
    else:
        taken, order = stages(model, state, work, h), ORDER
    if not taken:
        return 0.0, 0.25 * h
    error = step_error(model, state, work)
    if not math.isfinite(error):
        return error, 0.1 * h
    if error > 1.0:
        return error, h * max(0.2, 0.9 * inverse_root(error, order))
    return error, h


@inlined
def is_rattle(model: Model, state: State, fraction: float, time: float) -> bool:
    """Whether a step that ended after some time is the last of many that hardly came forward.

    What touched may have been parted again, to keep others in touch, and so without end.
    """
    if fraction == 1.0 or time * model.light_rate > INSTANT * model.tolerance:
        state.counter[at.QUICK_TOUCHES] = 0
        return False
    state.counter[at.QUICK_TOUCHES] += 1
    if state.counter[at.QUICK_TOUCHES] < TOUCHES:
        return False
    state.counter[at.QUICK_TOUCHES] = 0
    return True


@kernel
def settle_held(lo: int, model: Model, state: State, work: Work) -> None:
    """Undo the rounding of a step on components that friction holds."""
    for i in range(lo, model.n):
        if state.stuck[i] == 1:
            state.v[i] = 0.0


LONGEST_STEP = 0.1  # [s]
LONGER = 1.2  # times the time to the next stop
SOONEST_STOP = 1e-7  # [s] before which no stop is foreseen
PAST_EDGE = 2e-6  # [s] how far a step may reach beyond the end of a face
SHORTEST_BRAKE = 1e-7  # [s] the shortest step that ends where a component stops
EASY = 1e-4  # an error that allows the largest growth
# Lengths of steps times the rate of friction: beyond which its stability limits an explicit step,
# and up to which such a step is the cheaper one.
STIFF, MILD = 2.5, 2.0
OTHERS = 4  # explicit steps to be taken after a Chebyshev step that was no better
CAUTION = 0.8  # times the longest step that its error allows
LARGEST_GROWTH = 5.0
STALE = 0.1  # allowed errors by which a step may be moved without new accelerations
FARTHEST = 10.0  # tolerances by which contacts may move it at all
LEAST_GROWTH = 0.2  # after a step that was good enough, however hard it was to find


@kernel
def longest_step(lo: int, model: Model, state: State, work: Work) -> float:
    """How far a step may reach [s], going by the state alone.

    Not far beyond a joint's stop, the end of a face on which a corner slides, or the moment when
    friction stops a component: what happens there would only have the step repeated.
    """
    h = LONGEST_STEP
    if model.contact:
        h = min(h, time_past_stop(lo, model, state, work))
        h = min(h, PAST_EDGE + time_to_edge(lo, model, work, state.v))
    if model.frictional:
        h = min(h, max(state.clock[at.BRAKE], SHORTEST_BRAKE))
    if state.counter[at.SLIPPING] != 0 and lo > 0:
        h = min(h, feed.time_to_change(model, state, work.stages.slope_v[0]))
        if math.isinf(model.force_limit):
            left = state.feed[at.SINCE] + ledger.patience(model) - state.clock[at.TIME]
            h = min(h, max(left, feed.SOONEST))
    return h


@kernel
def time_past_stop(lo: int, model: Model, state: State, work: Work) -> float:
    """Time until the first open joint is a little beyond its stop, as it accelerates now [s].

    Not so far that magnets, of which only stops keep the poles apart, would all but meet.
    """
    soonest = LONGEST_STEP
    for k in range(first_joint(lo), model.n):
        if state.lock[k] != 0:
            continue
        angle = state.q[k] - state.q[k - 1]
        rate = joint_rate(lo, state.v, k)
        acceleration = joint_rate(lo, work.stages.slope_v[0], k)
        for sign in (-1.0, 1.0):
            gap = jacobian.HALF_PI - sign * angle
            toward, push = sign * rate, sign * acceleration
            root = toward * toward + 2.0 * push * gap
            # The first t > 0 with r t + a t²/2 = g, in the form that does not cancel.
            t = LONGEST_STEP
            if toward < 0.0:
                if push > 0.0:
                    t = (math.sqrt(root) - toward) / push
            elif root >= 0.0 and toward + math.sqrt(root) > 0.0:
                t = 2.0 * gap / (toward + math.sqrt(root))
            if t < LONGEST_STEP:
                soonest = min(soonest, LONGER * t, t + model.past_stop / math.sqrt(root))
    return max(soonest, LONGER * SOONEST_STOP)


@kernel
def time_to_edge(lo: int, model: Model, work: Work, v: Array) -> float:
    """Time until a corner that slides along a face, or around an edge, is at its end [s].

    There the normal begins or ceases to turn. At the present velocities; infinite if nothing
    slides. Needs `place_boxes` and centre velocities.
    """
    soonest = math.inf
    for r in range(work.rows.counts[at.JOINT_STOPS], work.rows.counts[at.CONTACTS]):
        box, other, k = int(work.rows.id[r, 0]), int(work.rows.id[r, 1]), int(work.rows.id[r, 2])
        ox, oy = boxes.corner(work, other, k)
        x = work.boxes.x[other] + ox - work.boxes.x[box]
        y = work.boxes.y[other] + oy - work.boxes.y[box]
        vx, vy, w = jacobian.corner_velocity(lo, model, work, box, other, ox, oy, v)
        vx += w * y
        vy -= w * x
        c, s = work.boxes.c[box], work.boxes.s[box]
        along, across = c * x + s * y, c * y - s * x
        slide, rise = c * vx + s * vy, c * vy - s * vx
        a, b = work.boxes.a[box], work.boxes.b[box]
        beside, above = abs(along) > a, abs(across) > b
        if beside == above or above:
            soonest = min(soonest, time_to_end(along, a, slide))
        if beside == above or beside:
            soonest = min(soonest, time_to_end(across, b, rise))
    return soonest


@inlined
def time_to_end(x: float, end: float, rate: float) -> float:
    """Time until a point at x is at one of the ends −end and end of a face [s]."""
    goal = math.copysign(end, x if abs(x) > end else rate)
    time = (goal - x) / rate if rate != 0.0 else math.inf
    return time if time > 0.0 else math.inf


@inlined
def next_growth(state: State, h: float, error: float, smooth: bool) -> float:
    """Return how much longer the next step may be, going by this one's error and its trend.

    Gustafsson's predictive controller (Hairer and Wanner, Solving ODEs II, IV.8): towards a stop
    magnets pull ever harder, and a rule that knows only the last error has every other step
    rejected.
    """
    if smooth:
        return CAUTION * inverse_root(error, chebyshev.ORDER)
    growth = CAUTION * inverse_root(error, ORDER)
    before = state.clock[at.LAST_STEP]
    if before > 0.0:
        trend = inverse_root(error / state.clock[at.LAST_ERROR], ORDER)
        growth = min(growth, growth * trend * h / before)
    return max(growth, LEAST_GROWTH)
