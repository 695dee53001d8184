"""Small complementarity problems, which arise from unilateral constraints.

The unknowns are the rows' multipliers λ. W = J M⁻¹ Jᵀ is positive semidefinite and often singular:
impulses in closed loops are not unique, but the velocities that they cause are. w = W λ + b is the
velocity or acceleration of the rows.
"""

from magfold_env.engine import cholesky
from magfold_env.engine import indices as ix
from magfold_env.engine.compile.jit import kernel
from magfold_env.engine.friction.solver import solve_with_friction
from magfold_env.engine.state import Array, Work

RIDGE = 1e-11
CANCEL, SOFT = 1e4, 1e-6  # ratio at which multipliers cancel; ridge for the smallest
EQUAL = 1e-4  # of the energy of a change of velocity: smaller differences do not count
ROUNDING = 1e-10
CANCELLED = 1e-13


@kernel
def solve_passive(count: int, work: Work, lam: Array) -> None:
    """Solve W λ = −b for the rows marked as passive; put λ into ``lam`` and w into ``rate``.

    Rows may repeat each other. Adding a fraction of their diagonals to W selects the smallest of
    all equivalent λ; a second pass removes the error that this leaves in the rates. Joint stops
    never repeat each other, and nothing is added to their diagonals, so that the stops, not
    friction, carry the forces between rigidly joined components that stick.
    """
    rows, stops = work.rows, work.rows.counts[ix.JOINT_STOPS]
    passive, rate, change = rows.passive, rows.rate, rows.update
    for r in range(count):
        rows.diagonal[r] = RIDGE * rows.delassus[r, r] if r >= stops else 0.0
        lam[r] = 0.0
        rate[r] = rows.bias[r]
    cholesky.load(count, rows.delassus, passive, rows.diagonal, rows.cholesky)
    cholesky.factorise(count, rows.cholesky, rows.inverse)
    for _ in range(2):
        for r in range(count):
            change[r] = -rate[r] if passive[r] == 1 else 0.0
        cholesky.solve(count, rows.cholesky, rows.inverse, change)
        for r in range(count):
            if passive[r] == 1:
                lam[r] += change[r]
                push, row = change[r], rows.delassus[r]
                for c in range(count):
                    rate[c] += push * row[c]


@kernel
def take_least(count: int, work: Work) -> None:
    """Replace multipliers that nearly cancel with the smallest ones that have the same effect.

    If two rows describe one contact almost identically, they may need huge multipliers that have
    almost no effect except an impulse on the drive. A wedge also needs huge multipliers, but these
    set components in motion, so they stay.
    """
    delassus, passive, lam = work.rows.delassus, work.rows.passive, work.rows.multiplier
    diagonal, least = work.rows.diagonal, work.rows.trial
    largest, most, energy = 0.0, 0.0, 0.0
    for r in range(count):
        total, size = 0.0, 0.0
        for c in range(count):
            part = delassus[r, c] * lam[c]
            total, size = total + part, size + abs(part)
        least[r] = total
        largest, most = max(largest, abs(total)), max(most, size)
        energy += total * lam[r]
    if most <= CANCEL * largest:
        return
    for r in range(count):
        passive[r] = int(lam[r] != 0.0)
        diagonal[r] = SOFT * delassus[r, r]
    cholesky.load(count, delassus, passive, diagonal, work.rows.cholesky)
    cholesky.factorise(count, work.rows.cholesky, work.rows.inverse)
    cholesky.solve(count, work.rows.cholesky, work.rows.inverse, least)
    off = 0.0  # energy of the difference between the two changes of velocity
    for r in range(count):
        least[r] = least[r] if passive[r] == 1 else 0.0
        rest = lam[r] - least[r]
        for c in range(r):
            off += 2.0 * rest * delassus[r, c] * (lam[c] - least[c])
        off += delassus[r, r] * rest**2
    if off <= EQUAL * energy:
        for r in range(count):
            lam[r] = least[r]


@kernel
def active_sets(count: int, work: Work) -> bool:
    """Run Lawson and Hanson's active-set method, starting from the rows marked as passive."""
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
        # Move from the feasible λ towards the trial until a row would become negative.
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
                # Rows that nearly repeat each other have large cancelling λ.
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
    """Find λ with λ ≥ 0, w ≥ 0, λ w = 0; rows marked as equalities have w = 0 and any λ.

    `active_sets` starts from the rows marked as passive, a guess that is nearly always right. If
    rounding makes it cycle, it starts again with no rows marked; if it still cycles, another method
    takes over. Returns whether the solution converged.
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
