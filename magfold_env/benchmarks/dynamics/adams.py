"""Adams' predictor-corrector method of variable order and step, as a reference.

Modified divided differences after Krogh and Shampine and Gordon, in the notation of Hairer,
Nørsett and Wanner, Solving Ordinary Differential Equations I, section III.5: predict with order k,
evaluate, correct with order k + 1, evaluate.
"""

from __future__ import annotations

import numpy as np

from magfold_env.engine.compile.jit import allocating_kernel
from magfold_env.engine.state import Array, Model, Work
from magfold_env.engine.stepping.dynamics import smooth_accelerations

HIGHEST = 12  # order of the predictor
SHORTEST = 1e-15  # step, as a share of the whole time
DOUBLE = 2.0
SLOW = 0.3  # share of a typical rate below which rates are judged by it


@allocating_kernel
def adams(  # noqa: PLR0912, PLR0915 - one step, read from top to bottom
    model: Model, work: Work, y: Array, until: float, tolerance: float
) -> int:
    """Advance ``y`` (headings, base, their rates) in place; return the evaluations.

    −1 if steps became too short.
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
