"""Which resting components friction holds, and when it no longer can."""

from __future__ import annotations

import math

from magfold_env.engine.chain import articulated
from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.friction import law
from magfold_env.engine.friction.solver import solve_with_friction
from magfold_env.engine.state import LO, Array, Model, State, Work
from magfold_env.engine.stepping.dynamics import accelerations, apply_multipliers

SLACK = 0.01  # share of µ g by which a step may end beyond what friction can do
SLIPPED = 0.03  # and tolerances of a typical rate that it may miss by then
HELD = 1e-6  # share of µ g: a component that accelerates less is held


@kernel
def first_accelerations(model: Model, state: State, work: Work, out: Array) -> bool:
    """As `accelerations` at the state itself, and decide which resting components are held.

    Marks them in ``state.stuck`` and leaves only their rows for the stages to come.
    """
    lo, n = state.counter[LO], model.n
    rows = work.row_count[1]
    count = rows
    if model.frictional:
        articulated.place(lo, model.bodies, state.q, work.pose)
        articulated.centre_velocities(lo, model.bodies, work.pose, state.v, work.vx, work.vy)
        for i in range(lo, n):
            state.stuck[i] = 0
            if law.speed(model, work, state.v, i) <= law.AT_REST:
                work.row_id[count, 0] = i
                count += 3
    work.row_count[2] = count
    solved = accelerations(model, state, state.q, state.v, work, out)
    if count == rows:
        return solved
    if not (solved and within_grip(model, work)):
        for r in range(count):
            for k in range(lo, n + 2):
                out[k] -= work.response[r, k] * work.multiplier[r]
        solved = solve_with_friction(rows, count, work, model.grip)
        apply_multipliers(lo, count, work, out)
    keep = rows
    for r in range(rows, count, 3):
        i = work.row_id[r, 0]
        if acceleration_left(count, work, r) < HELD * model.grip[i] / model.bodies.mass[i]:
            state.stuck[i] = 1
            work.row_id[keep, 0] = i
            keep += 3
    work.row_count[2] = keep
    return solved


@inlined
def acceleration_left(count: int, work: Work, r: int) -> float:
    """Return the acceleration that the multipliers leave in rows r to r + 2 [m/s²]."""
    total = 0.0
    for k in range(3):
        w = work.bias[r + k]
        for c in range(count):
            w += work.delassus[r + k, c] * work.multiplier[c]
        total += w * w
    return math.sqrt(total)


@kernel
def within_grip(model: Model, work: Work) -> bool:
    """Whether friction can supply all the forces that would hold the candidates."""
    lam = work.multiplier
    for r in range(work.row_count[1], work.row_count[2], 3):
        size = math.sqrt(lam[r] ** 2 + lam[r + 1] ** 2 + lam[r + 2] ** 2)
        if size > model.grip[work.row_id[r, 0]]:
            return False
    return True


@kernel
def torn_loose(lo: int, model: Model, work: Work, h: float) -> bool:
    """Whether friction can no longer do, at the end of a step ``h``, what the step asked of it.

    The multipliers that hold rigidly joined components are many: those of the step may ask too
    much of one, where others would do. So accelerations are compared. What hardly moves within the
    step may be let go after it.
    """
    rows, count = work.row_count[1], work.row_count[2]
    if count == rows or within_grip(model, work):
        return False
    change, bodies = work.stage_v, model.bodies
    for k in range(model.n + 2):
        change[k] = 0.0
    apply_multipliers(lo, count, work, change)
    solve_with_friction(rows, count, work, model.grip)
    for k in range(model.n + 2):
        change[k] = -change[k]
    apply_multipliers(lo, count, work, change)
    articulated.centre_velocities(lo, bodies, work.pose, change, work.fx, work.fy)
    missed = SLIPPED * model.tolerance * model.rate_scale * model.side / h
    for i in range(lo, model.n):
        size = math.sqrt(work.fx[i] ** 2 + work.fy[i] ** 2 + (model.arm * change[i]) ** 2)
        most = model.grip[i] / bodies.mass[i]
        if size > max(HELD * most, min(SLACK * most, missed)):
            return True
    return False
