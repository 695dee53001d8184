"""Coming to rest: components that friction stops, and chains that need no more integration."""

from __future__ import annotations

import math

from magfold_env.engine import chain, friction
from magfold_env.engine.arrays import copy
from magfold_env.engine.complementarity import solve_equalities
from magfold_env.engine.constraints import first_joint, prepare
from magfold_env.engine.dynamics import apply_multipliers, first_accelerations, rate_of, respond
from magfold_env.engine.feed import is_free, place_all
from magfold_env.engine.jit import inlined, kernel
from magfold_env.engine.state import BRAKE, LO, Array, Model, State, Work

# Shares of tolerance times side that a component may still slide by: to be put to rest, and to
# have its stopping watched; and to turn back from rest.
STOPPED = 0.01
TURNING = 1e-4
CREEPING = 1e-3  # and to creep, if it accelerates by no more than some µ g
GENTLE = 3.0
BRAKING = 25.0
ROUNDING = 1e-9  # of accelerations, as a share of typical ones
GOES_ON, RESTS, TURNS, STOPS = range(4)  # what becomes of a component
UNMET = 1e-6  # [rad/s], a hundredth of it in m/s: rates that should be zero and are not


@kernel
def stop_slow(model: Model, state: State, work: Work, out: Array) -> None:
    """Stop the components that friction is about to stop.

    A component that slows down and would slide on by less than a hundredth of the tolerance is
    put to rest, and stays if friction can hold it. Those that it cannot hold go on, unless they
    hardly move any more and turn back: that they may do from rest. ``out`` holds the accelerations
    of the state, before and after. Steps must not jump over the moment when a component stops:
    ``state.clock[BRAKE]`` bounds the next one.
    """
    lo, rows = state.counter[LO], work.row_count[1]
    find_motion(lo, model, state, work, out)
    find_braking(lo, model, state, work, out)
    copy(state.v, work.stage_v, 0)
    state.clock[BRAKE] = first_stop(lo, model, work)
    while some_move(lo, model, work):
        if put_to_rest(model, state, work, rows):
            first_accelerations(model, state, work, out)
            dropped = drop_unheld(lo, model, state, work, out)
            chain.centre_velocities(lo, model.bodies, work.pose, state.v, work.vx, work.vy)
            if not dropped:
                state.clock[BRAKE] = first_stop(lo, model, work)
                return
        else:
            for i in range(lo, model.n):
                work.mark[i] = GOES_ON
        copy(work.stage_v, state.v, 0)
        work.row_count[2] = rows
        if not some_move(lo, model, work):
            state.clock[BRAKE] = first_stop(lo, model, work)
            first_accelerations(model, state, work, out)


@kernel
def find_braking(lo: int, model: Model, state: State, work: Work, acceleration: Array) -> None:
    """Sort the components into `work.mark`, and when each would stop into `work.braking` [s]."""
    for i in range(lo, model.n):
        work.mark[i] = GOES_ON
        work.braking[i] = math.inf
        s = friction.speed(model, work, state.v, i)
        slide = friction.slide_of(model, work, state.v, i)
        if slide > BRAKING * model.tolerance * model.side:
            continue
        if s <= friction.AT_REST:
            work.mark[i] = RESTS
            continue
        slowing = half_rate(model, work, state.v, acceleration, i)
        if slowing < 0.0:
            work.braking[i] = -0.9 * s * s / slowing
            if slide < TURNING * model.tolerance * model.side:
                work.mark[i] = TURNS
            elif slide < STOPPED * model.tolerance * model.side:
                work.mark[i] = STOPS


@inlined
def first_stop(lo: int, model: Model, work: Work) -> float:
    """Time until the first component that goes on may stop [s]."""
    soonest = math.inf
    for i in range(lo, model.n):
        if work.mark[i] == GOES_ON:
            soonest = min(soonest, work.braking[i])
    return soonest


@inlined
def some_move(lo: int, model: Model, work: Work) -> bool:
    """Whether any of the components to be put to rest still moves."""
    for i in range(lo, model.n):
        if work.mark[i] == STOPS or work.mark[i] == TURNS:
            return True
    return False


@kernel
def drop_unheld(lo: int, model: Model, state: State, work: Work, acceleration: Array) -> bool:
    """Let those go on that friction does not hold, but for those that turn back; whether any.

    A component turns back if from rest it accelerates against its velocity before, which is in
    ``work.stage_v``.
    """
    bodies, pose = model.bodies, work.pose
    chain.centre_velocities(lo, bodies, pose, work.stage_v, work.vx, work.vy)
    chain.centre_velocities(lo, bodies, pose, acceleration, work.fx, work.fy)
    chain.centripetal(lo, bodies, pose, state.v, work.ax, work.ay)
    dropped = False
    for i in range(lo, model.n):
        if state.stuck[i] == 1 or work.mark[i] == GOES_ON or work.mark[i] == RESTS:
            continue
        if work.mark[i] == STOPS or half_rate(model, work, work.stage_v, acceleration, i) > 0.0:
            work.mark[i] = GOES_ON
            dropped = True
    return dropped


