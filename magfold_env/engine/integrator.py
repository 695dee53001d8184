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

from magfold_env.engine import contact
from magfold_env.engine import dormand_prince as dp
from magfold_env.engine.arrays import copy
from magfold_env.engine.constraints import (
    CROWDED,
    IMPACT,
    OK,
    UNSOLVED,
    begin_step,
    end_hops,
    first_joint,
    keep_contacts,
    open_joints,
)
from magfold_env.engine.dynamics import accelerations, first_accelerations, torn_loose
from magfold_env.engine.events import STALLED, first_touch, interpolate
from magfold_env.engine.feed import is_free
from magfold_env.engine.jit import kernel, merged
from magfold_env.engine.moreau import moreau_step
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
)
from magfold_env.engine.recorder import has_room, record_rest, record_step
from magfold_env.engine.rest import is_at_rest, stop_slow
from magfold_env.engine.state import (
    BRAKE,
    FRESH,
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

LONGEST_STEP = 0.05  # [s]
SHORTEST_STEP = 1e-13  # [s]
PAST_EDGE = 2e-6  # [s] how far a step may reach beyond the end of a face
SHORTEST_BRAKE = 1e-7  # [s] the shortest step that ends where a component stops
BREAK_AWAY = 1e-6  # [s] how exactly the moment is found when friction no longer holds
HOPELESS_STEP = 1e-9  # [s] not finite even here: broken
EASY = 1e-4  # an error that allows the largest growth
RUNAWAY = 300.0  # times a typical rate: faster than any force but that of a feed can make it
PATIENCE = 4  # Moreau steps after a rattle


@kernel
def advance(model: Model, state: State, work: Work, record: Record, until: float) -> int:
    """Integrate until the time ``until`` [s], rest, or breakdown; returns which.

    `FULL` means that the record must be emptied; call again to go on. While the tube feeds, a
    chain at rest relative to it is moved on to ``until`` at once.
    """
    lo, n = state.counter[LO], model.n
    while state.clock[TIME] < until:
        if state.counter[STEPS] >= model.max_steps:
            return CAPPED
        if not has_room(record, state, LONGEST_STEP):
            return FULL
        begun = begin_step(model, state, work)
        if begun == CROWDED:
            return TOO_CROWDED
        if begun == UNSOLVED:
            return NO_SOLUTION
        touchy = state.counter[TOUCHY] > 0
        anew = state.counter[FRESH] == 1 or begun != OK or touchy or resting(lo, state)
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
        if touchy:
            outcome = moreau_step(model, state, work, record, until)
            state.counter[TOUCHY] -= 1
        else:
            outcome = step(model, state, work, record, until)
        if runs_away(model, state):
            return JAMMED
        state.counter[FRESH] = 0 if outcome == ACCEPTED else 1
        if outcome == RATTLED:
            state.counter[TOUCHY] = PATIENCE
        elif outcome == TOO_SHORT:
            return UNDERFLOW
        elif outcome == BROKEN:
            return NOT_FINITE
    return REACHED


@merged
def fresh_accelerations(model: Model, state: State, work: Work) -> bool:
    """Accelerations of the state into ``work.slope_v[0]``; ends hops. False if not found."""
    hops = IMPACT
    # Every round holds a joint more, so there are at most n.
    while hops == IMPACT:
        if not first_accelerations(model, state, work, work.slope_v[0]):
            return False
        hops = end_hops(model, state, work, work.slope_v[0]) if model.contact else OK
    return hops == OK or first_accelerations(model, state, work, work.slope_v[0])


@merged
def runs_away(model: Model, state: State) -> bool:
    """Whether something turns faster than it can: a feed drives parts that cannot give way.

    Rates that are no numbers count too.
    """
    n = model.n
    limit = model.rate_scale + (abs(state.v[n]) + abs(state.v[n + 1])) / model.side
    for k in range(state.counter[LO], n):
        rate = abs(state.v[k])
        if not math.isfinite(rate) or (model.tube and rate > RUNAWAY * limit):
            return True
    return False


@merged
def resting(lo: int, state: State) -> bool:
    """Whether friction held any component in the last step."""
    for i in range(lo, state.stuck.size):
        if state.stuck[i] == 1:
            return True
    return False


@kernel
def step(model: Model, state: State, work: Work, record: Record, until: float) -> int:
    """Take one step from the state, whose accelerations are in ``work.slope_v[0]``."""
    lo = state.counter[LO]
    remaining = until - state.clock[TIME]
    growth = 5.0
    limit = longest_step(lo, model, state, work)
    while True:
        h = min(state.clock[STEP], remaining, limit)
        last = h >= remaining
        if h < SHORTEST_STEP and not last:
            return TOO_SHORT
        state.counter[STEPS] += 1
        if not stages(model, state, work, h):
            state.clock[STEP] = 0.25 * h
            continue
        error = step_error(lo, model, state, work, h)
        if not math.isfinite(error):
            if h < HOPELESS_STEP:
                return BROKEN
            state.clock[STEP] = 0.1 * h
            continue
        if error > 1.0:
            growth = 1.0
            state.clock[STEP] = h * max(0.2, 0.9 * error ** (-1.0 / dp.ORDER))
            continue
        if h > BREAK_AWAY and torn_loose(model, work):
            growth = 1.0
            state.clock[STEP] = 0.5 * h
            continue
        fraction = first_touch(model, state, h, work) if model.contact else 1.0
        if fraction == STALLED:
            return RATTLED
        break
    if fraction < 1.0:
        growth = 1.0
    elif error > EASY:
        growth = min(growth, 0.9 * error ** (-1.0 / dp.ORDER))
    # A step cut short by an event or by the time limit says nothing against a longer one.
    state.clock[STEP] = max(h * growth, 0.5 * state.clock[STEP] if h < state.clock[STEP] else 0.0)
    if fraction < 1.0:
        interpolate(state.q, work.slope_q, h, fraction, work.new_q)
        interpolate(state.v, work.slope_v, h, fraction, work.new_v)
    touching = work.row_count[1] > work.row_count[0]
    if touching and not keep_contacts(model, state, work, work.new_q, work.new_v):
        return RATTLED
    record_step(record, state, work, h, fraction)
    copy(work.new_q, state.q, lo)
    copy(work.new_v, state.v, lo)
    state.clock[TIME] = until if last and fraction == 1.0 else state.clock[TIME] + fraction * h
    settle_held(lo, model, state, work)
    open_joints(lo, model, state)
    if fraction < 1.0 or touching:
        return TOUCHED
    # First same as last: the seventh stage is the next step's first.
    copy(work.slope_v[6], work.slope_v[0], 0)
    return ACCEPTED


@merged
def longest_step(lo: int, model: Model, state: State, work: Work) -> float:
    """How far a step may reach [s], going by the state alone.

    Not far beyond a joint's stop, the end of a face on which a corner slides, or the moment when
    friction stops a component: what happens there would only have the step repeated.
    """
    h = LONGEST_STEP
    if model.contact:
        h = min(h, 1.2 * time_to_stop(lo, model, state, work))
        h = min(h, PAST_EDGE + contact.time_to_edge(lo, model, work, state.v))
    if model.frictional:
        h = min(h, max(state.clock[BRAKE], SHORTEST_BRAKE))
    return h


@merged
def stages(model: Model, state: State, work: Work, h: float) -> bool:
    """Fill the slopes of a step and its end in ``work.new_q``, ``work.new_v``."""
    lo, n = state.counter[LO], model.n
    for k in range(lo):
        work.stage_q[k] = state.q[k]
        work.stage_v[k] = 0.0
        work.new_q[k] = state.q[k]
        work.new_v[k] = 0.0
        for s in range(dp.STAGES):
            work.slope_q[s, k] = 0.0
            work.slope_v[s, k] = 0.0
    for s in range(1, dp.STAGES):
        q, v = (work.stage_q, work.stage_v) if s < 6 else (work.new_q, work.new_v)
        for k in range(lo, n + 2):
            dq, dv = 0.0, 0.0
            for r in range(s):
                dq += dp.WEIGHT[s, r] * work.slope_q[r, k]
                dv += dp.WEIGHT[s, r] * work.slope_v[r, k]
            q[k] = state.q[k] + h * dq
            v[k] = state.v[k] + h * dv
        for k in range(lo, n + 2):
            work.slope_q[s, k] = v[k]
        if not accelerations(model, state, q, v, work, work.slope_v[s]):
            return False
    return True


@merged
def step_error(lo: int, model: Model, state: State, work: Work, h: float) -> float:
    """Estimated error of the step over what is allowed.

    Angles are judged by the tolerance, rates by the tolerance times a typical rate, the base by
    the tolerance times a component's length.
    """
    n = model.n
    worst = 0.0
    finite = True
    for k in range(lo, n + 2):
        eq, ev = 0.0, 0.0
        for s in range(dp.STAGES):
            eq += dp.ERROR[s] * work.slope_q[s, k]
            ev += dp.ERROR[s] * work.slope_v[s, k]
        scale = 1.0 if k < n else model.bodies.length[0]
        rate = model.rate_scale * scale
        eq = abs(h * eq) / (LOCAL * model.tolerance * scale)
        ev = abs(h * ev) / (LOCAL * model.tolerance * max(SLOW * rate, abs(work.new_v[k])))
        finite = finite and math.isfinite(eq) and math.isfinite(ev)
        worst = max(worst, eq, ev)
    return worst if finite else math.nan


LOCAL = 0.1  # share of the tolerance that one step may use up
SLOW = 0.3  # share of a typical rate below which rates are judged by it


@merged
def settle_held(lo: int, model: Model, state: State, work: Work) -> None:
    """Undo the rounding of a step on components that friction holds."""
    for i in range(lo, model.n):
        if state.stuck[i] == 1:
            state.v[i] = 0.0


@merged
def time_to_stop(lo: int, model: Model, state: State, work: Work) -> float:
    """Time until the first open joint reaches a stop at its present acceleration [s]."""
    soonest = LONGEST_STEP
    for k in range(first_joint(lo), model.n):
        if state.lock[k] != 0:
            continue
        angle = state.q[k] - state.q[k - 1]
        rate, acceleration = state.v[k], work.slope_v[0, k]
        if k > lo:
            rate -= state.v[k - 1]
            acceleration -= work.slope_v[0, k - 1]
        for sign in (-1.0, 1.0):
            gap = contact.HALF_PI - sign * angle
            toward, push = sign * rate, sign * acceleration
            root = toward * toward + 2.0 * push * gap
            # The first t > 0 with r t + a t²/2 = g, in the form that does not cancel.
            if toward < 0.0:
                if push > 0.0:
                    soonest = min(soonest, (math.sqrt(root) - toward) / push)
            elif root >= 0.0 and toward + math.sqrt(root) > 0.0:
                soonest = min(soonest, 2.0 * gap / (toward + math.sqrt(root)))
    return max(soonest, 1e-7)
