"""Multipliers for w = 0 in some rows, with w = W λ + b; λ of the others is zero."""

from magfold_env.engine import cholesky
from magfold_env.engine import indices as ix
from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.state import Array, IntArray, Work

RIDGE = 1e-11
CANCEL, SOFT = 1e4, 1e-6  # sums of multipliers that cancel; ridge of the least that do not


@inlined
def ridge(work: Work, r: int) -> float:
    """Return what is added to row r's diagonal, since rows may repeat each other.

    A share of it, which picks of all λ that do the same the least, and changes velocities by as
    little. Stops of joints never repeat each other. With no ridge they, and not friction, carry
    what rigidly joined components that friction holds exert on each other.
    """
    return 0.0 if r < work.rows.counts[ix.JOINT_STOPS] else RIDGE * work.rows.delassus[r, r]


@kernel
def refine(
    count: int, work: Work, active: IntArray, diagonal: Array, lam: Array, rate: Array
) -> None:
    """Solve (W + ``diagonal``) λ = −b on the ``active`` rows with a factor of nearly that matrix.

    The second pass takes out of the rates what the ridge left in them. Leaves w in ``rate``.
    """
    delassus, bias, change = work.rows.delassus, work.rows.bias, work.rows.update
    for r in range(count):
        lam[r] = 0.0
        rate[r] = bias[r]
    for _ in range(2):
        for r in range(count):
            change[r] = -rate[r] - diagonal[r] * lam[r] if active[r] == 1 else 0.0
        cholesky.solve(count, work.rows.cholesky, work.rows.inverse, change)
        for r in range(count):
            if active[r] == 1:
                lam[r] += change[r]
                push, row = change[r], delassus[r]
                for c in range(count):
                    rate[c] += push * row[c]


@kernel
def solve_passive(count: int, work: Work, lam: Array) -> None:
    """Solve W λ = −b on the rows marked as passive, into ``lam``; w is left in ``rate``."""
    diagonal, passive = work.rows.diagonal, work.rows.passive
    for r in range(count):
        diagonal[r] = ridge(work, r)
    cholesky.load(count, work.rows.delassus, passive, diagonal, work.rows.cholesky)
    cholesky.factorise(count, work.rows.cholesky, work.rows.inverse)
    for r in range(count):
        diagonal[r] = 0.0
    refine(count, work, passive, diagonal, lam, work.rows.rate)


@kernel
def take_least(count: int, work: Work) -> None:
    """Replace multipliers that all but cancel by the least ones that change the rates alike.

    Where two rows say of one contact nearly the same, what they say together may take huge
    multipliers that do next to nothing, but for an impulse on the drive.
    """
    delassus, passive, lam = work.rows.delassus, work.rows.passive, work.rows.multiplier
    diagonal, change = work.rows.diagonal, work.rows.update
    largest, most = 0.0, 0.0
    for r in range(count):
        total, size = 0.0, 0.0
        for c in range(count):
            part = delassus[r, c] * lam[c]
            total, size = total + part, size + abs(part)
        change[r] = total
        largest, most = max(largest, abs(total)), max(most, size)
    if most <= CANCEL * largest:
        return
    for r in range(count):
        passive[r] = int(lam[r] != 0.0)
        diagonal[r] = SOFT * delassus[r, r]
    cholesky.load(count, delassus, passive, diagonal, work.rows.cholesky)
    cholesky.factorise(count, work.rows.cholesky, work.rows.inverse)
    cholesky.solve(count, work.rows.cholesky, work.rows.inverse, change)
    for r in range(count):
        lam[r] = change[r] if passive[r] == 1 else 0.0
