"""Small complementarity problems: unilateral constraints.

They are solved for multipliers λ of the rows, with W = J M⁻¹ Jᵀ (positive semidefinite, often
singular: impulses in closed loops are not unique, the velocities they cause are) and
w = W λ + b the rows' own velocity or acceleration.
"""

import math

from magfold_env.engine.compile.jit import kernel
from magfold_env.engine.friction.solver import solve_with_friction
from magfold_env.engine.state import Array, Rows, Work

# Rows may repeat each other; a share of the diagonal added to it picks one λ of the many and
# changes the velocities by as little.
RIDGE = 1e-11
ROUNDING = 1e-10
CANCELLED = 1e-13


@kernel
def solve_passive(count: int, rows: Rows, trial: Array) -> None:
    """Solve W λ = −b on the passive rows by Cholesky, into ``trial``; λ of the others is zero."""
    delassus, bias, passive, index = rows.delassus, rows.bias, rows.passive, rows.order
    cholesky, update = rows.cholesky, rows.update
    size = 0
    for r in range(count):
        trial[r] = 0.0
        if passive[r] == 0:
            continue
        for k in range(size):
            total = delassus[r, index[k]]
            for m in range(k):
                total -= cholesky[size, m] * cholesky[k, m]
            cholesky[size, k] = total / cholesky[k, k]
        pivot = (1.0 + RIDGE) * delassus[r, r]
        for m in range(size):
            pivot -= cholesky[size, m] * cholesky[size, m]
        if pivot <= 0.0:
            continue
        cholesky[size, size] = math.sqrt(pivot)
        index[size] = r
        size += 1
    # The first pass solves with the ridge, the second takes its trace out of the velocities.
    for _ in range(2):
        for k in range(size):
            r = index[k]
            total = -bias[r]
            for m in range(size):
                total -= delassus[r, index[m]] * trial[index[m]]
            for m in range(k):
                total -= cholesky[k, m] * update[m]
            update[k] = total / cholesky[k, k]
        for k in range(size - 1, -1, -1):
            total = update[k]
            for m in range(k + 1, size):
                total -= cholesky[m, k] * update[m]
            update[k] = total / cholesky[k, k]
        for k in range(size):
            trial[index[k]] += update[k]


@kernel
def solve_equalities(count: int, work: Work) -> None:
    """Multipliers for w = 0 in the rows marked as passive; those of the others are 0."""
    solve_passive(count, work.rows, work.rows.multiplier)


@kernel
def active_sets(count: int, work: Work) -> bool:
    """Lawson and Hanson's active sets, begun from the rows marked as passive."""
    delassus, bias, lam = work.rows.delassus, work.rows.bias, work.rows.multiplier
    passive, trial = work.rows.passive, work.rows.trial
    scale = 0.0
    for r in range(count):
        lam[r] = 0.0
        scale = max(scale, abs(bias[r]))
        if work.rows.equality[r] == 1:
            passive[r] = 1
    for _ in range(10 * count + 10):
        solve_passive(count, work.rows, trial)
        # Walk from the feasible λ towards the trial until a row would turn negative.
        fraction = 1.0
        blocking = -1
        for r in range(count):
            if passive[r] == 1 and work.rows.equality[r] == 0 and trial[r] < 0.0:
                f = lam[r] / (lam[r] - trial[r])
                if f < fraction:
                    fraction = f
                    blocking = r
        if blocking >= 0:
            for r in range(count):
                lam[r] += fraction * (trial[r] - lam[r])
            for r in range(count):
                if (
                    passive[r] == 1
                    and work.rows.equality[r] == 0
                    and (r == blocking or lam[r] < 0.0)
                ):
                    lam[r] = 0.0
                    passive[r] = 0
            continue
        worst = 0.0
        enter = -1
        for r in range(count):
            lam[r] = trial[r]
        for r in range(count):
            if passive[r] == 0:
                w = bias[r]
                size = 0.0
                for c in range(count):
                    w += delassus[r, c] * lam[c]
                    size += abs(delassus[r, c] * lam[c])
                # Rows that nearly repeat each other have large λ that cancel.
                if w < -ROUNDING * scale - CANCELLED * size and w < worst:
                    worst = w
                    enter = r
        if enter < 0:
            return True
        passive[enter] = 1
    return False


@kernel
def solve_nonnegative(count: int, work: Work) -> bool:
    """Find λ with λ ≥ 0, w ≥ 0, λ w = 0; rows marked as equalities have w = 0, any λ.

    Active sets, begun from those marked as passive, the guess that is nearly always right; if
    rounding makes them cycle, begun from nothing, and then by another method. Returns whether it
    converged.
    """
    if active_sets(count, work):
        return True
    for r in range(count):
        work.rows.passive[r] = 0
    if active_sets(count, work):
        return True
    solved = solve_with_friction(count, count, work, work.rows.bias)
    for r in range(count):
        work.rows.passive[r] = int(work.rows.equality[r] == 1 or work.rows.multiplier[r] > 0.0)
    return solved
