"""Integrate the motion of one chain to a given time, or to rest.

Between events the accelerations are smooth, and Dormand and Prince's 5(4) pair takes steps with
error control. A step ends when something new touches; the impact then projects the velocities, and
integration restarts at full order. Components joined at stops move exactly as rigid bodies;
touching squares are corrected for drift after each step. If something rattles (touches again as
soon as it separates), Moreau's time-stepping takes over for a few steps; it is of first order, but
needs no events.

Every part of a step returns an outcome; if it is negative, the integration continues.
"""

import math

from magfold_env.engine import indices as ix
from magfold_env.engine import outcomes
from magfold_env.engine.chain import feed, ledger
from magfold_env.engine.chain.momentum import keep_if_left_alone, kinetic_of, momentum_along
from magfold_env.engine.chain.tube import is_free, is_partly_out
from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.contact import constraints, events
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
from magfold_env.engine.stepping.recorder import has_room, record_line, record_step
from magfold_env.engine.stepping.stages import (
    ORDER,
    close_milliseconds,
    drive_impulse,
    interpolate,
    stages,
    step_error,
)
from magfold_env.engine.stepping.step_length import (
    LARGEST_GROWTH,
    LONGEST_STEP,
    MILD,
    OTHERS,
    SHORTEST_STEP,
    longest_step,
    plan_next,
    takes_smooth,
)

BREAK_AWAY = 1e-6  # [s] precision of the moment at which friction no longer holds
HOPELESS_STEP = 1e-9  # [s] a step this short that is not finite means a breakdown
STALE = 0.1  # correction of a step, in allowed errors, that needs no new accelerations
FARTHEST = 10.0  # largest correction by contacts, in tolerances
RUNAWAY = 300.0  # times a typical rate: only a feed's force can make a component faster
PATIENCE = 4  # Moreau steps after a rattle
INSTANT = 0.1  # tolerances of a typical rate: a time in which almost nothing happens
TOUCHES = 20  # in a row, with at most an instant before each, are a rattle
LOW_BITS = 2**58 - 1


@kernel
def advance(model: Model, state: State, work: Work, record: Record, until: float, turn: int) -> int:
    """Integrate until the time ``until`` [s], rest, or a breakdown; return the outcome.

    The outcome is PAUSED when the record is full or ``turn`` evaluations have been made; the caller
    then empties the record and calls again. While the tube feeds, a chain at rest relative to the
    base moves to ``until`` in one step. REACHED before that time means that the drive must restart.
    """
    while state.clock[ix.TIME] < until:
        if outcomes.out_of_work(model, state):
            return outcomes.CAPPED
        if state.counter[ix.EVALUATIONS] >= turn or not has_room(record, state, LONGEST_STEP):
            return outcomes.PAUSED
        outcome = find_contacts(model, state, work)
        if outcome < 0:
            outcome = find_accelerations(model, state, work)
        if outcome < 0:
            outcome = keep_driving(model, state, work)
        if outcome < 0:
            if stays_at_rest(model, state, work):
                outcome = rest(model, state, work, record, until)
            else:
                outcome = note_outcome(model, state, step(model, state, work, record, until))
        if outcome >= 0:
            return outcome
    return outcomes.REACHED


# --- before a step --------------------------------------------------------------------------


@kernel
def find_contacts(model: Model, state: State, work: Work) -> int:
    """Find the contacts of the coming step, and apply impacts."""
    before = signature(work)
    begun = constraints.begin_step(model, state, work)
    if begun == constraints.CROWDED:
        return outcomes.TOO_CROWDED
    if begun == constraints.UNSOLVED:
        return outcomes.NO_SOLUTION
    # Even without an impact, a new contact pushes and needs new accelerations.
    anew = begun != constraints.OK or state.counter[ix.MOREAU_LEFT] > 0
    anew = anew or signature(work) != before
    if anew or (model.frictional and any_held(state.counter[ix.N_HELD], state)):
        state.counter[ix.FRESH] = 1
    return outcomes.ACCEPTED


@inlined
def signature(work: Work) -> int:
    """Return a hash of the set of contacts."""
    found = work.rows.counts[ix.CONTACTS]
    for r in range(work.rows.counts[ix.CONTACTS]):
        for k in range(2 if r < work.rows.counts[ix.JOINT_STOPS] else 3):
            # The hash is truncated, so that the next product does not overflow.
            found = (31 * found + work.rows.id[r, k]) & LOW_BITS
    return found


