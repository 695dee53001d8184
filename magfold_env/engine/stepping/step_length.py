"""The length of a step, limited by the state and by the last step's error.

This module also chooses the scheme, which is Chebyshev's method if friction is stiff.
"""

import math

from magfold_env.engine import indices as ix
from magfold_env.engine.chain import feed, ledger
from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.contact import boxes, jacobian
from magfold_env.engine.contact.constraints import first_joint, joint_rate
from magfold_env.engine.elementary import inverse_root, time_across
from magfold_env.engine.state import Array, Model, State, Work
from magfold_env.engine.stepping import chebyshev, stages

LONGEST_STEP = 0.1  # [s]
SHORTEST_STEP = 1e-13  # [s]
LONGER = 1.2  # times the time to the next stop
SOONEST_STOP = 1e-7  # [s] shortest predicted time to a stop
PAST_EDGE = 2e-6  # [s] how far a step may reach beyond the end of a face
SHORTEST_BRAKE = 1e-7  # [s] the shortest step that ends when a component stops
EASY = 1e-4  # an error that allows the largest growth
CAUTION = 0.8  # times the longest step that the error allows
LARGEST_GROWTH = 5.0
LEAST_GROWTH = 0.2  # after an accepted step, regardless of the attempts before
# Step lengths times friction's rate: beyond STIFF, stability limits an explicit step; up to MILD,
# an explicit step is cheaper.
STIFF, MILD = 2.5, 2.0
OTHERS = 4  # number of explicit steps after a Chebyshev step that was no better


@kernel
def longest_step(model: Model, state: State, work: Work) -> float:
    """Return the limit on the length of a step [s] that follows from the state.

    The step must not go far beyond the moment when a joint reaches its stop, a corner slides off a
    face, or friction stops a component, because the step would then have to be repeated.
    """
    lo, h = state.counter[ix.N_HELD], LONGEST_STEP
    if model.contact:
        h = min(h, time_past_stop(lo, model, state, work))
        h = min(h, PAST_EDGE + time_to_edge(lo, model, work, state.v))
    if model.frictional:
        h = min(h, max(state.clock[ix.BRAKE], SHORTEST_BRAKE))
    if state.counter[ix.SLIPPING] != 0 and lo > 0:
        h = min(h, feed.time_to_change(model, state, work.stages.slope_v[0]))
        if math.isinf(model.force_limit):
            h = min(h, max(ledger.patience_left(model, state), feed.SOONEST))
    return h


@inlined
def takes_smooth(state: State, h: float, rate: float) -> bool:
    """Whether to take a Chebyshev step, because explicit steps would be unstable or cost more."""
    return state.counter[ix.STIFF] > 0 and h * rate > MILD


@inlined
def plan_next(
    state: State, h: float, fraction: float, rate: float, error: float, growth: float
) -> None:
    """Choose the length and the scheme of the next step."""
    smooth = takes_smooth(state, h, rate)
    if state.counter[ix.STIFF] < 0:
        state.counter[ix.STIFF] += 1
    elif not smooth:
        state.counter[ix.STIFF] = int(h * rate > STIFF)
    if fraction < 1.0:
        growth = 1.0
    elif error > EASY:
        growth = min(growth, next_growth(state, h, error, smooth))
    # If an event or a time limit shortened this step, the next one may still be longer.
    state.clock[ix.STEP] = max(
        h * growth, 0.5 * state.clock[ix.STEP] if h < state.clock[ix.STEP] else SHORTEST_STEP
    )
    state.clock[ix.LAST_STEP] = 0.0 if smooth else h
    state.clock[ix.LAST_ERROR] = max(error, EASY)


@inlined
def next_growth(state: State, h: float, error: float, smooth: bool) -> float:
    """Return the factor by which the next step grows, from this step's error and its trend.

    This is Gustafsson's predictive controller (Hairer and Wanner, Solving ODEs II, IV.8). Magnets
    pull ever harder towards a stop; under a rule that uses only the last error, every second step
    would be rejected.
    """
    if smooth:
        return CAUTION * inverse_root(error, chebyshev.ORDER)
    growth = CAUTION * inverse_root(error, stages.ORDER)
    before = state.clock[ix.LAST_STEP]
    if before > 0.0:
        trend = inverse_root(error / state.clock[ix.LAST_ERROR], stages.ORDER)
        growth = min(growth, growth * trend * h / before)
    return max(growth, LEAST_GROWTH)


@kernel
def time_past_stop(lo: int, model: Model, state: State, work: Work) -> float:
    """Return the time until an open joint is slightly past its stop, at present accelerations [s].

    The overshoot is limited, because magnets that only the stops keep apart would almost meet.
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
            time, speed = time_across(gap, sign * rate, sign * acceleration)
            if time < LONGEST_STEP:
                soonest = min(soonest, LONGER * time, time + model.stop_overshoot / speed)
    return max(soonest, LONGER * SOONEST_STOP)


@kernel
def time_to_edge(lo: int, model: Model, work: Work, v: Array) -> float:
    """Return the time until a corner that slides along a face or around an edge leaves it [s].

    There the normal begins or stops turning. Without this limit, 27 instead of 15 of 300 folds of
    `Reprogram` end differently than at tighter tolerances. The result assumes the present
    velocities and is infinite if nothing slides. Needs `place_boxes` and the centres' velocities.
    """
    soonest = math.inf
    for r in range(work.rows.counts[ix.JOINT_STOPS], work.rows.counts[ix.CONTACTS]):
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
        if above or not beside:
            soonest = min(soonest, time_to_end(along, a, slide))
        if beside or not above:
            soonest = min(soonest, time_to_end(across, b, rise))
    return soonest


@inlined
def time_to_end(x: float, end: float, rate: float) -> float:
    """Return the time until a point at x reaches one of a face's ends, −end or end [s]."""
    goal = math.copysign(end, x if abs(x) > end else rate)
    time = (goal - x) / rate if rate != 0.0 else math.inf
    return time if time > 0.0 else math.inf
