"""Small complementarity problems: unilateral constraints.

They are solved for multipliers λ of the rows, with W = J M⁻¹ Jᵀ (positive semidefinite, often
singular: impulses in closed loops are not unique, the velocities they cause are) and
w = W λ + b the rows' own velocity or acceleration.
"""

from magfold_env.engine.compile.jit import kernel
from magfold_env.engine.contact.equalities import solve_passive
from magfold_env.engine.friction.solver import solve_with_friction
from magfold_env.engine.state import Work

ROUNDING = 1e-10
CANCELLED = 1e-13


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
        solve_passive(count, work, trial)
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
                if (
                    passive[r] == 1
                    and work.rows.equality[r] == 0
                    and (r == blocking or lam[r] < 0.0)
                ):
                    lam[r] = 0.0
                    passive[r] = 0
            continue
        worst = -ROUNDING * scale
        enter = -1
        for r in range(count):
            lam[r] = trial[r]
        for r in range(count):
            w = work.rows.rate[r]
            if passive[r] == 0 and w < worst:
                # Rows that nearly repeat each other have large λ that cancel.
                size = 0.0
                for c in range(count):
                    size += abs(delassus[r, c] * lam[c])
                if w < -CANCELLED * size:
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
