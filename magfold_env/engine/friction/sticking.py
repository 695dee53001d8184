"""Which resting components stick to the floor, when they tear loose, and when a chain rests."""

import math

from magfold_env.engine import indices as ix
from magfold_env.engine.chain import articulated
from magfold_env.engine.chain.tube import is_free
from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.contact.ahead import may_meet_solid
from magfold_env.engine.contact.constraints import first_joint
from magfold_env.engine.elementary import square
from magfold_env.engine.friction import law
from magfold_env.engine.friction.solver import solve_with_friction
from magfold_env.engine.state import Array, Model, State, Work
from magfold_env.engine.stepping.dynamics import accelerations, apply_multipliers

SLACK = 0.01  # share of µ g by which a step may end beyond what friction can do
SLIPPED = 0.03  # and tolerances of a typical rate that it may miss by then
ROUNDING = 1e-9  # of accelerations, as a share of typical ones
STILL = 1e-6  # share of µ g: a component that accelerates less sticks


@kernel
def first_accelerations(model: Model, state: State, work: Work, out: Array) -> bool:
    """As `accelerations` at the state itself, and decide which resting components stick.

    Marks them in ``state.stuck`` and leaves only their rows for the stages to come.
    """
    lo, n = state.counter[ix.N_HELD], model.n
    rows = work.rows.counts[ix.CONTACTS]
    count = rows
    if model.frictional:
        law.find_velocities(lo, model, state, work)
        for i in range(lo, n):
            state.stuck[i] = 0
            if law.speed(model, work, state.v, i) <= law.AT_REST:
                work.rows.id[count, 0] = i
                count += 3
    work.rows.counts[ix.ALL_ROWS] = count
    solved = accelerations(model, state, state.q, state.v, work, out)
    if count == rows:
        return solved
    if not (solved and within_grip(model, work)):
        for r in range(count):
            for k in range(lo, n + 2):
                out[k] -= work.rows.response[r, k] * work.rows.multiplier[r]
        solved = solve_with_friction(rows, count, work, model.friction_limit)
        apply_multipliers(lo, count, work, out)
    keep = rows
    for r in range(rows, count, 3):
        i = work.rows.id[r, 0]
        if (
            acceleration_left(count, work, r)
            < STILL * model.friction_limit[i] / model.bodies.mass[i]
        ):
            state.stuck[i] = 1
            work.rows.id[keep, 0] = i
            keep += 3
    work.rows.counts[ix.ALL_ROWS] = keep
    return solved


@inlined
def acceleration_left(count: int, work: Work, r: int) -> float:
    """Return the acceleration that the multipliers leave in rows r to r + 2 [m/s²]."""
    total = 0.0
    for k in range(3):
        w = work.rows.bias[r + k]
        for c in range(count):
            w += work.rows.delassus[r + k, c] * work.rows.multiplier[c]
        total += w * w
    return math.sqrt(total)


@kernel
def within_grip(model: Model, work: Work) -> bool:
    """Whether friction can supply all the forces that would hold the candidates."""
    lam = work.rows.multiplier
    for r in range(work.rows.counts[ix.CONTACTS], work.rows.counts[ix.ALL_ROWS], 3):
        if law.size_of(lam, r) > model.friction_limit[work.rows.id[r, 0]]:
            return False
    return True


@kernel
def torn_loose(lo: int, model: Model, work: Work, h: float) -> bool:
    """Whether friction can no longer do, at the end of a step ``h``, what the step asked of it.

    The multipliers that hold rigidly joined components are many: those of the step may ask too
    much of one, where others would do. So accelerations are compared. What hardly moves within the
    step may be let go after it.
    """
    rows, count = work.rows.counts[ix.CONTACTS], work.rows.counts[ix.ALL_ROWS]
    if count == rows or within_grip(model, work):
        return False
    change, bodies = work.friction.change, model.bodies
    for k in range(model.n + 2):
        change[k] = 0.0
    apply_multipliers(lo, count, work, change)
    solve_with_friction(rows, count, work, model.friction_limit)
    for k in range(model.n + 2):
        change[k] = -change[k]
    apply_multipliers(lo, count, work, change)
    articulated.centre_velocities(lo, bodies, work.pose, change, work.loads.fx, work.loads.fy)
    missed = SLIPPED * model.tolerance * model.typical_rate * model.side / h
    for i in range(lo, model.n):
        size = math.sqrt(
            square(work.loads.fx[i])
            + square(work.loads.fy[i])
            + square(model.friction_radius * change[i])
        )
        most = model.friction_limit[i] / bodies.mass[i]
        if size > max(STILL * most, min(SLACK * most, missed)):
            return True
    return False


