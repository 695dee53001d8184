"""Dormand and Prince's step: its stages, its error estimate, and its dense output.

The coefficients of the Runge-Kutta pair 5(4) are from Dormand and Prince (1980), and those for the
dense output from Shampine (1986), Math. Comp. 46:135-150.
"""

import math

import numpy as np

from magfold_env.engine import indices as ix
from magfold_env.engine.chain import ledger
from magfold_env.engine.chain.feed import borne, drives, needed_force, slips
from magfold_env.engine.chain.momentum import energy_outside
from magfold_env.engine.chain.tube import coordinates, is_partly_out, whole_mass
from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.state import Array, Model, State, Work
from magfold_env.engine.stepping.dynamics import accelerations

STAGES = 7
ORDER = 5

# Row s: weights of the stages before s; the last row is also the step itself.
WEIGHT = np.array(
    [
        [0, 0, 0, 0, 0, 0],
        [1 / 5, 0, 0, 0, 0, 0],
        [3 / 40, 9 / 40, 0, 0, 0, 0],
        [44 / 45, -56 / 15, 32 / 9, 0, 0, 0],
        [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0, 0],
        [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656, 0],
        [35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
    ]
)

ERROR = np.array([-71 / 57600, 0.0, 71 / 16695, -71 / 1920, 17253 / 339200, -22 / 525, 1 / 40])

# y(t + θh) = y + h Σ_s k_s Σ_j DENSE[s, j] θ^(j+1)
DENSE = np.array(
    [
        [1.0, -8048581381 / 2820520608, 8663915743 / 2820520608, -12715105075 / 11282082432],
        [0.0, 0.0, 0.0, 0.0],
        [0.0, 131558114200 / 32700410799, -68118460800 / 10900136933, 87487479700 / 32700410799],
        [0.0, -1754552775 / 470086768, 14199869525 / 1410260304, -10690763975 / 1880347072],
        [0.0, 127303824393 / 49829197408, -318862633887 / 49829197408, 701980252875 / 199316789632],
        [0.0, -282668133 / 205662961, 2019193451 / 616988883, -1453857185 / 822651844],
        [0.0, 40617522 / 29380423, -110615467 / 29380423, 69997945 / 29380423],
    ]
)

LOCAL = 0.1  # share of the tolerance that one step may use
UNEVEN = 2.0  # root of mean over least mass from which masses weigh errors of velocities
SLOW = 0.3  # share of a typical rate: the least scale for errors of rates


@kernel
def stages(model: Model, state: State, work: Work, h: float) -> bool:
    """Compute a step's slopes and its end; return False if accelerations could not be found.

    The end is in ``work.stages.new_q`` and ``new_v``; its estimated errors are in ``q``, ``v``.
    """
    lo, end, driven = state.counter[ix.N_HELD], coordinates(model), drives(model, state)
    # Held components do not turn, but loops that include them are faster.
    for s in range(STAGES):
        for k in range(lo):
            work.stages.slope_v[s, k] = 0.0
    for s in range(1, STAGES):
        q, v = (work.stages.q, work.stages.v) if s < 6 else (work.stages.new_q, work.stages.new_v)
        for k in range(end):
            dq, dv = 0.0, 0.0
            for r in range(s):
                dq += WEIGHT[s, r] * work.stages.slope_q[r, k]
                dv += WEIGHT[s, r] * work.stages.slope_v[r, k]
            q[k] = state.q[k] + h * dq
            v[k] = state.v[k] + h * dv
            work.stages.slope_q[s, k] = v[k]
        if not accelerations(model, state, q, v, work, work.stages.slope_v[s]):
            return False
        if driven:
            work.stages.drive[s] = needed_force(lo, model, work, work.stages.slope_v[s])
    for k in range(end):
        eq, ev = 0.0, 0.0
        for s in range(STAGES):
            eq += ERROR[s] * work.stages.slope_q[s, k]
            ev += ERROR[s] * work.stages.slope_v[s, k]
        work.stages.q[k], work.stages.v[k] = h * eq, h * ev
    if driven and work.rows.counts[ix.SOLVED] > work.rows.counts[ix.JOINT_STOPS]:
        # A guided base moves alike under any force, so the error of the drive's work counts too.
        off = 0.0
        for s in range(STAGES):
            off += ERROR[s] * work.stages.drive[s]
        share = state.v[model.n] / (model.typical_rate * model.bodies.length[0])
        work.stages.v[model.n] = h * off * share / whole_mass(model)
    return True


@kernel
def step_error(model: Model, state: State, work: Work) -> float:
    """Return the estimated error of the step relative to the allowed error.

    The scales are the tolerance for angles, the tolerance times a typical rate for rates, and the
    tolerance times a length for the base. If masses are unequal, `kinetic_error` counts too.
    """
    n, stages = model.n, work.stages
    worst, total = 0.0, 0.0
    for k in range(coordinates(model)):
        scale = 1.0 if k < n else model.bodies.length[0]
        rate = model.typical_rate * scale
        eq = abs(stages.q[k]) / (LOCAL * model.tolerance * scale)
        ev = abs(stages.v[k]) / (LOCAL * model.tolerance * max(SLOW * rate, abs(stages.new_v[k])))
        total += eq + ev
        worst = max(worst, eq, ev)
    if not math.isfinite(total):
        return math.nan
    if model.fastest_rate > UNEVEN * model.typical_rate:
        worst = max(worst, kinetic_error(state.counter[ix.N_HELD], model, work))
    return worst


@kernel
def kinetic_error(lo: int, model: Model, work: Work) -> float:
    """Return the estimated error of the velocities, relative to the allowed one, weighted by mass.

    Without this part, the smallest errors of a fast, light component would carry away heavy
    components beyond it. The function needs the pose at the step's end.
    """
    slow = SLOW * model.typical_rate * model.bodies.length[0]
    error = energy_outside(lo, model, work, work.stages.v)
    energy = energy_outside(lo, model, work, work.stages.new_v)
    least = 0.5 * whole_mass(model) / model.n * slow * slow
    return math.sqrt(error / max(energy, least)) / (LOCAL * model.tolerance)


@inlined
def dense_weight(s: int, fraction: float) -> float:
    """Return the weight of stage s's slope in the dense output at a ``fraction`` of the step."""
    w = 0.0
    for j in range(3, -1, -1):
        w = (w + DENSE[s, j]) * fraction
    return w


@kernel
def interpolate(y: Array, slopes: Array, step: float, fraction: float, out: Array) -> None:
    """Fill in the dense output at a ``fraction`` of the step."""
    for k in range(y.size):
        out[k] = y[k]
    for s in range(STAGES):
        w = dense_weight(s, fraction) * step
        for k in range(y.size):
            out[k] += w * slopes[s, k]


@kernel
def drive_impulse(model: Model, state: State, work: Work, step: float, fraction: float) -> float:
    """Return the impulse of the drive in a ``fraction`` of the step [N·s]."""
    if not is_partly_out(model, state):
        return 0.0
    if slips(state):
        return step * fraction * work.chain.base[ix.DRIVE]
    total = 0.0
    for s in range(STAGES):
        total += dense_weight(s, fraction) * borne(model, state, work.stages.drive[s])
    return step * total


@kernel
def close_milliseconds(
    model: Model, state: State, work: Work, step: float, fraction: float
) -> None:
    """Update the peak force with the milliseconds that end within a ``fraction`` of the step."""
    begin, impulse = float(state.clock[ix.TIME]), float(state.account[ix.IMPULSE])
    end = ledger.next_millisecond(state)
    while end <= begin + fraction * step:
        share = (end - begin) / step
        gained = drive_impulse(model, state, work, step, share)
        ledger.close_millisecond(state, impulse + gained)
        end = ledger.next_millisecond(state)
