"""Integrate one chain to a given time, or to rest.

Between events the accelerations are smooth and Dormand and Prince's 5(4) pair takes steps whose
error it controls. A step ends where something new touches; there the impact is a projection of
the velocities and integration starts afresh, at full order. Joints at their stops move as rigid
bodies, which the pair keeps exactly; squares that touch are kept from drifting after each step.
Where something rattles, touching again as soon as it parted, Moreau's time-stepping takes over
for a few steps: of first order, but it needs no events.
"""

from __future__ import annotations

import math

from magfold_env.engine.arrays import copy, is_finite
from magfold_env.engine.chain.feed import is_free
from magfold_env.engine.chain.momentum import keep_if_left_alone
from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.contact.constraints import (
    CROWDED,
    IMPACT,
    OK,
    UNSOLVED,
    begin_step,
    keep_contacts,
    note_gaps,
    open_joints,
)
from magfold_env.engine.contact.events import STALLED, first_touch, interpolate
from magfold_env.engine.contact.hops import end_hops
from magfold_env.engine.friction.held import first_accelerations, torn_loose
from magfold_env.engine.friction.rest import is_at_rest
from magfold_env.engine.friction.stopping import creeps, stop_slow
from magfold_env.engine.outcomes import (
    ACCEPTED,
    BROKEN,
    CAPPED,
    FULL,
    JAMMED,
    NO_SOLUTION,
    NOT_FINITE,
    RATTLED,
    REACHED,
    RESTED,
    TOO_CROWDED,
    TOO_SHORT,
    TOUCHED,
    UNDERFLOW,
    UNSOLVABLE,
)
from magfold_env.engine.state import (
    FRESH,
    IN_VAIN,
    LAST_ERROR,
    LAST_STEP,
    LO,
    STEP,
    STEPS,
    TIME,
    TOUCHY,
    Model,
    Record,
    State,
    Work,
)
from magfold_env.engine.stepping import dormand_prince as dp
from magfold_env.engine.stepping.moreau import moreau_step
from magfold_env.engine.stepping.recorder import has_room, record_rest, record_step
from magfold_env.engine.stepping.stages import stages, step_error
from magfold_env.engine.stepping.step_limits import EASY, LONGEST_STEP, longest_step, next_growth
from magfold_env.engine.work_cap import out_of_work

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
    lo, n = state.counter[LO], model.n
    while state.clock[TIME] < until:
        if out_of_work(model, state):
            return CAPPED
        if not has_room(record, state, LONGEST_STEP):
            return FULL
        rows = work.row_count[1]
        begun = begin_step(model, state, work)
        if begun == CROWDED:
            return TOO_CROWDED
        if begun == UNSOLVED:
            return NO_SOLUTION
        touchy = state.counter[TOUCHY] > 0
        anew = state.counter[FRESH] == 1 or begun != OK or touchy
        # What only comes to lie on another, without an impact, is pushed by it all the same.
        anew = anew or work.row_count[1] != rows
        anew = anew or (model.frictional and resting(lo, state))
        if anew and not fresh_accelerations(model, state, work):
            return NO_SOLUTION
        if model.frictional:
            stop_slow(model, state, work, work.slope_v[0])
        copy(state.v, work.slope_q[0], 0)
        if is_at_rest(model, state, work, work.slope_v[0]):
            if is_free(lo, model) or not model.tube:
                return RESTED
            if not record_rest(record, model, state, until):
                return FULL
            state.q[n] += state.v[n] * (until - state.clock[TIME])
            state.clock[TIME] = until
            return REACHED
        if touchy or (model.frictional and creeps(model, state, work, work.slope_v[0])):
            outcome = moreau_step(model, state, work, record, until, touchy)
            state.counter[TOUCHY] -= int(touchy)
        else:
            outcome = step(model, state, work, record, until)
        if not is_finite(state.v):
            return NOT_FINITE
        if runs_away(model, state):
            return JAMMED
        if outcome == ACCEPTED:
            state.counter[FRESH] = 0
        else:
            state.counter[FRESH] = 1
            state.clock[LAST_STEP] = 0.0
        if outcome == RATTLED:
            state.counter[TOUCHY] = PATIENCE
        elif outcome == TOO_SHORT:
            return UNDERFLOW
        elif outcome == UNSOLVABLE:
            return NO_SOLUTION
        elif outcome == BROKEN:
            return NOT_FINITE
    return REACHED