@inlined
def any_held(lo: int, state: State) -> bool:
    """Whether friction held any component in the last step."""
    for i in range(lo, state.stuck.size):
        if state.stuck[i] == 1:
            return True
    return False


@kernel
def find_accelerations(model: Model, state: State, work: Work) -> int:
    """Find the accelerations of the state, and stop the components that friction is about to stop.

    Unless the counter FRESH is 1, the last step's final accelerations are used.
    """
    acceleration = work.stages.slope_v[0]
    if state.counter[ix.FRESH] == 1 and not end_hops(model, state, work, acceleration):
        return outcomes.NO_SOLUTION
    if model.frictional and stop_slow(model, state, work, acceleration):
        state.counter[ix.FRESH] = 1
    copy(state.v, work.stages.slope_q[0], 0)
    return outcomes.ACCEPTED


@kernel
def end_hops(model: Model, state: State, work: Work, out: Array) -> bool:
    """Find the state's accelerations and end hops; return whether the accelerations were found."""
    # Every round holds at least one more joint or contact.
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
def keep_driving(model: Model, state: State, work: Work) -> int:
    """Check whether the drive continues in its state; return REACHED if it must restart."""
    if not is_partly_out(model, state):
        return outcomes.ACCEPTED
    anew = state.counter[ix.FRESH] == 1
    if not feed.drives_on(model, state, work, work.stages.slope_v[0], anew):
        return outcomes.REACHED
    if state.counter[ix.SLIPPING] != 0 and ledger.patience_left(model, state) <= 0.0:
        return outcomes.LOCKED if math.isinf(model.force_limit) else outcomes.JAMMED
    return outcomes.ACCEPTED


# --- rest -----------------------------------------------------------------------------------


@inlined
def stays_at_rest(model: Model, state: State, work: Work) -> bool:
    """Whether nothing will move again, except with a base that the tube feeds."""
    if state.clock[ix.BUMP] < state.clock[ix.END]:
        return False
    if is_partly_out(model, state):
        # A chain at rest relative to its base may hit a fixed solid.
        speed = state.v[model.n]
        meets = speed < 0.0 or (speed > 0.0 and model.obstacles.shape[0] > ix.WALLS)
        if meets or state.counter[ix.SLIPPING] != 0:
            return False
    return is_at_rest(model, state, work, work.stages.slope_v[0])


@kernel
def rest(model: Model, state: State, work: Work, record: Record, until: float) -> int:
    """End the run of a chain at rest; if the tube feeds it, move it with the base to ``until``."""
    if is_free(state.counter[ix.N_HELD], model) or not model.tube or state.counter[ix.PARKED] == 1:
        return outcomes.RESTED
    force = 0.0
    if feed.drives(model, state):
        force = feed.borne(model, state, float(work.stages.drive[0]))
    return move_with_base(model, state, work, record, until, force)


@kernel
def move_with_base(
    model: Model, state: State, work: Work, record: Record, until: float, force: float
) -> int:
    """Move a chain with its base to the time ``until`` [s]; the drive exerts ``force`` [N]."""
    n, time, end = model.n, until - state.clock[ix.TIME], work.moreau.new_q
    copy(state.q, end, 0)
    end[n] += state.v[n] * time
    if not record_line(record, state, until, end, state.v, force * time):
        return outcomes.PAUSED
    ledger.pass_time(state, until, force * time)
    feed.note_step(state, work, force * time, state.v[n] * time)
    state.q[n] = end[n]
    state.clock[ix.TIME] = until
    return outcomes.REACHED


# --- a step ---------------------------------------------------------------------------------


@inlined
def step(model: Model, state: State, work: Work, record: Record, until: float) -> int:
    """Take one step from the state, whose accelerations are in ``work.stages.slope_v[0]``."""
    rattling = state.counter[ix.MOREAU_LEFT] > 0
    if rattling or (model.frictional and is_creeping(model, state, work, work.stages.slope_v[0])):
        outcome = moreau_step(model, state, work, record, until, rattling)
        state.counter[ix.MOREAU_LEFT] -= int(rattling)
        return outcome
    return smooth_step(model, state, work, record, until)