@kernel
def is_at_rest(model: Model, state: State, work: Work, acceleration: Array) -> bool:
    """Whether nothing will move again, relative to the base while the tube feeds.

    Either friction holds every component; or no joint turns and none will, because stops press
    with more than friction could lift, or because rates and accelerations are far below the
    tolerance and the base does not move by itself. In a field from outside, or where a solid may
    still be met, the whole chain must be at rest.
    """
    lo, n = state.counter[ix.N_HELD], model.n
    free = is_free(lo, model)
    if model.frictional:
        sticks = True
        for i in range(lo, n):
            sticks = sticks and state.stuck[i] == 1
        if sticks:
            state.v[lo:] = 0.0
            return True
    # A pinned chain that nothing holds or pulls turns about its pin as a free one turns in space.
    pulled = model.gravity_x != 0.0 or model.gravity_y != 0.0
    spins = free or (model.pinned and not model.frictional and not pulled)
    spins = spins and (n > 1 or free)
    slow = 1e-3 * model.tolerance
    turning, speeding_up = relative_motion(lo, n, spins, state.v, acceleration, slow)
    rounding = ROUNDING * square(model.typical_rate)
    least = max(0.1 * model.tolerance, rounding)
    if turning > slow or speeding_up > least:
        return False
    if spins and (model.field.present or may_meet_solid(model, state, work)):
        # Where a field acts, or a solid may be met, a chain that moves on as one body may bend
        # again. That of the whole chain which takes a second for a tolerance does not count, for
        # what lies on a solid without friction drifts along it.
        turning, speeding_up = whole_motion(model, state.v), whole_motion(model, acceleration)
        if turning > (slow if model.field.present else model.tolerance) or speeding_up > least:
            return False
    if not free:
        # Contacts with the walls end as the base moves on.
        stays = lo == 0 or state.counter[ix.PARKED] == 1
        return stays or work.rows.counts[ix.CONTACTS] == work.rows.counts[ix.JOINT_STOPS]
    if not model.frictional:
        return True
    return stops_press(lo, model, state, work)


@inlined
def whole_motion(model: Model, v: Array) -> float:
    """Largest rate or acceleration of the first component and of the base, in sides."""
    n, side = model.n, model.side
    return max(abs(v[0]), abs(v[n]) / side, abs(v[n + 1]) / side)


@kernel
def relative_motion(
    lo: int, n: int, spins: bool, v: Array, a: Array, slow: float
) -> tuple[float, float]:
    """Largest relative rate [rad/s] and relative angular acceleration [rad/s²] of a joint.

    The first component counts as a joint too unless it ``spins`` freely. No more joints are looked
    at once one is not ``slow`` [rad/s].
    """
    rate, acceleration = 0.0, 0.0
    for k in range(lo, n):
        if k > lo:
            rate = max(rate, abs(v[k] - v[k - 1]))
            acceleration = max(acceleration, abs(a[k] - a[k - 1]))
        elif not spins:
            rate = abs(v[k])
            acceleration = abs(a[k])
        if rate > slow:
            break
    return rate, acceleration


@kernel
def stops_press(lo: int, model: Model, state: State, work: Work) -> bool:
    """Whether all joints are at stops that press harder than friction on the floor could lift.

    What slides on as one rigid body then stays one.
    """
    grip = 0.0
    for i in range(lo, model.n):
        grip += model.friction_limit[i]
    lift = grip * model.bodies.length[0] * (model.n - lo)
    for k in range(first_joint(lo), model.n):
        if state.lock[k] == 0:
            return False
    for r in range(work.rows.counts[ix.JOINT_STOPS]):
        if work.rows.multiplier[r] < lift:
            return False
    return True
