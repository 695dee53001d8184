"""Contact forces together with friction that may hold, or be overcome.

With W = G Gᵀ and y = Gᵀλ the accelerations of the rows are w = G y + b, where y minimises

    ½ |y|² + Σ grip |w|    over all components, subject to w ≥ 0 in contacts, w = 0 in equalities

(Gauss's principle with friction's power). The multipliers λ of this convex problem are the forces.
The method of multipliers replaces λ by the projection p of t = λ − σ w onto the forces that can
act, with w taken where a smooth convex function, that with gradient y − Gᵀp, is least; Newton's
method finds it. y has as many entries as the chain has coordinates, however many rows there are,
and the function stays strictly convex where λ is not unique. Sources: Rockafellar, Math. Oper.
Res. 1 (1976) 97, for the outer loop; Qi and Sun, Math. Program. 58 (1993) 353, for the inner.

All rows are scaled, see `engine.scaled_rows`.
"""

from __future__ import annotations

import math

from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.friction.feasible_forces import friction_slope, move_forces, project_forces
from magfold_env.engine.friction.scaled_rows import factorise, scale_rows
from magfold_env.engine.state import Array, Work

# What may be left of the accelerations, as a share of the largest bias: usually, and if that is out
# of reach, where rows repeat each other so nearly that W hardly shows the difference, or masses are
# so far apart that rounding hides it.
CONVERGED = 1e-12
ACCEPTABLE = 1e-8
EPSILON = 1e-15  # rounding error of a row's acceleration, as a share of the largest bias
FIRST_PENALTY = 1e5
LAST_PENALTY = 1e12
GROWTH = 10.0  # of the penalty σ, when a round leaves more than the share below
PROGRESS = 0.1
ROUNDS = 40
ENOUGH_ROUNDS = 20  # after which what is acceptable will do
STEPS = 40  # of Newton's method in a round
HALVINGS = 30
INEXACT = 0.1  # largest gradient at the end of a round, as a share of what is left


@kernel
def evaluate(
    rows: int, count: int, rank: int, penalty: float, work: Work, grip: Array
) -> float:  # fmt: skip
    """Find w, p and the gradient at ``work.newton.point``; return the size of the gradient."""
    newton = work.newton
    factor, point, gradient = newton.factor, newton.point, newton.gradient
    for r in range(count):
        w = newton.offset[r]
        for m in range(rank):
            w += factor[r, m] * point[m]
        newton.rate[r] = w
        newton.projected[r] = newton.force[r] - penalty * w
    project_forces(rows, count, work, grip, newton.projected)
    for m in range(rank):
        gradient[m] = point[m]
    for r in range(count):
        p = newton.projected[r]
        if p != 0.0:
            for m in range(rank):
                gradient[m] -= factor[r, m] * p
    total = 0.0
    for m in range(rank):
        total += gradient[m] * gradient[m]
    return math.sqrt(total)


@inlined
def add_square(rank: int, weight: float, vector: Array, matrix: Array) -> None:
    """Add weight · vector vectorᵀ to the lower triangle."""
    for m in range(rank):
        x = weight * vector[m]
        for k in range(m + 1):
            matrix[m, k] += x * vector[k]


@kernel
def fill_hessian(
    rows: int, count: int, rank: int, penalty: float, work: Work, grip: Array
) -> None:  # fmt: skip
    """1 + σ Gᵀ P G, with P the derivative of the projection at t."""
    newton = work.newton
    factor, hessian, mean = newton.factor, newton.hessian, newton.step
    for m in range(rank):
        for k in range(m):
            hessian[m, k] = 0.0
        hessian[m, m] = 1.0
    for r in range(rows):
        if work.equality[r] == 1 or newton.projected[r] > 0.0:
            add_square(rank, penalty, factor[r], hessian)
    for r in range(rows, count, 3):
        share = friction_slope(r, penalty, work, grip)
        for m in range(rank):
            mean[m] = 0.0
            for k in range(r, r + 3):
                mean[m] += newton.normal[k] * factor[k, m]
        for k in range(r, r + 3):
            add_square(rank, penalty * share, factor[k], hessian)
        add_square(rank, -penalty * share, mean, hessian)


@kernel
def newton_step(count: int, rank: int, work: Work) -> None:
    """Solve hessian · step = −gradient by Cholesky's method, and find ``along`` = G step."""
    newton = work.newton
    matrix, step = newton.hessian, newton.step
    for m in range(rank):
        for k in range(m + 1):
            total = matrix[m, k]
            for j in range(k):
                total -= matrix[m, j] * matrix[k, j]
            # The matrix is no less than 1, and so are its pivots, but for rounding.
            matrix[m, k] = math.sqrt(max(total, 1.0)) if m == k else total / matrix[k, k]
    for m in range(rank):
        total = -newton.gradient[m]
        for k in range(m):
            total -= matrix[m, k] * step[k]
        step[m] = total / matrix[m, m]
    for m in range(rank - 1, -1, -1):
        total = step[m]
        for k in range(m + 1, rank):
            total -= matrix[k, m] * step[k]
        step[m] = total / matrix[m, m]
    for r in range(count):
        total = 0.0
        for m in range(rank):
            total += newton.factor[r, m] * step[m]
        newton.along[r] = total


