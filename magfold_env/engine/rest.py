"""Coming to rest: components that friction stops, and chains that need no more integration."""

from __future__ import annotations

import math

from magfold_env.engine import chain, friction
from magfold_env.engine.arrays import copy
from magfold_env.engine.complementarity import solve_nonnegative
from magfold_env.engine.constraints import first_joint, prepare
from magfold_env.engine.dynamics import apply_multipliers, first_accelerations, rate_of, respond
from magfold_env.engine.feed import is_free, place_all
from magfold_env.engine.jit import inlined, kernel, merged
from magfold_env.engine.state import BRAKE, LO, Array, Model, State, Work

# Shares of tolerance times side that a component may still slide by: to be put to rest, and to
# have its stopping watched; and to turn back from rest.
STOPPED = 0.01
TURNING = 1e-4
BRAKING = 25.0
ROUNDING = 1e-9  # of accelerations, as a share of typical ones


@kernel
def stop_slow(model: Model, state: State, work: Work, out: Array) -> bool:
    """Stop the components that friction is about to stop; returns whether any was.

    A component that slows down and would slide on by less than a hundredth of the tolerance is
    put to rest, by the impulse nearest in the metric of the mass matrix, and stays if friction
    can hold it. If not it turns back, and does so from rest if it hardly moved any more.
    ``out`` holds the accelerations of the state, before and after. Steps must not jump over the
    moment when a component stops: ``state.clock[BRAKE]`` bounds the next one.
    """
    lo, n = state.counter[LO], model.n
    candidates = 0
    find_motion(lo, model, state, work, out)
    rows = work.row_count[1]
    count = rows
    brake, brake_tried = math.inf, math.inf
    longest = 0.0
    for i in range(lo, n):
        s = friction.speed(model, work, state.v, i)
        slide = s * s * model.bodies.mass[i] / (2.0 * max(model.grip[i], 1e-300))
        if slide > BRAKING * model.tolerance * model.side:
            continue
        slowing = half_rate(model, state, work, out, i)
        moves = s > friction.AT_REST
        tried = slide < STOPPED * model.tolerance * model.side and (slowing < 0.0 or not moves)
        if moves and slowing < 0.0:
            time = -0.9 * s * s / slowing
            brake_tried = min(brake_tried, time)
            brake = brake if tried else min(brake, time)
        if tried:
            work.row_id[count, 0] = i
            count += 3
            candidates += int(moves)
            longest = max(longest, slide)
    state.clock[BRAKE] = brake
    if candidates == 0:
        return False
    copy(state.v, work.stage_v, 0)
    work.mark[:] = 0
    work.row_count[2] = count
    prepare(lo, model, state.v, work)
    for r in range(rows, count, 3):
        friction.friction_rows(lo, model, work.pose, work, r, work.row_id[r, 0])
    respond(lo, model, work, rows, count)
    for r in range(count):
        work.bias[r] = rate_of(lo, work, r, state.v)
        work.equality[r] = 1 if r >= rows else 0
        work.passive[r] = 1
        if r >= rows:
            work.mark[work.row_id[r, 0]] = 1
    solve_nonnegative(count, work)
    apply_multipliers(lo, count, work, state.v)
    for i in range(lo, n):
        if work.mark[i] == 1:
            state.v[i] = 0.0
    first_accelerations(model, state, work, out)
    held = True
    for i in range(lo, n):
        held = held and (work.mark[i] == 0 or state.stuck[i] == 1)
    if held or longest < TURNING * model.tolerance * model.side:
        return True
    state.clock[BRAKE] = brake_tried
    copy(work.stage_v, state.v, 0)
    first_accelerations(model, state, work, out)
    return False


@merged
def find_motion(lo: int, model: Model, state: State, work: Work, acceleration: Array) -> None:
    """Velocities and accelerations of the centres, the latter in two parts: ``fx`` and ``ax``."""
    place_all(lo, model, state.q, work.pose)
    chain.centre_velocities(lo, model.bodies, work.pose, state.v, work.vx, work.vy)
    chain.centripetal(lo, model.bodies, work.pose, state.v, work.ax, work.ay)
    chain.centre_velocities(lo, model.bodies, work.pose, acceleration, work.fx, work.fy)


@inlined
def half_rate(model: Model, state: State, work: Work, acceleration: Array, i: int) -> float:
    """Half the rate of change of component i's squared speed [m²/s³], see `stop_slow`."""
    return (
        work.vx[i] * (work.fx[i] + work.ax[i])
        + work.vy[i] * (work.fy[i] + work.ay[i])
        + model.arm * model.arm * state.v[i] * acceleration[i]
    )


@kernel
def is_at_rest(model: Model, state: State, work: Work, acceleration: Array) -> bool:
    """Whether nothing will move again, relative to the base while the tube feeds.

    Either friction holds every component; or no joint turns and none will, because stops press
    with more than friction could lift, or because rates and accelerations are far below the
    tolerance and the base does not move by itself.
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
    spins = spins and (n > 1 or free)
    turning, speeding_up = relative_motion(lo, n, spins, state.v, acceleration)
    rounding = ROUNDING * model.rate_scale**2
    quiet = turning <= 1e-3 * model.tolerance
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


@merged
def relative_motion(lo: int, n: int, spins: bool, v: Array, a: Array) -> tuple[float, float]:
    """Largest relative rate [rad/s] and relative angular acceleration [rad/s²] of a joint.

    The first component counts as a joint too unless it ``spins`` freely.
    """
    rate, acceleration = 0.0, 0.0
    for k in range(lo, n):
        if k > lo:
            rate = max(rate, abs(v[k] - v[k - 1]))
            acceleration = max(acceleration, abs(a[k] - a[k - 1]))
        elif not spins:
            rate = abs(v[k])
            acceleration = abs(a[k])
    return rate, acceleration


@merged
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
