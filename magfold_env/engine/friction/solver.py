"""Solve for contact forces, together with friction that may hold components or be overcome.

With W = G Gᵀ and y = Gᵀλ the accelerations of the rows are w = G y + b, where y minimises

    ½ |y|² + Σ limit |w|    over all components, subject to w ≥ 0 in contacts, w = 0 in equalities

(Gauss's principle with friction's power). The multipliers λ of this convex problem are the forces.
The method of multipliers finds them: it replaces λ with the projection p of t = λ − σ w onto the
admissible forces, with w at the minimum of a smooth convex function whose gradient is y − Gᵀp,
found by Newton's method. y has as many entries as the chain has coordinates, however many rows
there are, and the function is strictly convex even where λ is not unique. Sources: Rockafellar,
Math. Oper. Res. 1 (1976) 97 (outer loop); Qi and Sun, Math. Program. 58 (1993) 353 (inner loop).

All rows are scaled so that W has a unit diagonal, with one factor for the three rows of a
component: projections and tolerances then mean the same for angles and lengths. An unscaled force
is λ times the row's scale. Admissible contact forces push, an equality's force has either sign, and
a component's friction lies in a ball.
"""

import math

from magfold_env.engine import cholesky
from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.elementary import square
from magfold_env.engine.friction.law import size_of
from magfold_env.engine.state import Array, Work

# Permitted errors of the accelerations, as shares of the largest bias. The second applies if the
# first is out of reach, because rows repeat each other so closely that W hardly shows the
# difference, or because masses differ so much that rounding hides it.
CONVERGED = 1e-12
ACCEPTABLE = 1e-8
EPSILON = 1e-15  # rounding error of a row's acceleration, as a share of the largest bias
FIRST_PENALTY = 1e5
LAST_PENALTY = 1e12
GROWTH = 10.0  # of the penalty σ, if a round leaves more than the share below
PROGRESS = 0.1
SAME = 1e-3  # growth of the error to ignore if nothing else converges
ROUNDS = 40
ENOUGH_ROUNDS = 20  # after which an acceptable error suffices
STEPS = 40  # of Newton's method per round
RANK = 1e-14  # share of its diagonal up to which W is factorised
HALVINGS = 30
INEXACT = 0.1  # largest gradient at the end of a round, as a share of the remaining error


@kernel
def scale_rows(rows: int, count: int, work: Work, limit: Array) -> None:
    """Compute scales that give W a unit diagonal (0 for immovable rows), and scaled limits."""
    delassus, scale = work.rows.delassus, work.friction.newton.scale
    for r in range(rows):
        scale[r] = 1.0 / math.sqrt(delassus[r, r]) if delassus[r, r] > 0.0 else 0.0
    for r in range(rows, count, 3):
        trace = delassus[r, r] + delassus[r + 1, r + 1] + delassus[r + 2, r + 2]
        work.friction.newton.friction_limit[r] = limit[work.rows.id[r, 0]]
        for k in range(3):
            scale[r + k] = 1.0 / math.sqrt(trace) if trace > 0.0 else 0.0


@kernel
def factorise(count: int, work: Work) -> int:
    """Factorise scaled W = G Gᵀ by Cholesky's method with complete pivoting; return the rank."""
    delassus, newton = work.rows.delassus, work.friction.newton
    scale, factor, left = newton.scale, newton.factor, newton.along
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


@kernel
def project_forces(rows: int, count: int, work: Work, force: Array) -> None:
    """Replace ``force`` (count,) by the nearest admissible forces."""
    newton = work.friction.newton
    for r in range(rows):
        if work.rows.equality[r] == 0 and force[r] < 0.0:
            force[r] = 0.0
    for r in range(rows, count, 3):
        size, radius = size_of(force, r) * newton.scale[r], newton.friction_limit[r]
        if size > radius:
            for k in range(r, r + 3):
                force[k] *= radius / size


@kernel
def friction_slope(r: int, penalty: float, work: Work) -> float:
    """Compute s and u: projecting rows r to r + 2 onto their ball has the derivative s (1 − u uᵀ).

    Within the ball, s = 1 and u = 0. Returns s and leaves u in ``work.friction.newton.normal``.
    """
    newton = work.friction.newton
    for k in range(r, r + 3):
        newton.normal[k] = newton.force[k] - penalty * newton.rate[k]
    length = size_of(newton.normal, r)
    size, radius = length * newton.scale[r], newton.friction_limit[r]
    outside = size > 0.0 and size >= radius
    for k in range(r, r + 3):
        newton.normal[k] = newton.normal[k] / length if outside else 0.0
    if outside:
        return radius / size
    return 1.0 if radius > 0.0 else 0.0


