"""How components stop, stick to the floor and tear loose, and when a chain is at rest."""

import math

from magfold_env.engine import indices as ix
from magfold_env.engine.chain import articulated
from magfold_env.engine.chain.tube import is_free, place_all
from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.contact.ahead import may_meet_solid
from magfold_env.engine.contact.complementarity import solve_passive
from magfold_env.engine.contact.constraints import first_joint, prepare
from magfold_env.engine.elementary import square
from magfold_env.engine.friction import law
from magfold_env.engine.friction.solver import solve_with_friction
from magfold_env.engine.state import Array, Model, State, Work, copy
from magfold_env.engine.stepping.dynamics import (
    accelerations,
    apply_multipliers,
    rate_of,
)

SLACK = 0.01  # share of µ g by which a step's end may exceed the possible friction
SLIPPED = 0.03  # permitted error of velocity at that end, in tolerances of a typical rate
ROUNDING = 1e-9  # of accelerations, as a share of typical ones
STILL = 1e-6  # share of µ g: a component that accelerates less sticks
# Remaining slides, in tolerances times side, below which a component is put to rest (STOPPED), may
# turn back from rest (TURNING), creeps (CREEPING), or has its stop watched (BRAKING).
STOPPED = 0.01
TURNING = 1e-4
CREEPING = 1e-3  # if it also accelerates by less than GENTLE µ g
GENTLE = 3.0
BRAKING = 25.0
GOES_ON, RESTS, TURNS, STOPS = range(4)  # a component's next motion
DRAGGED = 30.0  # limit on the energy taken, over that of the components put to rest
UNMET = 1e-6  # [rad/s], a hundredth of it in m/s: larger remaining rates are failures