@kernel
def creeps(model: Model, state: State, work: Work, acceleration: Array) -> bool:
    """Whether a component hardly moves, and what drives it is of the order of its friction.

    Its friction turns with its velocity within far less than a step, which steps that do not
    solve for friction cannot follow. Needs the centres' velocities in ``work``.
    """
    lo = state.counter[LO]
    if not any_creeper(lo, model, state, work):
        return False
    find_motion(lo, model, state, work, acceleration)
    for i in range(lo, model.n):
        if is_creeper(model, state, work, i):
            ax, ay = work.fx[i] + work.ax[i], work.fy[i] + work.ay[i]
            spin = model.arm * acceleration[i]
            drive = math.sqrt(ax * ax + ay * ay + spin * spin)
            if drive * model.bodies.mass[i] < GENTLE * model.grip[i]:
                return True
    return False


@inlined
def is_creeper(model: Model, state: State, work: Work, i: int) -> bool:
    """Whether component i is neither held nor faster than creeping."""
    if state.stuck[i] == 1:
        return False
    return friction.slide_of(model, work, state.v, i) < CREEPING * model.tolerance * model.side


@inlined
def any_creeper(lo: int, model: Model, state: State, work: Work) -> bool:
    """Whether there is any."""
    for i in range(lo, model.n):
        if is_creeper(model, state, work, i):
            return True
    return False


@kernel
def put_to_rest(model: Model, state: State, work: Work, rows: int) -> bool:
    """Stop all components that are marked to be; whether that can be.

    The velocity becomes the nearest one, in the metric of the mass matrix, at which they rest and
    all that touches stays in touch.
    """
    lo = state.counter[LO]
    count = rows
    for i in range(lo, model.n):
        if work.mark[i] != GOES_ON:
            work.row_id[count, 0] = i
            count += 3
    work.row_count[2] = count
    prepare(lo, model, state.v, work)
    for r in range(rows, count, 3):
        friction.friction_rows(lo, model, work.pose, work, r, work.row_id[r, 0])
    respond(lo, model, work, rows, count)
    for r in range(count):
        work.bias[r] = rate_of(lo, work, r, state.v)
        work.passive[r] = 1
    solve_equalities(count, work)
    apply_multipliers(lo, count, work, state.v)
    for r in range(count):
        # A chain held both in the tube and by the floor may leave no such velocity.
        if abs(rate_of(lo, work, r, state.v)) > UNMET * (1.0 if r < work.row_count[0] else 0.01):
            return False
    for i in range(lo, model.n):
        if work.mark[i] != GOES_ON:
            state.v[i] = 0.0
    return True


@kernel
def find_motion(lo: int, model: Model, state: State, work: Work, acceleration: Array) -> None:
    """Velocities and accelerations of the centres, the latter in two parts: ``fx`` and ``ax``."""
    place_all(lo, model, state.q, work.pose)
    chain.centre_velocities(lo, model.bodies, work.pose, state.v, work.vx, work.vy)
    chain.centripetal(lo, model.bodies, work.pose, state.v, work.ax, work.ay)
    chain.centre_velocities(lo, model.bodies, work.pose, acceleration, work.fx, work.fy)


@inlined
def half_rate(model: Model, work: Work, v: Array, acceleration: Array, i: int) -> float:
    """Half the rate of change of component i's squared speed [m²/s³], see `stop_slow`."""
    return (
        work.vx[i] * (work.fx[i] + work.ax[i])
        + work.vy[i] * (work.fy[i] + work.ay[i])
        + model.arm * model.arm * v[i] * acceleration[i]
    )


@kernel
def is_at_rest(model: Model, state: State, work: Work, acceleration: Array) -> bool:
    """Whether nothing will move again, relative to the base while the tube feeds.

    Either friction holds every component; or no joint turns and none will, because stops press
    with more than friction could lift, or because rates and accelerations are far below the
    tolerance and the base does not move by itself. In a field from outside the whole chain must
    be at rest.
    """
    lo, n = state.counter[LO], model.n
    free = is_free(lo, model)
    if model.frictional:
        held = True
        for i in range(lo, n):
            held = held and state.stuck[i] == 1
        if held:
            state.v[lo:] = 0.0
            return True
    # A pinned chain that nothing holds or pulls turns about its pin as a free one turns in space.
    spins = free or (model.pinned and not model.frictional and not pulled(model))
    spins = spins and (n > 1 or free) and not model.field.present
    slow = 1e-3 * model.tolerance
    turning, speeding_up = relative_motion(lo, n, spins, state.v, acceleration, slow)
    if free and model.field.present:
        # Where a field from outside acts, a chain that moves on as one body may bend again.
        for k in range(n, n + 2):
            turning = max(turning, abs(state.v[k]) / model.side)
            speeding_up = max(speeding_up, abs(acceleration[k]) / model.side)
    rounding = ROUNDING * model.rate_scale**2
    quiet = turning <= slow
    quiet = quiet and speeding_up <= max(0.1 * model.tolerance, rounding)
    if not quiet:
        return False
    if not free:
        # Contacts with the walls end as the base moves on.
        return lo == 0 or work.row_count[1] == work.row_count[0]
    if not model.frictional:
        return True
    return stops_press(lo, model, state, work)


@inlined
def pulled(model: Model) -> bool:
    """Whether gravity acts in the plane."""
    return model.gravity_x != 0.0 or model.gravity_y != 0.0


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
        grip += model.grip[i]
    lift = grip * model.bodies.length[0] * (model.n - lo)
    for k in range(first_joint(lo), model.n):
        if state.lock[k] == 0:
            return False
    for r in range(work.row_count[0]):
        if work.multiplier[r] < lift:
            return False
    return True