@kernel
def slope_at(
    share: float, rows: int, count: int, rank: int, penalty: float, work: Work, grip: Array
) -> float:
    """Find the derivative along the step, after ``share`` of it."""
    newton = work.newton
    for r in range(count):
        rate = newton.rate[r] + share * newton.along[r]
        newton.projected[r] = newton.force[r] - penalty * rate
    project_forces(rows, count, work, grip, newton.projected)
    total = 0.0
    for m in range(rank):
        total += newton.step[m] * (newton.point[m] + share * newton.step[m])
    for r in range(count):
        total -= newton.along[r] * newton.projected[r]
    return total


@kernel
def step_length(
    rows: int, count: int, rank: int, penalty: float, work: Work, grip: Array
) -> float:  # fmt: skip
    """Share of the Newton step to take: all, or about as much as descends.

    Slopes are compared, not values, whose differences would be lost in rounding.
    """
    start = 0.0
    for m in range(rank):
        start += work.newton.step[m] * work.newton.gradient[m]
    low, low_slope = 0.0, start
    high, high_slope = 1.0, slope_at(1.0, rows, count, rank, penalty, work, grip)
    if high_slope <= -1e-3 * start:
        return 1.0
    for _ in range(HALVINGS):
        share = low + (high - low) * min(max(low_slope / (low_slope - high_slope), 0.1), 0.9)
        slope = slope_at(share, rows, count, rank, penalty, work, grip)
        if abs(slope) <= -0.1 * start:
            return share
        if slope < 0.0:
            low, low_slope = share, slope
        else:
            high, high_slope = share, slope
    return low


@kernel
def begin_round(count: int, rank: int, work: Work) -> None:
    """Find λ and the rates under it by W itself, and the offset that makes G y give the same.

    So neither the rounding errors of G nor those of σ w stay in the result.
    """
    newton, lam = work.newton, work.multiplier
    for r in range(count):
        lam[r] = newton.scale[r] * newton.force[r]
    for m in range(rank):
        total = 0.0
        for r in range(count):
            total += newton.factor[r, m] * newton.force[r]
        newton.point[m] = total
    for r in range(count):
        w = work.bias[r]
        for c in range(count):
            w += work.delassus[r, c] * lam[c]
        newton.rate[r] = w * newton.scale[r]
        newton.offset[r] = newton.rate[r]
        for m in range(rank):
            newton.offset[r] -= newton.factor[r, m] * newton.point[m]


@kernel
def error_left(rows: int, count: int, work: Work, grip: Array) -> float:
    """Size of the change of the forces by one step of projected gradient descent, 0 at the end."""
    newton = work.newton
    for r in range(count):
        newton.projected[r] = newton.force[r] - newton.rate[r]
    project_forces(rows, count, work, grip, newton.projected)
    total = 0.0
    for r in range(count):
        total += (newton.projected[r] - newton.force[r]) ** 2
    return math.sqrt(total)


@kernel
def minimise(
    rows: int, count: int, rank: int, penalty: float, largest: float, work: Work, grip: Array
) -> bool:
    """Find the forces at the smooth function's minimum; False and none if Newton's steps fail."""
    newton = work.newton
    for _ in range(STEPS):
        size = evaluate(rows, count, rank, penalty, work, grip)
        moved = 0.0
        for r in range(count):
            moved = max(moved, abs(newton.projected[r] - newton.force[r]))
        fill_hessian(rows, count, rank, penalty, work, grip)
        newton_step(count, rank, work)
        if size <= max(INEXACT * moved / penalty, EPSILON * penalty * largest):
            # The last step is taken to first order, in p: its errors are those of w times σ.
            for r in range(count):
                newton.along[r] *= -penalty
            move_forces(rows, count, penalty, work, grip, newton.along)
            return True
        share = step_length(rows, count, rank, penalty, work, grip)
        for m in range(rank):
            newton.point[m] += share * newton.step[m]
    return False


@kernel
def solve_with_friction(rows: int, count: int, work: Work, grip: Array) -> bool:
    """Find λ with λ ≥ 0, w ≥ 0, λ w = 0 in the first ``rows``, and friction in the others.

    Rows from ``rows`` on come in threes, each a friction force in the ball of radius ``grip`` of
    its component (named in ``work.row_id``), opposed to the acceleration it leaves. Of the first,
    those marked in ``work.equality`` have w = 0 and any λ. Rows that no force accelerates are left
    alone. Returns whether the accelerations were found; λ is in ``work.multiplier``.
    """
    newton = work.newton
    scale_rows(rows, count, work)
    rank = factorise(count, work)
    largest = 0.0
    for r in range(count):
        largest = max(largest, abs(work.bias[r]) * newton.scale[r])
        newton.force[r] = 0.0
    penalty, left, found = FIRST_PENALTY, math.inf, True
    for done in range(ROUNDS):
        begin_round(count, rank, work)
        before, left = left, error_left(rows, count, work, grip)
        enough = CONVERGED if done < ENOUGH_ROUNDS else ACCEPTABLE
        if left <= enough * largest:
            return True
        if not math.isfinite(left):
            return False
        # A large penalty makes rounds few, and its product with w's rounding errors large.
        if not found or left > before:
            penalty /= GROWTH
        elif left > PROGRESS * before:
            penalty = min(GROWTH * penalty, LAST_PENALTY)
        found = minimise(rows, count, rank, penalty, largest, work, grip)
    return left <= ACCEPTABLE * largest