@kernel
def first_accelerations(model: Model, state: State, work: Work, out: Array) -> bool:
    """Find the accelerations of the state, and decide which resting components stick.

    Marks them in ``state.stuck`` and leaves only their rows for the coming stages.
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
    """Whether friction can supply all the forces that hold the components assumed to stick."""
    lam = work.rows.multiplier
    for r in range(work.rows.counts[ix.CONTACTS], work.rows.counts[ix.ALL_ROWS], 3):
        if law.size_of(lam, r) > model.friction_limit[work.rows.id[r, 0]]:
            return False
    return True


@kernel
def torn_loose(lo: int, model: Model, work: Work, h: float) -> bool:
    """Whether, at the end of a step ``h``, friction can no longer supply what the step assumed.

    The multipliers that hold rigidly joined components are not unique: those of the step may exceed
    one component's limit where other ones would not. Accelerations are therefore compared. A
    component that would hardly move within the step may be released after it.
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
    """Whether no component will move again (relative to the base, while the tube feeds).

    Either friction holds every component, or no joint turns or will turn. Joints will not turn if
    stops press harder than friction could overcome, or if rates and accelerations are far below the
    tolerance and the base does not move freely. In an external field, or if the chain may still
    meet a solid, the whole chain must be at rest.
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
    # Without friction and gravity, a pinned chain turns about its pin as a free one does in space.
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
        # In a field, or if it may meet a solid, a chain that moves as one body may bend again.
        # Motion of less than a tolerance per second does not count, because a chain that lies on a
        # solid without friction drifts along it.
        turning, speeding_up = whole_motion(model, state.v), whole_motion(model, acceleration)
        if turning > (slow if model.field.present else model.tolerance) or speeding_up > least:
            return False
    if not free:
        # Contacts with the walls end as the base moves.
        stays = lo == 0 or state.counter[ix.PARKED] == 1
        return stays or work.rows.counts[ix.CONTACTS] == work.rows.counts[ix.JOINT_STOPS]
    if not model.frictional:
        return True
    return stops_press(lo, model, state, work)


@inlined
def whole_motion(model: Model, v: Array) -> float:
    """Return the largest entry of ``v`` for the first component and the base, lengths in sides."""
    n, side = model.n, model.side
    return max(abs(v[0]), abs(v[n]) / side, abs(v[n + 1]) / side)


@kernel
def relative_motion(
    lo: int, n: int, spins: bool, v: Array, a: Array, slow: float
) -> tuple[float, float]:
    """Return the largest rate [rad/s] and angular acceleration [rad/s²] of a joint.

    The first component's heading counts as a joint too, unless it ``spins`` freely. The search ends
    at the first joint that is faster than ``slow`` [rad/s].
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
    """Whether all joints are at stops that press harder than friction could overcome.

    A chain that slides as one rigid body then remains one.
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


@kernel
def stop_slow(model: Model, state: State, work: Work, out: Array) -> bool:
    """Stop the components that friction is about to stop.

    A component that slows down and would slide by less than a hundredth of the tolerance is put to
    rest, and stays if friction can hold it. Other components continue, unless they hardly move and
    turn back, which they may do from rest. ``out`` holds the state's accelerations, and the
    function returns whether it recomputed them. Because a step must not jump over the moment when a
    component stops, ``state.clock[BRAKE]`` bounds the next step.
    """
    lo, rows = state.counter[ix.N_HELD], work.rows.counts[ix.CONTACTS]
    find_motion(lo, model, state, work, out)
    find_braking(lo, model, state, work, out)
    copy(state.v, work.friction.before, 0)
    anew = False
    while some_move(lo, model, work):
        anew = True
        if put_to_rest(model, state, work, rows):
            first_accelerations(model, state, work, out)
            dropped = drop_loose(lo, model, state, work, out)
            articulated.centre_velocities(
                lo, model.bodies, work.pose, state.v, work.centres.vx, work.centres.vy
            )
            if not dropped:
                break
        else:
            for i in range(lo, model.n):
                work.friction.motion[i] = GOES_ON
        copy(work.friction.before, state.v, 0)
        work.rows.counts[ix.ALL_ROWS] = rows
        if not some_move(lo, model, work):
            first_accelerations(model, state, work, out)
    state.clock[ix.BRAKE] = first_stop(lo, model, work)
    return anew


@kernel
def find_braking(lo: int, model: Model, state: State, work: Work, acceleration: Array) -> None:
    """Decide how each component's motion continues, and find when it would stop [s]."""
    for i in range(lo, model.n):
        work.friction.motion[i] = GOES_ON
        work.friction.braking[i] = math.inf
        s = law.speed(model, work, state.v, i)
        slide = law.slide_of(model, work, state.v, i)
        if slide > BRAKING * model.tolerance * model.side:
            continue
        if s <= law.AT_REST:
            work.friction.motion[i] = RESTS
            continue
        slowing = half_rate(model, work, state.v, acceleration, i)
        if slowing < 0.0:
            work.friction.braking[i] = -0.9 * s * s / slowing
            if slide < TURNING * model.tolerance * model.side:
                work.friction.motion[i] = TURNS
            elif slide < STOPPED * model.tolerance * model.side:
                work.friction.motion[i] = STOPS


@inlined
def first_stop(lo: int, model: Model, work: Work) -> float:
    """Return the time until the first component that still moves may stop [s]."""
    soonest = math.inf
    for i in range(lo, model.n):
        if work.friction.motion[i] == GOES_ON:
            soonest = min(soonest, work.friction.braking[i])
    return soonest


@inlined
def some_move(lo: int, model: Model, work: Work) -> bool:
    """Whether any of the components to be put to rest still moves."""
    for i in range(lo, model.n):
        if work.friction.motion[i] == STOPS or work.friction.motion[i] == TURNS:
            return True
    return False


@kernel
def drop_loose(lo: int, model: Model, state: State, work: Work, acceleration: Array) -> bool:
    """Let components that friction does not hold continue, unless they turn back.

    A component turns back if it accelerates from rest against its previous velocity, which is in
    ``work.friction.before``. Returns whether any component continues.
    """
    bodies, pose = model.bodies, work.pose
    articulated.centre_velocities(
        lo, bodies, pose, work.friction.before, work.centres.vx, work.centres.vy
    )
    articulated.centre_velocities(lo, bodies, pose, acceleration, work.loads.fx, work.loads.fy)
    articulated.centripetal(lo, bodies, pose, state.v, work.centres.ax, work.centres.ay)
    dropped = False
    for i in range(lo, model.n):
        if (
            state.stuck[i] == 1
            or work.friction.motion[i] == GOES_ON
            or work.friction.motion[i] == RESTS
        ):
            continue
        if (
            work.friction.motion[i] == STOPS
            or half_rate(model, work, work.friction.before, acceleration, i) > 0.0
        ):
            work.friction.motion[i] = GOES_ON
            dropped = True
    return dropped


