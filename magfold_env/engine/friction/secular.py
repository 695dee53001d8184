"""Friction that holds or is overcome, found by the sizes of its forces: fast, where it succeeds.

A component that friction does not hold slides: its force λ has the size of the limit and is opposed
to the rate w it leaves, w = −s λ with s > 0. With the s of all components known, and s = 0 where
friction holds, the forces solve a linear system, (W + s) λ = −b; that their sizes are the grips are
as many equations for s. As in trust regions, where there is one such s, Newton's method takes the
reciprocals of the sizes, which are nearly linear in s (Moré, Sorensen, SIAM J. Sci. Stat. Comput. 4
(1983) 553). Which components are held and which contacts press is corrected in every step, as by
primal-dual active sets (Hintermüller, Ito, Kunisch, SIAM J. Optim. 13 (2002) 865). A few sweeps of
relaxation tell where to begin. Nothing guarantees success: `engine.friction.solver` judges what is
found, and has a method that does not fail.
"""

import math

from magfold_env.engine import cholesky
from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.contact.equalities import refine, ridge
from magfold_env.engine.elementary import square
from magfold_env.engine.friction.law import size_of
from magfold_env.engine.state import Array, Work

SWEEPS = 6
OVER = 1.5  # relaxation of the balls, over the mean of their rows' diagonals times three
FULL = 0.999  # share of the limit from which a component is taken to slide
STEPS = 12
EXACT = 1e-12  # sizes of forces over grips, less 1; rates over the largest bias
DEPENDENT = 1e-14  # share of its diagonal


@kernel
def push(count: int, r: int, change: float, work: Work) -> None:
    """Add ``change`` to the force of row r, and what it does to all rates."""
    rate, row = work.rows.rate, work.rows.delassus[r]
    work.rows.multiplier[r] += change
    for c in range(count):
        rate[c] += change * row[c]


@kernel
def relax(rows: int, count: int, work: Work, limit: Array) -> None:
    """Sweep over the rows a few times, each of which takes the force that is best for itself."""
    lam, rate = work.rows.multiplier, work.rows.rate
    delassus, normal = work.rows.delassus, work.friction.newton.normal
    for r in range(count):
        lam[r] = 0.0
        rate[r] = work.rows.bias[r]
    for _ in range(SWEEPS):
        for r in range(rows):
            if delassus[r, r] > 0.0:
                wanted = lam[r] - rate[r] / delassus[r, r]
                if work.rows.equality[r] == 0:
                    wanted = max(wanted, 0.0)
                push(count, r, wanted - lam[r], work)
        for r in range(rows, count, 3):
            trace = delassus[r, r] + delassus[r + 1, r + 1] + delassus[r + 2, r + 2]
            radius = limit[work.rows.id[r, 0]]
            if not (trace > 0.0 and radius > 0.0):
                continue
            total = 0.0
            for k in range(r, r + 3):
                normal[k] = lam[k] - OVER / trace * rate[k]
                total += square(normal[k])
            size = math.sqrt(total)
            share = radius / size if size > radius else 1.0
            for k in range(r, r + 3):
                push(count, k, share * normal[k] - lam[k], work)


@kernel
def classify(rows: int, count: int, work: Work, limit: Array) -> None:
    """Guess by the relaxed forces what presses, and what slides how fast."""
    secular, delassus = work.friction.secular, work.rows.delassus
    for r in range(rows):
        secular.share[r] = 0.0
        presses = work.rows.equality[r] == 1 or work.rows.multiplier[r] > 0.0
        secular.active[r] = int(presses and delassus[r, r] > 0.0)
    for r in range(rows, count, 3):
        radius, total, share = limit[work.rows.id[r, 0]], 0.0, 0.0
        trace = delassus[r, r] + delassus[r + 1, r + 1] + delassus[r + 2, r + 2]
        for k in range(r, r + 3):
            total += square(work.rows.rate[k])
        if radius > 0.0 and size_of(work.rows.multiplier, r) > FULL * radius:
            share = math.sqrt(total) / radius
        for k in range(r, r + 3):
            secular.active[k] = int(radius > 0.0 and trace > 0.0)
            secular.share[k] = share