@kernel
def note_outcome(model: Model, state: State, outcome: int) -> int:
    """Note how a step ended, and check that its end is possible.

    A component has run away if it turns impossibly fast because a feed drives jammed parts.
    """
    n = model.n
    if not is_finite(state.v):
        return outcomes.NOT_FINITE
    if model.tube:
        limit = model.fastest_rate + (abs(state.v[n]) + abs(state.v[n + 1])) / model.side
        for k in range(state.counter[ix.N_HELD], n):
            if abs(state.v[k]) > RUNAWAY * limit:
                return outcomes.RAN_AWAY
    state.counter[ix.FRESH] = int(outcome != outcomes.ACCEPTED)
    if outcome != outcomes.ACCEPTED:
        state.clock[ix.LAST_STEP] = 0.0
    if outcome == outcomes.RATTLED:
        state.counter[ix.MOREAU_LEFT] = PATIENCE
    if outcome < 0 and is_partly_out(model, state) and state.counter[ix.FEEDING] == 0:
        return outcomes.REACHED
    return outcome


@kernel
def smooth_step(model: Model, state: State, work: Work, record: Record, until: float) -> int:
    """Take one Runge-Kutta step, up to the first new touch."""
    rate = 0.0
    if model.frictional:
        rate = chebyshev.friction_rate(state.counter[ix.N_HELD], model, state, work)
    limit = min(longest_step(model, state, work), until - state.clock[ix.TIME])
    touching = constraints.note_gaps(model, state, work)
    state.counter[ix.STEPS] += 1
    outcome, h, error, growth = attempt_step(model, state, work, limit, rate)
    if outcome != outcomes.ACCEPTED:
        return outcome
    fraction = events.first_touch(model, state, h, work) if model.contact else 1.0
    # Links stretched between components that friction holds pull harder the less they move.
    if fraction == events.STALLED:
        return outcomes.RATTLED
    plan_next(state, h, fraction, rate, error, growth)
    if fraction < 1.0:
        interpolate(state.q, work.stages.slope_q, h, fraction, work.stages.new_q)
        interpolate(state.v, work.stages.slope_v, h, fraction, work.stages.new_v)
    # Corrections of contacts also move the base, but the drive does no work in them.
    way = work.stages.new_q[model.n] - state.q[model.n]
    moved = keep_touching(model, state, work) if touching else 0.0
    if moved < 0.0:
        return outcomes.RATTLED
    accept_step(model, state, work, record, h, fraction, way, until)
    if (fraction < 1.0 or touching) and is_rattle(model, state, fraction, fraction * h):
        return outcomes.RATTLED
    if fraction < 1.0 or moved > STALE:
        return outcomes.TOUCHED
    # First same as last: the seventh stage is the first one of the next step.
    copy(work.stages.slope_v[6], work.stages.slope_v[0], 0)
    work.stages.drive[0] = work.stages.drive[6]
    return outcomes.ACCEPTED


@kernel
def attempt_step(
    model: Model, state: State, work: Work, limit: float, rate: float
) -> tuple[int, float, float, float]:
    """Find a step that is accurate enough and at whose end friction still holds.

    It is a Chebyshev step if friction's ``rate`` [1/s] requires one. Returns ACCEPTED or another
    outcome, the step's length [s], its error relative to the allowed one, and the factor by which
    the next step may be longer.
    """
    growth = LARGEST_GROWTH
    # A time limit may have cut the last of Moreau's steps almost to nothing.
    state.clock[ix.STEP] = max(state.clock[ix.STEP], SHORTEST_STEP)
    while True:
        h = min(state.clock[ix.STEP], limit)
        if h < SHORTEST_STEP and h < limit:
            if work.rows.counts[ix.CONTACTS] == work.rows.counts[ix.JOINT_STOPS]:
                return outcomes.UNDERFLOW, h, 0.0, growth
            # An edge-on-edge contact presses in one stage and not in the next.
            state.clock[ix.STEP] = HOPELESS_STEP
            return outcomes.RATTLED, h, 0.0, growth
        smooth = takes_smooth(state, h, rate)
        if smooth:
            taken, order = chebyshev.smooth_stages(model, state, work, h, rate), chebyshev.ORDER
        else:
            taken, order = stages(model, state, work, h), ORDER
        error = step_error(model, state, work) if taken else math.inf
        if error <= 1.0:
            if not torn_loose(state.counter[ix.N_HELD], model, work, h):
                return outcomes.ACCEPTED, h, error, growth
            if h <= BREAK_AWAY:
                return outcomes.RATTLED, h, error, growth
            growth, state.clock[ix.STEP] = 1.0, 0.5 * h
            continue
        if math.isfinite(error):
            growth, shorter = 1.0, h * max(0.2, 0.9 * inverse_root(error, order))
        elif taken and h < HOPELESS_STEP:
            return outcomes.NOT_FINITE, h, error, growth
        else:
            shorter = (0.1 if taken else 0.25) * h
        if smooth and shorter * rate <= MILD:
            state.counter[ix.STIFF] = -OTHERS
        state.clock[ix.STEP] = shorter


