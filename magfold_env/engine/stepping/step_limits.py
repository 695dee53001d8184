"""How long the next step may be: by what is about to happen, and by the error of the last ones."""

import math

from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.contact import boxes, jacobian
from magfold_env.engine.contact.constraints import first_joint, joint_rate
from magfold_env.engine.state import (
    BRAKE,
    CONTACTS,
    JOINT_STOPS,
    LAST_ERROR,
    LAST_STEP,
    Array,
    Model,
    State,
    Work,
)
from magfold_env.engine.stepping.stages import ORDER

LONGEST_STEP = 0.05  # [s]
LONGER = 1.2  # times the time to the next stop
SOONEST_STOP = 1e-7  # [s] before which no stop is foreseen
PAST_EDGE = 2e-6  # [s] how far a step may reach beyond the end of a face
SHORTEST_BRAKE = 1e-7  # [s] the shortest step that ends where a component stops
EASY = 1e-4  # an error that allows the largest growth
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
        h = min(h, max(state.clock[BRAKE], SHORTEST_BRAKE))
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
    for r in range(work.rows.counts[JOINT_STOPS], work.rows.counts[CONTACTS]):
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
def next_growth(state: State, h: float, error: float) -> float:
    """Return how much longer the next step may be, going by this one's error and its trend.

    Gustafsson's predictive controller (Hairer and Wanner, Solving ODEs II, IV.8): towards a stop
    magnets pull ever harder, and a rule that knows only the last error has every other step
    rejected.
    """
    growth = 0.9 * error ** (-1.0 / ORDER)
    before = state.clock[LAST_STEP]
    if before > 0.0:
        trend = (state.clock[LAST_ERROR] / error) ** (1.0 / ORDER)
        growth = min(growth, growth * trend * h / before)
    return max(growth, LEAST_GROWTH)