@kernel
def fresh_accelerations(model: Model, state: State, work: Work) -> bool:
    """Accelerations of the state into ``work.slope_v[0]``; ends hops. False if not found."""
    # Every round holds something more.
    for _ in range(2 * model.n):
        if not first_accelerations(model, state, work, work.slope_v[0]):
            return False
        hops = end_hops(model, state, work, work.slope_v[0]) if model.contact else OK
        if hops == OK:
            return True
        if hops != IMPACT:
            break
    return first_accelerations(model, state, work, work.slope_v[0])


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
def resting(lo: int, state: State) -> bool:
    """Whether friction held any component in the last step."""
    for i in range(lo, state.stuck.size):
        if state.stuck[i] == 1:
            return True
    return False


@kernel
def step(model: Model, state: State, work: Work, record: Record, until: float) -> int:
    """Take one step from the state, whose accelerations are in ``work.slope_v[0]``."""
    lo, remaining = state.counter[LO], until - state.clock[TIME]
    growth, limit = 5.0, longest_step(lo, model, state, work)
    touching = note_gaps(model, state, work)
    state.counter[STEPS] += 1
    while True:
        h = min(state.clock[STEP], remaining, limit)
        last = h >= remaining
        if h < SHORTEST_STEP and not last:
            return TOO_SHORT
        if not stages(model, state, work, h):
            state.clock[STEP] = 0.25 * h
            continue
        error = step_error(model, state, work, h)
        if not math.isfinite(error):
            if h < HOPELESS_STEP:
                return BROKEN
            state.clock[STEP] = 0.1 * h
            continue
        if error > 1.0:
            growth = 1.0
            state.clock[STEP] = h * max(0.2, 0.9 * error ** (-1.0 / dp.ORDER))
            continue
        torn = torn_loose(lo, model, work, h)
        if torn and h > BREAK_AWAY:
            growth = 1.0
            state.clock[STEP] = 0.5 * h
            continue
        fraction = first_touch(model, state, h, work) if model.contact else 1.0
        # Links stretched between what friction holds pull the harder the less they move.
        if torn or fraction == STALLED:
            return RATTLED
        break
    if fraction < 1.0:
        growth = 1.0
    elif error > EASY:
        growth = min(growth, next_growth(state, h, error))
    # A step cut short by an event or by the time limit says nothing against a longer one.
    state.clock[STEP] = max(h * growth, 0.5 * state.clock[STEP] if h < state.clock[STEP] else 0.0)
    if fraction < 1.0:
        interpolate(state.q, work.slope_q, h, fraction, work.new_q)
        interpolate(state.v, work.slope_v, h, fraction, work.new_v)
    if touching and not keep_contacts(model, state, work, work.new_q, work.new_v):
        return RATTLED
    keep_if_left_alone(model, state, work, work.new_q, fraction * h)
    record_step(record, state, work, h, fraction)
    copy(work.new_q, state.q, lo)
    copy(work.new_v, state.v, lo)
    state.clock[TIME] = until if last and fraction == 1.0 else state.clock[TIME] + fraction * h
    if model.frictional:
        settle_held(lo, model, state, work)
    open_joints(lo, model, state)
    if fraction < 1.0 or touching:
        return RATTLED if in_vain(model, state, fraction, fraction * h) else TOUCHED
    state.clock[LAST_STEP] = h
    state.clock[LAST_ERROR] = max(error, EASY)
    # First same as last: the seventh stage is the next step's first.
    copy(work.slope_v[6], work.slope_v[0], 0)
    return ACCEPTED


@inlined
def in_vain(model: Model, state: State, fraction: float, time: float) -> bool:
    """Whether a step that ended after some time is the last of many that hardly came forward.

    What touched may have been parted again, to keep others in touch, and so without end.
    """
    if fraction == 1.0 or time * model.light_rate > INSTANT * model.tolerance:
        state.counter[IN_VAIN] = 0
        return False
    state.counter[IN_VAIN] += 1
    if state.counter[IN_VAIN] < TOUCHES:
        return False
    state.counter[IN_VAIN] = 0
    return True


@kernel
def settle_held(lo: int, model: Model, state: State, work: Work) -> None:
    """Undo the rounding of a step on components that friction holds."""
    for i in range(lo, model.n):
        if state.stuck[i] == 1:
            state.v[i] = 0.0
