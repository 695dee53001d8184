"""Integrators to compare the engine's with: of equal steps, Runge-Kutta pairs, and Adams' method.

All advance ``y`` = headings and base (n + 2), then their rates (n + 2), in place, and return the
number of evaluations. The chain is pinned and its forces are smooth. Those with error control keep
the error of angles below a tolerance [rad], that of rates below the tolerance times the rate, or a
share of a typical rate; they return −1 if steps became too short.
"""

import importlib
import math
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from magfold_env.engine.compile.jit import allocating_kernel
from magfold_env.engine.state import Array, Model, Work
from magfold_env.engine.stepping import stages as dormand_prince
from magfold_env.engine.stepping.dynamics import smooth_accelerations

MIDPOINT_ITERATIONS = 100
MIDPOINT_ACCURACY = 1e-13
SHORTEST = 1e-15  # step, as a share of the whole time
SLOW = 0.3  # share of a typical rate below which rates are judged by it
SAFETY = 0.9
SHRINK, GROW = 0.2, 5.0
HIGHEST = 12  # order of the predictor of Adams' method
DOUBLE = 2.0


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
    """Advance by the implicit midpoint rule, which time reversal leaves as it is.

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


class Pair(NamedTuple):
    """An explicit pair of s stages."""

    weight: Array  # (s, s): row i holds the weights of the stages before i
    step: Array  # (s,): the step itself
    error: Array  # (1 or 2, s + 1): estimates; the last entry is for the slope at the step's end
    order: int  # of the error estimate, plus one


@allocating_kernel
def runge_kutta(  # noqa: PLR0912 - one step, read from top to bottom
    model: Model, work: Work, y: Array, until: float, tolerance: float, pair: Pair
) -> int:
    """Advance by an embedded pair, which is an argument: one kernel for any explicit one.

    Two estimates of the error are combined as in Hairer, Nørsett and Wanner, Solving Ordinary
    Differential Equations I, II.10.
    """
    m, s = y.size // 2, pair.step.size
    slope, new = np.zeros((s + 1, 2 * m)), np.zeros(2 * m)
    estimate = np.zeros(2)
    at_end = pair.error[0, s] != 0.0  # whether the estimate needs the slope at the end
    time, h = 0.0, 0.1 / model.rate_scale
    slope[0, :m] = y[m:]
    smooth_accelerations(0, model, y[:m], y[m:], work, slope[0, m:])
    evaluations = 1
    while time < until:
        if not h > SHORTEST * until:
            return -1
        last = h >= until - time
        h = min(h, until - time)
        for i in range(1, s + 1):
            for k in range(2 * m):
                total = 0.0
                for j in range(i):
                    total += (pair.weight[i, j] if i < s else pair.step[j]) * slope[j, k]
                new[k] = y[k] + h * total
            if i < s or at_end:
                slope[i, :m] = new[m:]
                smooth_accelerations(0, model, new[:m], new[m:], work, slope[i, m:])
                evaluations += 1
        estimate[:] = 0.0
        for e in range(pair.error.shape[0]):
            for k in range(2 * m):
                total = 0.0
                for j in range(s + 1 if at_end else s):
                    total += pair.error[e, j] * slope[j, k]
                scale = tolerance
                if k >= m:
                    scale *= max(SLOW * model.rate_scale, abs(new[k]))
                estimate[e] = max(estimate[e], abs(h * total) / scale)
        error = estimate[0]
        if pair.error.shape[0] == 2:
            both = math.sqrt(estimate[0] ** 2 + 0.01 * estimate[1] ** 2)
            error = estimate[0] ** 2 / max(both, 1e-300)
        factor = SAFETY * max(error, 1e-12) ** (-1.0 / pair.order)
        if error <= 1.0:
            time = until if last else time + h
            y[:] = new
            if not at_end:
                slope[s, :m] = y[m:]
                smooth_accelerations(0, model, y[:m], y[m:], work, slope[s, m:])
                evaluations += 1
            slope[0, :] = slope[s, :]
        h *= min(max(factor, SHRINK), GROW if error <= 1.0 else 1.0)
    return evaluations


@cache
def dp54() -> Pair:
    """Return Dormand and Prince's 5(4), the pair of the engine."""
    last = dormand_prince.STAGES - 1
    weight = dormand_prince.WEIGHT
    return Pair(
        weight=np.ascontiguousarray(weight[:last]),
        step=weight[last].copy(),
        error=dormand_prince.ERROR[None].copy(),
        order=dormand_prince.ORDER,
    )


@cache
def dop853() -> Pair:
    """Return Dormand and Prince's 8(5,3), with SciPy's coefficients."""
    table: Any = importlib.import_module("scipy.integrate").DOP853  # slow to import
    return Pair(
        weight=np.ascontiguousarray(table.A),
        step=np.array(table.B, dtype=np.float64),
        error=np.stack([table.E5, table.E3]),
        order=8,
    )


