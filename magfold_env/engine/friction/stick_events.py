"""Components that friction stops: those that all but rest are put to rest, others watched."""

import math

from magfold_env.engine import entries as at
from magfold_env.engine.chain import articulated
from magfold_env.engine.chain.feed import place_all
from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.contact.complementarity import solve_passive
from magfold_env.engine.contact.constraints import prepare
from magfold_env.engine.elementary import square
from magfold_env.engine.friction import law
from magfold_env.engine.friction.sticking import first_accelerations
from magfold_env.engine.state import Array, Model, State, Work, copy
from magfold_env.engine.stepping.dynamics import apply_multipliers, fill_friction, rate_of

# Shares of tolerance times side that a component may still slide by: to be put to rest, and to
# have its stopping watched; and to turn back from rest.
STOPPED = 0.01
TURNING = 1e-4
CREEPING = 1e-3  # and to creep, if it accelerates by no more than some µ g
GENTLE = 3.0
BRAKING = 25.0
GOES_ON, RESTS, TURNS, STOPS = range(4)  # what becomes of a component
DRAGGED = 30.0  # times the energy of what is put to rest, that it may take
UNMET = 1e-6  # [rad/s], a hundredth of it in m/s: rates that should be zero and are not


@kernel
def stop_slow(model: Model, state: State, work: Work, out: Array) -> bool:
    """Stop the components that friction is about to stop.

    A component that slows down and would slide on by less than a hundredth of the tolerance is
    put to rest, and stays if friction can hold it. Those that it cannot hold go on, unless they
    hardly move any more and turn back: that they may do from rest. ``out`` holds the accelerations
    of the state, before and after; returned is whether they were found anew. Steps must not jump
    over the moment when a component stops: ``state.clock[BRAKE]`` bounds the next one.
    """
    lo, rows = state.counter[at.LO], work.rows.counts[at.CONTACTS]
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
        work.rows.counts[at.ALL_ROWS] = rows
        if not some_move(lo, model, work):
            first_accelerations(model, state, work, out)
    state.clock[at.BRAKE] = first_stop(lo, model, work)
    return anew


@kernel
def find_braking(lo: int, model: Model, state: State, work: Work, acceleration: Array) -> None:
    """Find what becomes of the components, and when each would stop [s]."""
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
    """Time until the first component that goes on may stop [s]."""
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
    """Let those go on that friction does not hold, but for those that turn back; whether any.

    A component turns back if from rest it accelerates against its velocity before, which is in
    ``work.friction.before``.
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
    """Whether a component hardly moves, and what drives it is of the order of its friction.

    Its friction turns with its velocity within far less than a step, which steps that do not
    solve for friction cannot follow. Needs the centres' velocities in ``work``.
    """
    found, centres, loads = False, work.centres, work.loads
    for i in range(state.counter[at.LO], model.n):
        slide = law.slide_of(model, work, state.v, i)
        if state.stuck[i] == 1 or not slide < CREEPING * model.tolerance * model.side:
            continue
        if not found:
            find_motion(state.counter[at.LO], model, state, work, acceleration)
            found = True
        ax, ay = loads.fx[i] + centres.ax[i], loads.fy[i] + centres.ay[i]
        spin = model.arm * acceleration[i]
        drive = math.sqrt(ax * ax + ay * ay + spin * spin)
        if drive * model.bodies.mass[i] < GENTLE * model.grip[i]:
            return True
    return False


@kernel
def put_to_rest(model: Model, state: State, work: Work, rows: int) -> bool:
    """Stop all components that are marked to be; whether that can be.

    The velocity becomes the nearest one, in the metric of the mass matrix, at which they rest and
    all that touches stays in touch.
    """
    lo = state.counter[at.LO]
    count = rows
    for i in range(lo, model.n):
        if work.friction.motion[i] != GOES_ON:
            work.rows.id[count, 0] = i
            count += 3
    work.rows.counts[at.ALL_ROWS] = count
    prepare(lo, model, state.v, work)
    fill_friction(lo, model, work)
    for r in range(count):
        work.rows.bias[r] = rate_of(lo, work, r, state.v)
        work.rows.passive[r] = 1
    solve_passive(count, work, work.rows.multiplier)
    if drags_along(lo, model, state, work, count):
        return False
    apply_multipliers(lo, count, work, state.v)
    for r in range(count):
        # A chain held both in the tube and by the floor may leave no such velocity.
        is_stop = r < work.rows.counts[at.JOINT_STOPS]
        if abs(rate_of(lo, work, r, state.v)) > UNMET * (1.0 if is_stop else 0.01):
            return False
    for i in range(lo, model.n):
        if work.friction.motion[i] != GOES_ON:
            state.v[i] = 0.0
    return True


@inlined
def drags_along(lo: int, model: Model, state: State, work: Work, count: int) -> bool:
    """Whether the multipliers stop far more than those that are to be put to rest.

    Where links are all but stretched, holding an end that hardly moves stops all that do.
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
    """Velocities and accelerations of the centres, the latter in two parts: ``fx`` and ``ax``."""
    place_all(lo, model, state.q, work.pose)
    articulated.centre_motion(lo, model.bodies, work.pose, state.v, work.centres)
    articulated.centre_velocities(
        lo, model.bodies, work.pose, acceleration, work.loads.fx, work.loads.fy
    )


@inlined
def half_rate(model: Model, work: Work, v: Array, acceleration: Array, i: int) -> float:
    """Half the rate of change of component i's squared speed [m²/s³], see `stop_slow`."""
    return (
        work.centres.vx[i] * (work.loads.fx[i] + work.centres.ax[i])
        + work.centres.vy[i] * (work.loads.fy[i] + work.centres.ay[i])
        + model.arm * model.arm * v[i] * acceleration[i]
    )
