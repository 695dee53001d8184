"""Integrate one chain to a given time, or to rest.

Between events the accelerations are smooth and Dormand and Prince's 5(4) pair takes steps whose
error it controls. A step ends where something new touches; there the impact is a projection of
the velocities and integration starts afresh, at full order. Joints at their stops move as rigid
bodies, which the pair keeps exactly; squares that touch are kept from drifting after each step.
Where something rattles, touching again as soon as it parted, Moreau's time-stepping takes over
for a few steps: of first order, but it needs no events.
"""

import math

from magfold_env.engine import outcomes
from magfold_env.engine.chain.feed import is_free
from magfold_env.engine.chain.momentum import keep_if_left_alone
from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.contact import constraints, events
from magfold_env.engine.friction.held import first_accelerations, is_at_rest, torn_loose
from magfold_env.engine.friction.stopping import creeps, stop_slow
from magfold_env.engine.state import (
    CONTACTS,
    FRESH,
    LAST_ERROR,
    LAST_STEP,
    LO,
    MOREAU_LEFT,
    QUICK_TOUCHES,
    STEP,
    STEPS,
    TIME,
    Array,
    Model,
    Record,
    State,
    Work,
    copy,
    is_finite,
)
from magfold_env.engine.stepping.moreau import moreau_step
from magfold_env.engine.stepping.recorder import has_room, record_rest, record_step
from magfold_env.engine.stepping.stages import ORDER, interpolate, stages, step_error
from magfold_env.engine.stepping.step_limits import EASY, LONGEST_STEP, longest_step, next_growth

SHORTEST_STEP = 1e-13  # [s]
BREAK_AWAY = 1e-6  # [s] how exactly the moment is found when friction no longer holds
HOPELESS_STEP = 1e-9  # [s] not finite even here: broken
RUNAWAY = 300.0  # times a typical rate: faster than any force but that of a feed can make it
PATIENCE = 4  # Moreau steps after a rattle
INSTANT = 0.1  # tolerances of a typical rate: time in which next to nothing happens
TOUCHES = 20  # in a row, with no more than an instant before each: a rattle


@kernel
def advance(model: Model, state: State, work: Work, record: Record, until: float) -> int:
    """Integrate until the time ``until`` [s], rest, or breakdown; returns which.

    `FULL` means that the record must be emptied; call again to go on. While the tube feeds, a
    chain at rest relative to it is moved on to ``until`` at once.
    """
    while state.clock[TIME] < until:
        if outcomes.out_of_work(model, state):
            return outcomes.CAPPED
        if not has_room(record, state, LONGEST_STEP):
            return outcomes.FULL
        ended, anew = gather_constraints(model, state, work)
        if ended != outcomes.REACHED:
            return ended
        acceleration = work.stages.slope_v[0]
        if anew and not renew_accelerations(model, state, work, acceleration):
            return outcomes.NO_SOLUTION
        if model.frictional:
            stop_slow(model, state, work, acceleration)
        copy(state.v, work.stages.slope_q[0], 0)
        if is_at_rest(model, state, work, acceleration):
            return rest(model, state, record, until)
        rattling = state.counter[MOREAU_LEFT] > 0
        if rattling or (model.frictional and creeps(model, state, work, acceleration)):
            outcome = moreau_step(model, state, work, record, until, rattling)
            state.counter[MOREAU_LEFT] -= int(rattling)
        else:
            outcome = step(model, state, work, record, until)
        ended = after_step(model, state, outcome)
        if ended != outcomes.REACHED:
            return ended
    return outcomes.REACHED


@kernel
def gather_constraints(model: Model, state: State, work: Work) -> tuple[int, bool]:
    """Find what acts in the coming step; REACHED if it may be taken, else how it all ends.

    And whether accelerations must be found anew. Impacts happen here.
    """
    rows = work.rows.counts[CONTACTS]
    begun = constraints.begin_step(model, state, work)
    if begun == constraints.CROWDED:
        return outcomes.TOO_CROWDED, False
    if begun == constraints.UNSOLVED:
        return outcomes.NO_SOLUTION, False
    anew = state.counter[FRESH] == 1 or begun != constraints.OK or state.counter[MOREAU_LEFT] > 0
    # What only comes to lie on another, without an impact, is pushed by it all the same.
    anew = anew or work.rows.counts[CONTACTS] != rows
    anew = anew or (model.frictional and resting(state.counter[LO], state))
    return outcomes.REACHED, anew


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
def rest(model: Model, state: State, record: Record, until: float) -> int:
    """End the run of a chain at rest; one that a tube holds goes on with it, as far as asked."""
    n = model.n
    if is_free(state.counter[LO], model) or not model.tube:
        return outcomes.RESTED
    if not record_rest(record, state, until):
        return outcomes.FULL
    state.q[n] += state.v[n] * (until - state.clock[TIME])
    state.clock[TIME] = until
    return outcomes.REACHED