@kernel
def find_forces(count: int, work: Work) -> None:
    """Solve (W + s) λ = −b on the active rows; leaves the factor in ``work.rows.cholesky``."""
    secular = work.friction.secular
    diagonal, active, share = work.rows.diagonal, secular.active, secular.share
    for r in range(count):
        diagonal[r] = share[r] if share[r] > 0.0 else ridge(work, r)
    cholesky.load(count, work.rows.delassus, active, diagonal, work.rows.cholesky)
    cholesky.factorise(count, work.rows.cholesky, work.rows.inverse)
    refine(count, work, active, share, work.rows.multiplier, work.rows.rate)


@kernel
def correct_contacts(rows: int, work: Work, allowed: float) -> bool:
    """Let go the contacts that would pull, take in those that would close; whether any."""
    secular, delassus, changed = work.friction.secular, work.rows.delassus, False
    for r in range(rows):
        if work.rows.equality[r] == 1 or not delassus[r, r] > 0.0:
            continue
        if secular.active[r] == 1:
            stays = work.rows.multiplier[r] >= 0.0
        else:
            stays = work.rows.rate[r] < -allowed / math.sqrt(delassus[r, r])
        changed = changed or secular.active[r] != int(stays)
        secular.active[r] = int(stays)
    return changed


@kernel
def correct_shares(rows: int, count: int, work: Work, limit: Array) -> tuple[bool, float]:
    """Newton's step for the s of all that slides or is asked too much of.

    Returns whether there was one, and how far the sizes of forces were off their grips.
    """
    secular, matrix, inverse = work.friction.secular, work.rows.cholesky, work.rows.inverse
    balls, worst = 0, 0.0
    for r in range(rows, count, 3):
        if secular.active[r] == 0:
            continue
        size = size_of(work.rows.multiplier, r)
        excess = size / limit[work.rows.id[r, 0]] - 1.0
        if secular.share[r] == 0.0 and excess <= EXACT:
            continue
        worst = max(worst, float(abs(excess)))
        secular.first[balls] = r
        secular.step[balls] = size * size * excess
        balls += 1
    if worst <= EXACT:
        return True, worst
    for i in range(balls):
        r, image = secular.first[i], secular.image[i]
        for k in range(r + 3, count):
            image[k] = 0.0
        for k in range(r, r + 3):
            image[k] = work.rows.multiplier[k]
        cholesky.solve_lower(r, count, matrix, inverse, image)
        for j in range(i + 1):
            total, other = 0.0, secular.image[j]
            for k in range(r, count):
                total += image[k] * other[k]
            secular.curvature[j, i] = total
        secular.curvature[i, i] *= 1.0 + DEPENDENT
    if not cholesky.factorise(balls, secular.curvature, secular.inverse):
        return False, worst
    cholesky.solve(balls, secular.curvature, secular.inverse, secular.step)
    for i in range(balls):
        r = secular.first[i]
        share = max(secular.share[r] + secular.step[i], 0.0)
        for k in range(r, r + 3):
            secular.share[k] = share
    return True, worst


@inlined
def cut_to_grip(rows: int, count: int, work: Work, limit: Array) -> None:
    """Take away by what rounding makes forces larger than what friction can do."""
    for r in range(rows, count, 3):
        size, radius = size_of(work.rows.multiplier, r), limit[work.rows.id[r, 0]]
        if size > radius:
            for k in range(r, r + 3):
                work.rows.multiplier[k] *= radius / size


@kernel
def solve_by_sizes(rows: int, count: int, work: Work, limit: Array) -> bool:
    """Find λ as `engine.friction.solver.solve_with_friction` does; False if that takes too long."""
    allowed = 0.0
    for r in range(count):
        if work.rows.delassus[r, r] > 0.0:
            allowed = max(
                allowed, EXACT * abs(work.rows.bias[r]) / math.sqrt(work.rows.delassus[r, r])
            )
    relax(rows, count, work, limit)
    classify(rows, count, work, limit)
    for _ in range(STEPS):
        find_forces(count, work)
        changed = correct_contacts(rows, work, allowed)
        found, worst = correct_shares(rows, count, work, limit)
        if not found:
            return False
        if not changed and worst <= EXACT:
            cut_to_grip(rows, count, work, limit)
            return True
    return False
