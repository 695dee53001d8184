"""Rows of constraints and friction, scaled alike and factorised.

The Delassus matrix W gets a unit diagonal, with one factor for the three rows of a component:
projections and tolerances then mean the same for angles and lengths.
"""

from __future__ import annotations

import math

from magfold_env.engine.compile.jit import kernel
from magfold_env.engine.state import Work

RANK = 1e-14  # share of its diagonal to which W is factorised


@kernel
def scale_rows(rows: int, count: int, work: Work) -> None:
    """Factors that bring W to unit diagonal; 0 for rows that no force accelerates."""
    delassus, scale = work.delassus, work.newton.scale
    for r in range(rows):
        scale[r] = 1.0 / math.sqrt(delassus[r, r]) if delassus[r, r] > 0.0 else 0.0
    for r in range(rows, count, 3):
        trace = delassus[r, r] + delassus[r + 1, r + 1] + delassus[r + 2, r + 2]
        for k in range(3):
            scale[r + k] = 1.0 / math.sqrt(trace) if trace > 0.0 else 0.0


@kernel
def factorise(count: int, work: Work) -> int:
    """Scaled W = G Gᵀ by Cholesky's method with complete pivoting; return the rank."""
    delassus, scale, factor = work.delassus, work.newton.scale, work.newton.factor
    left = work.newton.along
    for r in range(count):
        left[r] = delassus[r, r] * scale[r] * scale[r]
    for k in range(factor.shape[1]):
        pivot = 0
        for r in range(count):
            if left[r] > left[pivot]:
                pivot = r
        if left[pivot] <= RANK:
            return k
        root = math.sqrt(left[pivot])
        for r in range(count):
            total = delassus[r, pivot] * scale[r] * scale[pivot]
            for m in range(k):
                total -= factor[r, m] * factor[pivot, m]
            factor[r, k] = total / root
            left[r] -= factor[r, k] * factor[r, k]
        left[pivot] = 0.0
    return factor.shape[1]
