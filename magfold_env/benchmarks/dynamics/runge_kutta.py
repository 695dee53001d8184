"""Embedded Runge-Kutta pairs with error control, as references.

One kernel for any explicit pair; its coefficients are arguments.
"""

from __future__ import annotations

import importlib
import math
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from magfold_env.engine.compile.jit import allocating_kernel
from magfold_env.engine.state import Array, Model, Work
from magfold_env.engine.stepping import dormand_prince
from magfold_env.engine.stepping.dynamics import smooth_accelerations

SAFETY = 0.9
SHRINK, GROW = 0.2, 5.0
SHORTEST = 1e-15  # step, as a share of the whole time
SLOW = 0.3  # share of a typical rate below which rates are judged by it


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
    """Advance ``y`` (headings, base, their rates) in place; return the evaluations.

    −1 if steps became too short. The error of angles is kept below the tolerance [rad], that of
    rates below the tolerance times the rate, or a share of a typical rate. Two estimates are
    combined as in Hairer, Nørsett and Wanner, Solving Ordinary Differential Equations I, II.10.
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
    """Return Dormand and Prince's 8(5,3), with SciPy's coefficients.

    Raises
    ------
    ImportError
        If SciPy is not installed.
    """
    try:
        table: Any = importlib.import_module("scipy.integrate._ivp.dop853_coefficients")
    except ImportError as error:
        msg = "the comparison with DOP853 needs SciPy: install the extra, magfold_env[dev]"
        raise ImportError(msg) from error
    stages = int(table.N_STAGES)
    return Pair(
        weight=np.ascontiguousarray(table.A[:stages, :stages]),
        step=np.array(table.B, dtype=np.float64),
        error=np.stack([table.E5, table.E3]),
        order=8,
    )
