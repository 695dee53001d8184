"""Cholesky's method for small dense matrices, row by row, vectorised without reordering sums.

A equals UᵀU. Each row immediately updates the rest of A, so no loop adds into a single number.
"""

import math

from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.state import Array, IntArray


@kernel
def load(size: int, source: Array, taken: IntArray, diagonal: Array, matrix: Array) -> None:
    """Copy the upper triangle of ``source`` plus ``diagonal`` to ``matrix``, for `factorise`.

    Rows that are not ``taken`` get a diagonal of 0, so that `factorise` leaves them out.
    """
    for r in range(size):
        row, copied = source[r], matrix[r]
        for c in range(r, size):
            copied[c] = row[c]
        copied[r] = row[r] + diagonal[r] if taken[r] == 1 else 0.0


@inlined
def finish_row(k: int, size: int, matrix: Array, inverse: Array) -> bool:
    """Divide row k by the root of its pivot, or clear it; return whether the pivot was positive."""
    row, pivot = matrix[k], matrix[k, k]
    positive = pivot > 0.0
    inverse[k] = 1.0 / math.sqrt(pivot) if positive else 0.0
    for j in range(k, size):
        row[j] *= inverse[k]
    return positive


@kernel
def factorise(size: int, matrix: Array, inverse: Array) -> bool:
    """Replace the upper triangle of ``size`` rows by U; return whether A is positive definite.

    A row whose pivot is not positive is left out, as if its unknown were zero. ``inverse`` gets the
    reciprocals of the diagonal, and 0 for rows that are left out.
    """
    definite = True
    # Two rows are handled at a time, because the loops are short.
    for k in range(0, size - 1, 2):
        one, other = matrix[k], matrix[k + 1]
        definite = finish_row(k, size, matrix, inverse) and definite
        for j in range(k + 1, size):
            other[j] -= one[k + 1] * one[j]
        definite = finish_row(k + 1, size, matrix, inverse) and definite
        for i in range(k + 2, size):
            x, y, below = one[i], other[i], matrix[i]
            for j in range(i, size):
                below[j] = below[j] - x * one[j] - y * other[j]
    if size % 2 == 1:
        definite = finish_row(size - 1, size, matrix, inverse) and definite
    return definite


@kernel
def solve(size: int, matrix: Array, inverse: Array, x: Array) -> None:
    """Replace ``x`` with the solution of A y = x."""
    for k in range(size):
        x[k] *= inverse[k]
        z, row = x[k], matrix[k]
        for j in range(k + 1, size):
            x[j] -= z * row[j]
    for k in range(size - 1, -1, -1):
        x[k] *= inverse[k]
        y = x[k]
        for j in range(k):
            x[j] -= matrix[j, k] * y