@kernel
def is_creeping(model: Model, state: State, work: Work, acceleration: Array) -> bool:
    """Whether a component hardly moves, and its driving force is comparable to its friction.

    The friction on such a component can reverse along with its velocity in much less than a step,
    so the step must solve for friction. The centres' velocities must be in ``work``.
    """
    found, centres, loads = False, work.centres, work.loads
    for i in range(state.counter[ix.N_HELD], model.n):
        slide = law.slide_of(model, work, state.v, i)
        if state.stuck[i] == 1 or not slide < CREEPING * model.tolerance * model.side:
            continue
        if not found:
            find_motion(state.counter[ix.N_HELD], model, state, work, acceleration)
            found = True
        ax, ay = loads.fx[i] + centres.ax[i], loads.fy[i] + centres.ay[i]
        spin = model.friction_radius * acceleration[i]
        drive = math.sqrt(ax * ax + ay * ay + spin * spin)
        if drive * model.bodies.mass[i] < GENTLE * model.friction_limit[i]:
            return True
    return False


@kernel
def put_to_rest(model: Model, state: State, work: Work, rows: int) -> bool:
    """Stop all marked components; return whether that is possible.

    The velocity becomes the nearest one, in the metric of the mass matrix, at which they rest and
    all contacts stay closed.
    """
    lo = state.counter[ix.N_HELD]
    count = rows
    for i in range(lo, model.n):
        if work.friction.motion[i] != GOES_ON:
            work.rows.id[count, 0] = i
            count += 3
    work.rows.counts[ix.ALL_ROWS] = count
    prepare(lo, model, state.v, work)
    for r in range(count):
        work.rows.bias[r] = rate_of(lo, work, r, state.v)
        work.rows.passive[r] = 1
    solve_passive(count, work, work.rows.multiplier)
    if drags_along(lo, model, state, work, count):
        return False
    apply_multipliers(lo, count, work, state.v)
    for r in range(count):
        # If both the tube and the floor hold a chain, there may be no such velocity.
        is_stop = r < work.rows.counts[ix.JOINT_STOPS]
        if abs(rate_of(lo, work, r, state.v)) > UNMET * (1.0 if is_stop else 0.01):
            return False
    for i in range(lo, model.n):
        if work.friction.motion[i] != GOES_ON:
            state.v[i] = 0.0
    return True


@inlined
def drags_along(lo: int, model: Model, state: State, work: Work, count: int) -> bool:
    """Whether the multipliers stop much more than the components to be put to rest.

    If links are nearly stretched, holding a slow end stops all moving components.
    """
    own, lost = 0.0, 0.0
    for i in range(lo, model.n):
        if work.friction.motion[i] != GOES_ON:
            own += model.bodies.mass[i] * square(law.speed(model, work, state.v, i))
    for r in range(count):
        for c in range(count):
            lost += work.rows.multiplier[r] * work.rows.delassus[r, c] * work.rows.multiplier[c]
    return lost > DRAGGED * own


@kernel
def find_motion(lo: int, model: Model, state: State, work: Work, acceleration: Array) -> None:
    """Compute the centres' velocities, and accelerations as ``loads.fx`` plus ``centres.ax``."""
    place_all(lo, model, state.q, work.pose)
    articulated.centre_motion(lo, model.bodies, work.pose, state.v, work.centres)
    articulated.centre_velocities(
        lo, model.bodies, work.pose, acceleration, work.loads.fx, work.loads.fy
    )


@inlined
def half_rate(model: Model, work: Work, v: Array, acceleration: Array, i: int) -> float:
    """Return half the rate of change of component i's squared speed [m²/s³]; see `stop_slow`."""
    return (
        work.centres.vx[i] * (work.loads.fx[i] + work.centres.ax[i])
        + work.centres.vy[i] * (work.loads.fy[i] + work.centres.ay[i])
        + model.friction_radius * model.friction_radius * v[i] * acceleration[i]
    )