@allocating_kernel
def adams(  # noqa: PLR0912, PLR0915 - one step, read from top to bottom
    model: Model, work: Work, y: Array, until: float, tolerance: float
) -> int:
    """Advance by Adams' predictor-corrector method of variable order and step.

    Modified divided differences after Krogh and Shampine and Gordon, in the notation of Hairer,
    Nørsett and Wanner, section III.5: predict with order k, evaluate, correct with order k + 1,
    evaluate.
    """
    m = y.size // 2
    size = 2 * m
    # phi[j] is the difference of order j at the present point, star[j] the same as the next step
    # sees it, fresh[j] that at the next point.
    phi, star = np.zeros((HIGHEST + 3, size)), np.zeros((HIGHEST + 3, size))
    fresh = np.zeros((HIGHEST + 3, size))
    past = np.zeros(HIGHEST + 3)  # times of the present point and those before
    g = np.zeros(HIGHEST + 3)
    new, slope = np.zeros(size), np.zeros(size)
    time, h, k, known = 0.0, 1e-3 * tolerance**0.5 / model.rate_scale, 1, 0
    starting = True
    slope[:m] = y[m:]
    smooth_accelerations(0, model, y[:m], y[m:], work, slope[m:])
    phi[0] = slope
    evaluations = 1
    while time < until:
        if not h > SHORTEST * until:
            return -1
        last = h >= until - time
        h = min(h, until - time)
        ahead = time + h
        coefficients(g, k + 1, ahead, h, past, known)
        beta = 1.0
        for j in range(k + 1):
            if j > 0 and j <= known:
                beta *= (ahead - past[j - 1]) / (time - past[j])
            for i in range(size):
                star[j, i] = beta * phi[j, i]
        for i in range(size):
            total = 0.0
            for j in range(k):
                total += g[j] * star[j, i]
            new[i] = y[i] + h * total
        slope[:m] = new[m:]
        smooth_accelerations(0, model, new[:m], new[m:], work, slope[m:])
        evaluations += 1
        differences(fresh, slope, star, k)
        for i in range(size):
            new[i] += h * g[k] * fresh[k, i]
        error = weigh(fresh[k], h * (g[k] - g[k - 1]), new, model, tolerance)
        lower = np.inf
        if k > 1:
            lower = weigh(fresh[k - 1], h * (g[k - 1] - g[k - 2]), new, model, tolerance)
        if error > 1.0:
            starting = False
            if lower < error:
                k -= 1
            h *= 0.5
            continue
        time = until if last else ahead
        y[:] = new
        for j in range(HIGHEST + 2, 0, -1):
            past[j] = past[j - 1]
        past[0] = time
        known = min(known + 1, HIGHEST + 1)
        slope[:m] = y[m:]
        smooth_accelerations(0, model, y[:m], y[m:], work, slope[m:])
        evaluations += 1
        differences(fresh, slope, star, k + 1)
        phi[: k + 2] = fresh[: k + 2]
        higher = np.inf
        if k < HIGHEST and known > k:
            higher = weigh(fresh[k + 1], h * (g[k + 1] - g[k]), new, model, tolerance)
        if k > 1 and lower <= error:
            k, error, starting = k - 1, lower, False
        elif k < HIGHEST and known > k and (starting or higher < error):
            k, error = k + 1, min(higher, error)
        room = (0.5 / max(error, 1e-300)) ** (1.0 / (k + 1))
        # Steps are kept or doubled: differences of equal steps lose the least to rounding.
        if room >= DOUBLE or (starting and room >= 1.0):
            h *= DOUBLE
        elif room < 1.0:
            h *= min(max(room, 0.5), 0.9)
    return evaluations


@allocating_kernel
def coefficients(g: Array, most: int, ahead: float, h: float, past: Array, known: int) -> None:
    """Integrals g[0] to g[most] of the Newton basis over the step to the time ``ahead``."""
    c = np.zeros(most + 2)
    for q in range(most + 2):
        c[q] = 1.0 / (q + 1.0)
    g[0] = 1.0
    for j in range(1, most + 1):
        span = ahead - past[min(j - 1, known)]
        for q in range(most + 1 - j):
            c[q] -= c[q + 1] * h / span
        g[j] = c[0]


@allocating_kernel
def differences(fresh: Array, slope: Array, star: Array, most: int) -> None:
    """Differences up to order ``most`` at the new point, whose slope is given."""
    for i in range(slope.size):
        fresh[0, i] = slope[i]
    for j in range(most):
        for i in range(slope.size):
            fresh[j + 1, i] = fresh[j, i] - star[j, i]


@allocating_kernel
def weigh(difference: Array, factor: float, new: Array, model: Model, tolerance: float) -> float:
    """Largest entry of an error estimate over what is allowed."""
    m = new.size // 2
    worst = 0.0
    for i in range(2 * m):
        scale = tolerance
        if i >= m:
            scale *= max(SLOW * model.rate_scale, abs(new[i]))
        worst = max(worst, abs(factor * difference[i]) / scale)
    return worst
