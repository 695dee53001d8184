"""Integrators with equal steps, for comparison.

Each advances ``y`` in place and returns the number of evaluations. ``y`` contains the headings and
the base's position (n + 2), then their rates (n + 2). The chain is pinned, with smooth forces only.
"""

import numpy as np

from magfold_env.engine.compile.jit import allocating_kernel
from magfold_env.engine.state import Array, Model, Work
from magfold_env.engine.stepping.dynamics import smooth_accelerations

EULER, VERLET, MIDPOINT = "double Euler", "velocity Verlet", "implicit midpoint"
MIDPOINT_ITERATIONS = 100
MIDPOINT_ACCURACY = 1e-13


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
    """Advance by velocity Verlet; accelerations use the rates that Euler's rule predicts."""
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

    Its equation is solved by fixed-point iteration, starting from the last step's accelerations.
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


FIXED = {EULER: double_euler, VERLET: velocity_verlet, MIDPOINT: implicit_midpoint}
"""Integrators by name."""