@kernel
def keep_touching(model: Model, state: State, work: Work) -> float:
    """Correct the step's errors at contacts; return the correction relative to the allowed error.

    The result is negative if an event happened within the step, or if a contact whose force points
    almost through a hinge, and so hardly affects the pose, requires far too large a correction.
    """
    stages = work.stages
    copy(stages.new_q, stages.q, 0)
    copy(stages.new_v, stages.v, 0)
    if not constraints.keep_contacts(model, state, work, stages.new_q, stages.new_v):
        return -1.0
    lo = state.counter[ix.N_HELD]
    lost = kinetic_of(lo, model, work, stages.new_q, stages.v)
    lost -= kinetic_of(lo, model, work, stages.new_q, stages.new_v)
    impulse = momentum_along(lo, model, work, stages.new_v)
    impulse -= momentum_along(lo, model, work, stages.v)
    for k in range(state.q.size):
        stages.q[k] -= stages.new_q[k]
        stages.v[k] -= stages.new_v[k]
        scale = 1.0 if k < model.n else model.side
        if not abs(stages.q[k]) <= FARTHEST * model.tolerance * scale:
            return -1.0
    if feed.drives(model, state):
        # Where normals turn within the step, this takes back what an impact passed on to the drive.
        impulse -= constraints.passed_on(model, work.rows.counts[ix.CONTACTS], work)
        ledger.note_impulse(state, impulse, float(state.v[model.n]))
        lost += impulse * state.v[model.n]
    state.account[ix.IMPACTS] += lost
    return step_error(model, state, work)


@kernel
def accept_step(
    model: Model, state: State, work: Work, record: Record, h: float, fraction: float, way: float,
    until: float,
) -> None:  # fmt: skip
    """Make the end of a step the new state; ``way`` is the base's displacement in the step [m].

    Records the step's frames, and the drive's impulse and work in it.
    """
    lo, new_q, new_v = state.counter[ix.N_HELD], work.stages.new_q, work.stages.new_v
    keep_if_left_alone(model, state, work, new_q, new_v, fraction * h)
    record_step(model, state, work, record, h, fraction)
    if is_partly_out(model, state):
        impulse = drive_impulse(model, state, work, h, fraction)
        close_milliseconds(model, state, work, h, fraction)
        feed.note_step(state, work, impulse, way)
    copy(new_q, state.q, lo)
    copy(new_v, state.v, lo)
    last = h >= until - state.clock[ix.TIME] and fraction == 1.0
    state.clock[ix.TIME] = until if last else state.clock[ix.TIME] + fraction * h
    if model.frictional:
        for i in range(lo, model.n):
            if state.stuck[i] == 1:
                state.v[i] = 0.0  # removes rounding errors
    constraints.open_joints(lo, model, state)


@inlined
def is_rattle(model: Model, state: State, fraction: float, time: float) -> bool:
    """Whether a step of length ``time`` [s] is the last of many that hardly advanced.

    Keeping some contacts closed may reopen others, again and again.
    """
    if fraction == 1.0 or time * model.fastest_rate > INSTANT * model.tolerance:
        state.counter[ix.QUICK_TOUCHES] = 0
        return False
    state.counter[ix.QUICK_TOUCHES] += 1
    if state.counter[ix.QUICK_TOUCHES] < TOUCHES:
        return False
    state.counter[ix.QUICK_TOUCHES] = 0
    return True