@kernel
def after_step(model: Model, state: State, outcome: int) -> int:
    """Note how a step ended; REACHED if another may follow, else how it all ends."""
    if not is_finite(state.v):
        return outcomes.NOT_FINITE
    if runs_away(model, state):
        return outcomes.JAMMED
    state.counter[FRESH] = int(outcome != outcomes.ACCEPTED)
    if outcome != outcomes.ACCEPTED:
        state.clock[LAST_STEP] = 0.0
    if outcome == outcomes.RATTLED:
        state.counter[MOREAU_LEFT] = PATIENCE
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
    for k in range(state.counter[LO], n):
        if abs(state.v[k]) > RUNAWAY * limit:
            return True
    return False


@kernel
def step(model: Model, state: State, work: Work, record: Record, until: float) -> int:
    """Take one step from the state, whose accelerations are in ``work.stages.slope_v[0]``."""
    lo, remaining = state.counter[LO], until - state.clock[TIME]
    new_q, new_v = work.stages.new_q, work.stages.new_v
    growth, limit = 5.0, longest_step(lo, model, state, work)
    touching = constraints.note_gaps(model, state, work)
    state.counter[STEPS] += 1
    while True:
        h = min(state.clock[STEP], remaining, limit)
        last = h >= remaining
        if h < SHORTEST_STEP and not last:
            return outcomes.TOO_SHORT
        error, good = try_step(model, state, work, h)
        if good < h:
            if not math.isfinite(error) and h < HOPELESS_STEP:
                return outcomes.BROKEN
            if math.isfinite(error) and error > 1.0:
                growth = 1.0
            state.clock[STEP] = good
            continue
        torn = torn_loose(lo, model, work, h)
        if torn and h > BREAK_AWAY:
            growth = 1.0
            state.clock[STEP] = 0.5 * h
            continue
        fraction = events.first_touch(model, state, h, work) if model.contact else 1.0
        # Links stretched between what friction holds pull the harder the less they move.
        if torn or fraction == events.STALLED:
            return outcomes.RATTLED
        break
    if fraction < 1.0:
        growth = 1.0
    elif error > EASY:
        growth = min(growth, next_growth(state, h, error))
    # A step cut short by an event or by the time limit says nothing against a longer one.
    state.clock[STEP] = max(h * growth, 0.5 * state.clock[STEP] if h < state.clock[STEP] else 0.0)
    if fraction < 1.0:
        interpolate(state.q, work.stages.slope_q, h, fraction, new_q)
        interpolate(state.v, work.stages.slope_v, h, fraction, new_v)
    if touching and not constraints.keep_contacts(model, state, work, new_q, new_v):
        return outcomes.RATTLED
    keep_if_left_alone(model, state, work, new_q, new_v, fraction * h)
    record_step(record, state, work, h, fraction)
    copy(new_q, state.q, lo)
    copy(new_v, state.v, lo)
    state.clock[TIME] = until if last and fraction == 1.0 else state.clock[TIME] + fraction * h
    if model.frictional:
        settle_held(lo, model, state, work)
    constraints.open_joints(lo, model, state)
    if fraction < 1.0 or touching:
        rattle = is_rattle(model, state, fraction, fraction * h)
        return outcomes.RATTLED if rattle else outcomes.TOUCHED
    state.clock[LAST_STEP] = h
    state.clock[LAST_ERROR] = max(error, EASY)
    # First same as last: the seventh stage is the next step's first.
    copy(work.stages.slope_v[6], work.stages.slope_v[0], 0)
    return outcomes.ACCEPTED


@kernel
def try_step(model: Model, state: State, work: Work, h: float) -> tuple[float, float]:
    """Take the stages of a step of length ``h``: its error, and a length that may do [s].

    The error is over what is allowed. A length of ``h`` itself says that this step will do.
    """
    if not stages(model, state, work, h):
        return 0.0, 0.25 * h
    error = step_error(model, state, work, h)
    if not math.isfinite(error):
        return error, 0.1 * h
    if error > 1.0:
        return error, h * max(0.2, 0.9 * error ** (-1.0 / ORDER))
    return error, h


@inlined
def is_rattle(model: Model, state: State, fraction: float, time: float) -> bool:
    """Whether a step that ended after some time is the last of many that hardly came forward.

    What touched may have been parted again, to keep others in touch, and so without end.
    """
    if fraction == 1.0 or time * model.light_rate > INSTANT * model.tolerance:
        state.counter[QUICK_TOUCHES] = 0
        return False
    state.counter[QUICK_TOUCHES] += 1
    if state.counter[QUICK_TOUCHES] < TOUCHES:
        return False
    state.counter[QUICK_TOUCHES] = 0
    return True


@kernel
def settle_held(lo: int, model: Model, state: State, work: Work) -> None:
    """Undo the rounding of a step on components that friction holds."""
    for i in range(lo, model.n):
        if state.stuck[i] == 1:
            state.v[i] = 0.0