@kernel
def move_forces(rows: int, count: int, penalty: float, work: Work, change: Array) -> None:
    """Set the forces to the projection of t + ``change`` (count,), to first order.

    The projection of t is in ``projected``.
    """
    newton = work.friction.newton
    for r in range(rows):
        if work.rows.equality[r] == 1 or newton.projected[r] > 0.0:
            newton.projected[r] += change[r]
    for r in range(rows, count, 3):
        share = friction_slope(r, penalty, work)
        across = 0.0
        for k in range(r, r + 3):
            across += newton.normal[k] * change[k]
        for k in range(r, r + 3):
            newton.projected[k] += share * (change[k] - across * newton.normal[k])
    for r in range(count):
        newton.force[r] = newton.projected[r]
    project_forces(rows, count, work, newton.force)


@kernel
def evaluate(rows: int, count: int, rank: int, penalty: float, work: Work) -> float:
    """Compute w, p and the gradient at y; return the norm of the gradient."""
    newton = work.friction.newton
    factor, point, gradient = newton.factor, newton.point, newton.gradient
    for r in range(count):
        w = newton.offset[r]
        for m in range(rank):
            w += factor[r, m] * point[m]
        newton.rate[r] = w
        newton.projected[r] = newton.force[r] - penalty * w
    project_forces(rows, count, work, newton.projected)
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
    """Add weight · vector vectorᵀ to the upper triangle."""
    for m in range(rank):
        x, row = weight * vector[m], matrix[m]
        for k in range(m, rank):
            row[k] += x * vector[k]


@kernel
def fill_hessian(rows: int, count: int, rank: int, penalty: float, work: Work) -> None:
    """Fill in 1 + σ Gᵀ P G, where P is the derivative of the projection at t."""
    newton = work.friction.newton
    factor, hessian, mean = newton.factor, newton.hessian, newton.step
    for m in range(rank):
        for k in range(m, rank):
            hessian[m, k] = 0.0
        hessian[m, m] = 1.0
    for r in range(rows):
        if work.rows.equality[r] == 1 or newton.projected[r] > 0.0:
            add_square(rank, penalty, factor[r], hessian)
    for r in range(rows, count, 3):
        weight = penalty * friction_slope(r, penalty, work)
        one, two, three, normal = factor[r], factor[r + 1], factor[r + 2], newton.normal
        for m in range(rank):
            mean[m] = normal[r] * one[m] + normal[r + 1] * two[m] + normal[r + 2] * three[m]
        # Four squares at once, because the loops are short.
        for m in range(rank):
            row = hessian[m]
            x, y, z, w = weight * one[m], weight * two[m], weight * three[m], -weight * mean[m]
            for k in range(m, rank):
                row[k] = row[k] + x * one[k] + y * two[k] + z * three[k] + w * mean[k]


@kernel
def newton_step(count: int, rank: int, work: Work) -> None:
    """Solve hessian · step = −gradient, and find ``along`` = G step."""
    newton = work.friction.newton
    for m in range(rank):
        newton.step[m] = -newton.gradient[m]
    cholesky.factorise(rank, newton.hessian, newton.inverse)
    cholesky.solve(rank, newton.hessian, newton.inverse, newton.step)
    for r in range(count):
        total = 0.0
        for m in range(rank):
            total += newton.factor[r, m] * newton.step[m]
        newton.along[r] = total


@kernel
def slope_at(share: float, rows: int, count: int, rank: int, penalty: float, work: Work) -> float:
    """Return the minimised function's slope along the Newton step, at the fraction ``share``."""
    newton = work.friction.newton
    for r in range(count):
        rate = newton.rate[r] + share * newton.along[r]
        newton.projected[r] = newton.force[r] - penalty * rate
    project_forces(rows, count, work, newton.projected)
    total = 0.0
    for m in range(rank):
        total += newton.step[m] * (newton.point[m] + share * newton.step[m])
    for r in range(count):
        total -= newton.along[r] * newton.projected[r]
    return total


@kernel
def step_length(rows: int, count: int, rank: int, penalty: float, work: Work) -> float:
    """Return the fraction of the Newton step at whose end the function hardly rises, or 0.

    Slopes are compared, because differences of values would be lost in rounding.
    """
    start, share = 0.0, 1.0
    for m in range(rank):
        start += work.friction.newton.step[m] * work.friction.newton.gradient[m]
    for _ in range(HALVINGS):
        if slope_at(share, rows, count, rank, penalty, work) <= -0.1 * start:
            return share
        share *= 0.5
    return 0.0


