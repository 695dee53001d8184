"""The stages of a Dormand-Prince step and the estimate of its error."""

from __future__ import annotations

import math

from magfold_env.engine.chain import articulated
from magfold_env.engine.chain.feed import coordinates
from magfold_env.engine.compile.jit import kernel
from magfold_env.engine.state import LO, Model, State, Work
from magfold_env.engine.stepping import dormand_prince as dp
from magfold_env.engine.stepping.dynamics import accelerations

LOCAL = 0.1  # share of the tolerance that one step may use up
UNEVEN = 2.0  # mean mass over the least, its root, from which masses decide about errors
SLOW = 0.3  # share of a typical rate below which rates are judged by it


@kernel
def stages(model: Model, state: State, work: Work, h: float) -> bool:
    """Fill the slopes of a step and its end in ``work.new_q``, ``work.new_v``."""
    end = coordinates(model)
    # What the tube holds does not turn. Loops over all components are faster than over the others.
    for s in range(dp.STAGES):
        for k in range(state.counter[LO]):
            work.slope_v[s, k] = 0.0
    for s in range(1, dp.STAGES):
        q, v = (work.stage_q, work.stage_v) if s < 6 else (work.new_q, work.new_v)
        for k in range(end):
            dq, dv = 0.0, 0.0
            for r in range(s):
                dq += dp.WEIGHT[s, r] * work.slope_q[r, k]
                dv += dp.WEIGHT[s, r] * work.slope_v[r, k]
            q[k] = state.q[k] + h * dq
            v[k] = state.v[k] + h * dv
            work.slope_q[s, k] = v[k]
        if not accelerations(model, state, q, v, work, work.slope_v[s]):
            return False
    return True


@kernel
def step_error(model: Model, state: State, work: Work, h: float) -> float:
    """Estimated error of the step over what is allowed.

    Angles are judged by the tolerance, rates by the tolerance times a typical rate, the base by
    the tolerance times a component's length; velocities of uneven chains also all together.
    """
    n = model.n
    worst, total = 0.0, 0.0
    for k in range(coordinates(model)):
        eq, ev = 0.0, 0.0
        for s in range(dp.STAGES):
            eq += dp.ERROR[s] * work.slope_q[s, k]
            ev += dp.ERROR[s] * work.slope_v[s, k]
        scale = 1.0 if k < n else model.bodies.length[0]
        rate = model.rate_scale * scale
        eq = abs(h * eq) / (LOCAL * model.tolerance * scale)
        ev = abs(h * ev) / (LOCAL * model.tolerance * max(SLOW * rate, abs(work.new_v[k])))
        total += eq + ev
        worst = max(worst, eq, ev)
    if not math.isfinite(total):
        return math.nan
    if model.light_rate > UNEVEN * model.rate_scale:
        worst = max(worst, kinetic_error(state.counter[LO], model, work, h))
    return worst


@kernel
def kinetic_error(lo: int, model: Model, work: Work, h: float) -> float:
    """Estimated error of the velocities over what is allowed, in the metric of the masses.

    Where a light component turns fast, the least of its errors carries heavy ones beyond it away.
    Needs pose and centre velocities at the step's end.
    """
    n, bodies, off = model.n, model.bodies, work.stage_v
    for k in range(n + 2):
        off[k] = 0.0
        for s in range(dp.STAGES):
            off[k] += h * dp.ERROR[s] * work.slope_v[s, k]
    articulated.centre_velocities(lo, bodies, work.pose, off, work.fx, work.fy)
    error, energy, mass = 0.0, 0.0, 0.0
    for i in range(lo, n):
        m, j = bodies.mass[i], bodies.inertia[i]
        error += m * (work.fx[i] ** 2 + work.fy[i] ** 2) + j * off[i] ** 2
        energy += m * (work.vx[i] ** 2 + work.vy[i] ** 2) + j * work.new_v[i] ** 2
        mass += m / n
    slow = SLOW * model.rate_scale * bodies.length[0]
    return math.sqrt(error / max(energy, mass * slow * slow)) / (LOCAL * model.tolerance)
