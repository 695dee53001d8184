"""Runge-Kutta-Chebyshev steps for slow sliding: stable over long steps with few stages.

Friction adapts a component that slides at a speed S to the motion around it within S/µg, which is
milliseconds in a slow feed. Explicit steps are limited to a few of these times, however little
happens. This second-order step spans 0.65 s² such times with s stages and solves no equations [1]_.

References
----------
.. [1] B. P. Sommeijer, L. F. Shampine and J. G. Verwer, "RKC: an explicit solver for parabolic
   PDEs", Journal of Computational and Applied Mathematics 88 (1998) 315-326.
"""

import numpy as np

from magfold_env.engine import indices as ix
from magfold_env.engine.chain.feed import drives, needed_force
from magfold_env.engine.chain.tube import coordinates
from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.friction import law
from magfold_env.engine.state import Array, Model, State, Work, copy
from magfold_env.engine.stepping.dynamics import accelerations
from magfold_env.engine.stepping.stages import DENSE, WEIGHT

ORDER = 3  # order of a step's error
MOST_STAGES = 16
STRICT = 3.0  # times the estimated error: low-order errors add up over a long slide
DAMPING = 2.0 / 13.0
ROOM = 1.25  # times friction's fastest rate, which may grow within a step


def _scheme(stages: int) -> list[tuple[float, float, float, float]]:
    """Return one row per stage: weights of the two previous stages and of two slopes."""
    w0 = 1.0 + DAMPING / stages**2
    t, d, c = [1.0, w0], [0.0, 1.0], [0.0, 0.0]  # Chebyshev polynomials, their derivatives
    for _ in range(2, stages + 1):
        t.append(2.0 * w0 * t[-1] - t[-2])
        c.append(2.0 * w0 * c[-1] - c[-2] + 4.0 * d[-1])
        d.append(2.0 * w0 * d[-1] - d[-2] + 2.0 * t[-2])
    w1 = d[stages] / c[stages]
    b = [c[max(j, 2)] / d[max(j, 2)] ** 2 for j in range(stages + 1)]
    rows = [(0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, b[1] * w1)]
    for j in range(2, stages + 1):
        slope = 2.0 * b[j] * w1 / b[j - 1]
        first = -(1.0 - b[j - 1] * t[j - 1]) * slope
        rows.append((2.0 * b[j] * w0 / b[j - 1], -b[j] / b[j - 2], slope, first))
    return rows


# Weights of the stages (stages, stage, 4).
SCHEME = np.zeros((MOST_STAGES + 1, MOST_STAGES + 1, 4))
for _count in range(2, MOST_STAGES + 1):
    SCHEME[_count, : _count + 1] = _scheme(_count)

# Between its ends, a step is the cubic that passes through both with their slopes f and g. It
# equals Dormand and Prince's dense output if two stage slopes are replaced by weighted sums of f, g
# and the step's mean slope, chosen so that the cubic reaches the end and the fourth power vanishes.
_PLACES = 2, 3
_U, _V = (WEIGHT[6, s] for s in _PLACES)
_X, _Y = (DENSE[s, 3] for s in _PLACES)
_DETERMINANT = _U * _Y - _V * _X
_TO_END = (1.0, -WEIGHT[6, 0], 0.0)
_FOURTH = (0.0, -DENSE[0, 3], -DENSE[6, 3])
CUBIC = np.array(
    [
        [(_Y * e - _V * f) / _DETERMINANT for e, f in zip(_TO_END, _FOURTH, strict=True)],
        [(_U * f - _X * e) / _DETERMINANT for e, f in zip(_TO_END, _FOURTH, strict=True)],
    ]
)


@inlined
def friction_rate(lo: int, model: Model, state: State, work: Work) -> float:
    """Return a bound on the rates at which friction slows the components' motion [1/s].

    The centres' velocities must be in ``work``.
    """
    fastest, bodies = 0.0, model.bodies
    for i in range(lo, model.n):
        speed = law.speed(model, work, state.v, i)
        if state.stuck[i] == 0 and speed > law.AT_REST:
            least = min(
                bodies.mass[i], bodies.inertia[i] / (model.friction_radius * model.friction_radius)
            )
            fastest = max(fastest, model.friction_limit[i] / (speed * least))
    return fastest