@kernel
def begin_round(count: int, rank: int, work: Work) -> None:
    """Compute λ and w from W itself, and the offset that makes G y give the same w.

    The rounding errors of G and of σ w therefore do not remain in the result.
    """
    newton, lam = work.friction.newton, work.rows.multiplier
    for r in range(count):
        lam[r] = newton.scale[r] * newton.force[r]
    for m in range(rank):
        total = 0.0
        for r in range(count):
            total += newton.factor[r, m] * newton.force[r]
        newton.point[m] = total
    for r in range(count):
        w = work.rows.bias[r]
        for c in range(count):
            w += work.rows.delassus[r, c] * lam[c]
        newton.rate[r] = w * newton.scale[r]
        newton.offset[r] = newton.rate[r]
        for m in range(rank):
            newton.offset[r] -= newton.factor[r, m] * newton.point[m]


@kernel
def error_left(rows: int, count: int, work: Work) -> float:
    """Return how much a step of projected gradient descent changes the forces; 0 if solved."""
    newton = work.friction.newton
    for r in range(count):
        newton.projected[r] = newton.force[r] - newton.rate[r]
    project_forces(rows, count, work, newton.projected)
    total = 0.0
    for r in range(count):
        total += square(newton.projected[r] - newton.force[r])
    return math.sqrt(total)


@kernel
def minimise(rows: int, count: int, rank: int, penalty: float, largest: float, work: Work) -> bool:
    """Find the forces at the smooth function's minimum; return False if Newton's method fails."""
    newton = work.friction.newton
    for _ in range(STEPS):
        size = evaluate(rows, count, rank, penalty, work)
        moved = 0.0
        for r in range(count):
            moved = max(moved, abs(newton.projected[r] - newton.force[r]))
        fill_hessian(rows, count, rank, penalty, work)
        newton_step(count, rank, work)
        if size <= max(INEXACT * moved / penalty, EPSILON * penalty * largest):
            # The last step is a first-order change of p, because p's errors are σ times w's errors.
            for r in range(count):
                newton.along[r] *= -penalty
            move_forces(rows, count, penalty, work, newton.along)
            return True
        share = step_length(rows, count, rank, penalty, work)
        for m in range(rank):
            newton.point[m] += share * newton.step[m]
    return False


@kernel
def solve_with_friction(rows: int, count: int, work: Work, limit: Array) -> bool:
    """Find λ with λ ≥ 0, w ≥ 0, λ w = 0 in the first ``rows`` rows, and friction in the others.

    The other rows are three per component (in ``work.rows.id``): a friction force that lies in a
    ball with the component's ``limit`` as its radius, and that opposes the remaining acceleration.
    Equalities among the first rows have w = 0 and any λ. Rows that no force accelerates are
    ignored. Returns whether the accelerations were found; λ is in ``work.rows.multiplier``.
    """
    scale_rows(rows, count, work, limit)
    largest = 0.0
    for r in range(count):
        largest = max(largest, abs(work.rows.bias[r]) * work.friction.newton.scale[r])
    return solve_by_multipliers(rows, count, work, largest, 0.0) or solve_by_multipliers(
        rows, count, work, largest, SAME
    )


@kernel
def solve_by_multipliers(rows: int, count: int, work: Work, largest: float, same: float) -> bool:
    """Like `solve_with_friction`, by the method of multipliers; ``largest`` is the largest bias.

    An error that grows by at most the fraction ``same`` counts as unchanged.
    """
    newton = work.friction.newton
    rank = factorise(count, work)
    newton.force[:count] = 0.0
    penalty, left, found = FIRST_PENALTY, math.inf, True
    for done in range(ROUNDS):
        begin_round(count, rank, work)
        before, left = left, error_left(rows, count, work)
        enough = CONVERGED if done < ENOUGH_ROUNDS else ACCEPTABLE
        if left <= enough * largest:
            return True
        if not math.isfinite(left):
            return False
        # A large penalty needs few rounds, but it multiplies w's rounding errors.
        if not found or left > (1.0 + same) * before:
            penalty /= GROWTH
        elif left > PROGRESS * before:
            penalty = min(GROWTH * penalty, LAST_PENALTY)
        found = minimise(rows, count, rank, penalty, largest, work)
    return left <= ACCEPTABLE * largest
