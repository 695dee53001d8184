"""How long the next step may be: by what is about to happen, and by the error of the last ones."""

from __future__ import annotations

import math

from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.contact import jacobian
from magfold_env.engine.contact.constraints import first_joint
from magfold_env.engine.state import BRAKE, LAST_ERROR, LAST_STEP, Model, State, Work
from magfold_env.engine.stepping import dormand_prince as dp
from magfold_env.engine.stepping import edges

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
        h = min(h, PAST_EDGE + edges.time_to_edge(lo, model, work, state.v))
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
        rate, acceleration = state.v[k], work.slope_v[0, k]
        if k > lo:
            rate -= state.v[k - 1]
            acceleration -= work.slope_v[0, k - 1]
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


@inlined
def next_growth(state: State, h: float, error: float) -> float:
    """Return how much longer the next step may be, going by this one's error and its trend.

    Gustafsson's predictive controller (Hairer and Wanner, Solving ODEs II, IV.8): towards a stop
    magnets pull ever harder, and a rule that knows only the last error has every other step
    rejected.
    """
    growth = 0.9 * error ** (-1.0 / dp.ORDER)
    before = state.clock[LAST_STEP]
    if before > 0.0:
        trend = (state.clock[LAST_ERROR] / error) ** (1.0 / dp.ORDER)
        growth = min(growth, growth * trend * h / before)
    return max(growth, LEAST_GROWTH)