@kernel
def smooth_stages(model: Model, state: State, work: Work, h: float, rate: float) -> bool:
    """Take a step as `stages.stages` does, for friction that acts at a ``rate`` [1/s].

    Fills in the slopes from which `stages.interpolate` computes a cubic as the dense output.
    """
    end, slope_q, slope_v = coordinates(model), work.stages.slope_q, work.stages.slope_v
    count = 2
    while count < MOST_STAGES and 0.65 * (count * count - 1.0) < ROOM * h * rate:
        count += 1
    for k in range(state.counter[ix.N_HELD]):
        slope_v[5, k] = 0.0
        slope_v[6, k] = 0.0
    # The drive's impulse is integrated as one more coordinate, with its force as the slope.
    lo, drive, driven = state.counter[ix.N_HELD], work.stages.drive, drives(model, state)
    drive[2], drive[1] = 0.0, h * SCHEME[count, 1, 3] * drive[0]
    # Rows 1 and 2 hold the last two stages, and row 5 holds the accelerations at the last one.
    for k in range(end):
        slope_q[2, k], slope_v[2, k] = state.q[k], state.v[k]
        slope_q[1, k] = state.q[k] + h * SCHEME[count, 1, 3] * slope_q[0, k]
        slope_v[1, k] = state.v[k] + h * SCHEME[count, 1, 3] * slope_v[0, k]
    for j in range(2, count + 2):
        last, before = (1, 2) if j % 2 == 0 else (2, 1)
        # The accelerations at the end are the first ones of the next step.
        out = slope_v[5] if j <= count else slope_v[6]
        if not accelerations(model, state, slope_q[last], slope_v[last], work, out):
            return False
        force = needed_force(lo, model, work, out) if driven else 0.0
        if j > count:
            drive[6] = force
            lay_cubic(drive, drive[last] / h, drive[0], force)
            copy(slope_q[last], work.stages.new_q, 0)
            copy(slope_v[last], work.stages.new_v, 0)
            copy(slope_v[last], slope_q[6], 0)
            break
        scheme = SCHEME[count, j]
        a, b, c, d = scheme[0], scheme[1], scheme[2], scheme[3]
        for k in range(end):
            q, v = state.q[k], state.v[k]
            u = h * (c * slope_v[last, k] + d * slope_q[0, k])
            w = h * (c * slope_v[5, k] + d * slope_v[0, k])
            slope_q[before, k] = q + a * (slope_q[last, k] - q) + b * (slope_q[before, k] - q) + u
            slope_v[before, k] = v + a * (slope_v[last, k] - v) + b * (slope_v[before, k] - v) + w
        drive[before] = a * drive[last] + b * drive[before] + h * (c * force + d * drive[0])
    finish(h, state.q, slope_q, work.stages.new_q, work.stages.q, end)
    finish(h, state.v, slope_v, work.stages.new_v, work.stages.v, end)
    return True


@inlined
def finish(h: float, y: Array, slope: Array, new: Array, error: Array, end: int) -> None:
    """Estimate the error of a step, and fill in the slopes of its dense output, a cubic."""
    for k in range(end):
        mean, first, last = (new[k] - y[k]) / h, slope[0, k], slope[6, k]
        error[k] = STRICT * h * (0.4 * (first + last) - 0.8 * mean)
        lay_cubic(slope[:, k], mean, first, last)


@inlined
def lay_cubic(slope: Array, mean: float, first: float, last: float) -> None:
    """Fill in the inner slopes that make one coordinate's dense output a cubic."""
    slope[1], slope[4], slope[5] = 0.0, 0.0, 0.0
    slope[2] = CUBIC[0, 0] * mean + CUBIC[0, 1] * first + CUBIC[0, 2] * last
    slope[3] = CUBIC[1, 0] * mean + CUBIC[1, 1] * first + CUBIC[1, 2] * last
