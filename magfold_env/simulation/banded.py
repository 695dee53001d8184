"""Solve equations with a band matrix, in an order of operations that is fixed on all machines.

Libraries choose loops that suit the processor, and these round differently.
"""

from magfold_env.engine.compile.jit import kernel
from magfold_env.engine.state import Array


@kernel
def factor_banded(band: Array) -> None:
    """Factor a band matrix for `solve_banded`, without pivoting.

    ``band`` (rows, 2 w + 1) contains every row's entries from w left of the diagonal to w right of
    it; entries outside the matrix are not read. The factors replace it.
    """
    rows, half = band.shape[0], band.shape[1] // 2
    for c in range(rows):
        for r in range(c + 1, min(c + half + 1, rows)):
            share = band[r, half + c - r] / band[c, half]
            band[r, half + c - r] = share
            for k in range(c + 1, min(c + half + 1, rows)):
                band[r, half + k - r] -= share * band[c, half + k - c]


@kernel
def solve_banded(band: Array, right: Array) -> None:
    """Replace the right-hand sides (rows, k) with the solutions, given the factored matrix."""
    rows, half = right.shape[0], band.shape[1] // 2
    for c in range(rows):
        for r in range(c + 1, min(c + half + 1, rows)):
            for k in range(right.shape[1]):
                right[r, k] -= band[r, half + c - r] * right[c, k]
    for r in range(rows - 1, -1, -1):
        for c in range(r + 1, min(r + half + 1, rows)):
            share = band[r, half + c - r]
            for k in range(right.shape[1]):
                right[r, k] -= share * right[c, k]
        for k in range(right.shape[1]):
            right[r, k] /= band[r, half]
