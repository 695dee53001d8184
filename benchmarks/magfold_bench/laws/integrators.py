"""Integrators for comparison: three of equal steps, and Dormand and Prince's pair.

All advance ``y`` = headings and base (n + 2), then their rates (n + 2), in place, and return the
number of evaluations. The chain is pinned and its forces are smooth.
"""

import numpy as np

from magfold_env.engine.compile.jit import allocating_kernel
from magfold_env.engine.state import Array, Model, Work
from magfold_env.engine.stepping.dynamics import smooth_accelerations
from magfold_env.engine.stepping.stages import ERROR, ORDER, STAGES, WEIGHT

EULER, VERLET, MIDPOINT = "double Euler", "velocity Verlet", "implicit midpoint"
PAIR = "DP5(4)"
MIDPOINT_ITERATIONS = 100
MIDPOINT_ACCURACY = 1e-13
SHORTEST = 1e-15  # step, as a share of the whole time
SLOW = 0.3  # share of a typical rate below which rates are judged by it
SAFETY = 0.9
SHRINK, GROW = 0.2, 5.0


@allocating_kernel
def double_euler(model: Model, work: Work, y: Array, until: float, steps: int) -> int:
    """Advance by the paper's scheme: rates by the old accelerations, headings by the new rates."""
    m = y.size // 2
    q, v, a = y[:m], y[m:], np.zeros(m)
    h = until / steps
    for _ in range(steps):
        smooth_accelerations(0, model, q, v, work, a)
        for k in range(m):
            v[k] += h * a[k]
            q[k] += h * v[k]
    return steps


@allocating_kernel
def velocity_verlet(model: Model, work: Work, y: Array, until: float, steps: int) -> int:
    """Advance by velocity Verlet; accelerations see the rate predicted by Euler's rule."""
    m = y.size // 2
    q, v = y[:m], y[m:]
    a, b, predicted = np.zeros(m), np.zeros(m), np.zeros(m)
    h = until / steps
    smooth_accelerations(0, model, q, v, work, a)
    for _ in range(steps):
        for k in range(m):
            q[k] += h * (v[k] + 0.5 * h * a[k])
            predicted[k] = v[k] + h * a[k]
        smooth_accelerations(0, model, q, predicted, work, b)
        for k in range(m):
            v[k] += 0.5 * h * (a[k] + b[k])
            a[k] = b[k]
    return steps + 1


@allocating_kernel
def implicit_midpoint(model: Model, work: Work, y: Array, until: float, steps: int) -> int:
    """Advance by the implicit midpoint rule, which is time-reversible.

    Its equation is solved by fixed-point iteration from the last step's accelerations.
    """
    m = y.size // 2
    q, v = y[:m], y[m:]
    a, b = np.zeros(m), np.zeros(m)
    middle_q, middle_v = np.zeros(m), np.zeros(m)
    h = until / steps
    evaluations = 1
    smooth_accelerations(0, model, q, v, work, a)
    for _ in range(steps):
        for _ in range(MIDPOINT_ITERATIONS):
            for k in range(m):
                middle_v[k] = v[k] + 0.5 * h * a[k]
                middle_q[k] = q[k] + 0.5 * h * middle_v[k]
            smooth_accelerations(0, model, middle_q, middle_v, work, b)
            evaluations += 1
            change, size = 0.0, 0.0
            for k in range(m):
                change = max(change, abs(b[k] - a[k]))
                size = max(size, abs(b[k]))
                a[k] = b[k]
            if change <= MIDPOINT_ACCURACY * size:
                break
        for k in range(m):
            q[k] += h * (v[k] + 0.5 * h * a[k])
            v[k] += h * a[k]
    return evaluations


@allocating_kernel
def dormand_prince(model: Model, work: Work, y: Array, until: float, tolerance: float) -> int:
    """Advance by the engine's pair with the simplest step control; −1 if steps get too short.

    The step control keeps the error of angles below a tolerance [rad], and that of rates below the
    tolerance times the rate or a share of a typical rate.
    """
    m = y.size // 2
    slope, new = np.zeros((STAGES, 2 * m)), np.zeros(2 * m)
    time, h = 0.0, 0.1 / model.typical_rate
    slope[0, :m] = y[m:]
    smooth_accelerations(0, model, y[:m], y[m:], work, slope[0, m:])
    evaluations = 1
    while time < until:
        if not h > SHORTEST * until:
            return -1
        last = h >= until - time
        h = min(h, until - time)
        for i in range(1, STAGES):
            for k in range(2 * m):
                total = 0.0
                for j in range(i):
                    total += WEIGHT[i, j] * slope[j, k]
                new[k] = y[k] + h * total
            slope[i, :m] = new[m:]
            smooth_accelerations(0, model, new[:m], new[m:], work, slope[i, m:])
            evaluations += 1
        error = 0.0
        for k in range(2 * m):
            total = 0.0
            for j in range(STAGES):
                total += ERROR[j] * slope[j, k]
            scale = tolerance
            if k >= m:
                scale *= max(SLOW * model.typical_rate, abs(new[k]))
            error = max(error, abs(h * total) / scale)
        factor = SAFETY * max(error, 1e-12) ** (-1.0 / ORDER)
        if error <= 1.0:
            time = until if last else time + h
            y[:] = new
            slope[0, :] = slope[STAGES - 1, :]
        h *= min(max(factor, SHRINK), GROW if error <= 1.0 else 1.0)
    return evaluations


FIXED = {EULER: double_euler, VERLET: velocity_verlet, MIDPOINT: implicit_midpoint}
"""Integrators with a number of steps; the other one has a tolerance [rad]."""
