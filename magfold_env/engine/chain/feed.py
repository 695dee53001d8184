"""The feed: the drive, a pusher that moves the base, and events at certain base positions.

A held component is released when its inner hinge passes the mouth on the way out. A feed that
reverses draws free components in. A component that lies straight enough is held again when its
inner hinge is a whole number of diagonals inside; others stay free, between the walls. Once all
components are out, the feed cannot draw them in.

The drive keeps the requested speed if its force suffices. Otherwise it slips: it exerts its
greatest force, and all forces together determine the base's motion.
"""

import math

from magfold_env.engine import indices as ix
from magfold_env.engine.chain import articulated, ledger
from magfold_env.engine.chain.momentum import kinetic, momentum_along, spread
from magfold_env.engine.chain.tube import advance, charged, is_partly_out, place_all, whole_mass
from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.elementary import sincos, time_across
from magfold_env.engine.magnets.chain import potential_energy
from magfold_env.engine.state import Array, Model, State, Work

STRAIGHT = 0.2  # [rad] largest heading at which a component may be held again
NOWHERE = 1e-9  # [sides] a feed that has moved no farther is at its start
ASKED_WITHIN = 1e-9  # [m/s], and share of a speed: smaller differences do not count
STALLED = 2  # the drive slips, and the pusher's stop holds the base in place
BORNE_WITHIN = 1e-6  # relative margin below the force limit at which a drive leaves the stop
MARK_WITHIN = 1e-10  # [m]
SOONEST = 1e-8  # [s] a slipping drive is not checked again sooner


@kernel
def begin(model: Model, state: State, work: Work) -> None:
    """Apply the requested speed to the drive, and set the base's next mark (see `aim`)."""
    n, lo = model.n, state.counter[ix.N_HELD]
    speed = float(state.speed[lo - 1])
    stopped = speed <= 0.0 and is_at_stop(model, state)
    if stopped:
        speed = 0.0  # the stop cannot move
    if stopped or lo == n:
        state.counter[ix.SLIPPING] = 0
    state.feed[ix.ASKED] = speed
    jump = speed - state.v[n]
    if state.counter[ix.SLIPPING] == 0 and is_too_much(model, state, whole_mass(model) * jump):
        state.counter[ix.SLIPPING] = 1
        state.feed[ix.SINCE] = state.clock[ix.TIME]
    if slips(state) and jump != 0.0:
        state.counter[ix.SLIPPING] = 1 if jump > 0.0 else -1
    # Values from the end of the last step may no longer hold.
    state.counter[ix.FRESH] = 1
    carry(model, state, work)
    if state.counter[ix.SLIPPING] == 0:
        change_speed(model, state, work, speed)
    if state.clock[ix.TIME] == 0.0:
        # A run begins with the chain at the feed's speed, so this impulse does not count.
        state.account[ix.BEFORE] = state.account[ix.IMPULSE]
    load(model, state, work)
    aim(model, state)
    state.clock[ix.MARK] = math.inf
    if state.counter[ix.SLIPPING] == 0 and speed != 0.0:
        time = (state.feed[ix.NEXT] - state.q[n]) / state.v[n]
        state.clock[ix.MARK] = state.clock[ix.TIME] + max(time, 0.0)
    state.counter[ix.FEEDING] = 1


@kernel
def inside_force(model: Model, state: State, work: Work, until: float) -> float:
    """Return the drive's mean force [N] until a time [s] on a chain that is inside the tube."""
    force = -whole_mass(model) * model.gravity_x
    x = state.q[model.n]
    way = state.v[model.n] * (until - state.clock[ix.TIME])
    if model.field.present and way != 0.0:
        before = potential_of(model, state, work)
        state.q[model.n] += way
        force += (potential_of(model, state, work) - before) / way
        state.q[model.n] = x
    return force if way != 0.0 else 0.0


@inlined
def is_too_much(model: Model, state: State, impulse: float) -> bool:
    """Whether an impulse [N·s] makes the drive slip; False while the whole chain is inside."""
    most = ledger.most_force(model, state) * ledger.MEAN_OVER
    return state.counter[ix.N_HELD] < model.n and abs(impulse) > most


@inlined
def drives(model: Model, state: State) -> bool:
    """Whether the drive or its stop sets the base's speed while the chain is partly outside."""
    return is_partly_out(model, state) and not slips(state)


@inlined
def slips(state: State) -> bool:
    """Whether the drive slips and the pusher's stop does not hold the base."""
    return abs(state.counter[ix.SLIPPING]) == 1


@inlined
def is_at_stop(model: Model, state: State) -> bool:
    """Whether the pusher is at its stop, beyond which it cannot be drawn back."""
    return advance(model, state) <= NOWHERE * model.side


@inlined
def borne(model: Model, state: State, force: float) -> float:
    """Return the drive's part [N] of a ``force`` on the base; the pusher's stop bears the rest."""
    most = ledger.most_force(model, state)
    helped = force > most and state.v[model.n] == 0.0 and is_at_stop(model, state)
    return most if helped else force


@inlined
def note_step(state: State, work: Work, impulse: float, way: float) -> None:
    """Record an impulse of the drive [N·s] over a displacement ``way`` of the base [m]."""
    state.account[ix.IMPULSE] += impulse
    if slips(state):
        state.account[ix.FED] += work.chain.base[ix.DRIVE] * way
    else:
        state.account[ix.FED] += impulse * state.v[state.v.size - 2]


@kernel
def carry(model: Model, state: State, work: Work) -> None:
    """Set a slipping drive's force and the mass that moves with the base; otherwise, clear both."""
    carried, force = 0.0, 0.0
    if slips(state):
        force = state.counter[ix.SLIPPING] * ledger.most_force(model, state)
        for i in range(state.counter[ix.N_HELD]):
            carried += model.bodies.mass[i]
    work.chain.base[ix.CARRIED] = carried
    work.chain.base[ix.DRIVE] = force


@kernel
def slip(model: Model, state: State, work: Work, force: float) -> None:
    """Make the drive slip; ``force`` has the sign of the force that would have kept its speed."""
    if state.counter[ix.SLIPPING] == 0:
        state.feed[ix.SINCE] = state.clock[ix.TIME]
    state.counter[ix.SLIPPING] = 1 if force > 0.0 else -1
    state.counter[ix.FEEDING] = 0
    state.counter[ix.FRESH] = 1
    carry(model, state, work)


@kernel
def needed_force(lo: int, model: Model, work: Work, acceleration: Array) -> float:
    """Return the force along the tube with which the drive keeps its speed [N].

    By Newton's law, it is the mass of the chain outside times its acceleration, less the other
    forces on it and on the components in the tube. ``work`` must hold smooth and contact forces.
    """
    n, rows = model.n, work.rows
    force = momentum_along(lo, model, work, acceleration)
    for r in range(rows.counts[ix.JOINT_STOPS], rows.counts[ix.SOLVED]):
        force -= rows.multiplier[r] * rows.jacobian[r, n]
    return force - work.chain.force[n] - work.chain.base[ix.PULL]


@kernel
def drives_on(model: Model, state: State, work: Work, acceleration: Array, anew: bool) -> bool:
    """Whether the drive stays in its state, slipping or not slipping; otherwise it must restart.

    ``anew`` means that the accelerations were recomputed and are not from the last step's end.
    """
    lo, n, slipping = state.counter[ix.N_HELD], model.n, state.counter[ix.SLIPPING]
    if state.counter[ix.FEEDING] == 0:
        return False
    if not slips(state):
        if anew:
            work.stages.drive[0] = needed_force(lo, model, work, acceleration)
        force = borne(model, state, float(work.stages.drive[0]))
        most = ledger.most_force(model, state)
        if abs(force) > most:
            slip(model, state, work, force)
            return False
        if slipping == STALLED and force < (1.0 - BORNE_WITHIN) * most:
            state.counter[ix.SLIPPING] = 1
            return False
        return True
    if is_at_mark(state):
        return False
    goes_in = state.v[n] < 0.0 or (state.v[n] == 0.0 and acceleration[n] < 0.0)
    if goes_in and is_at_stop(model, state):
        stop(model, state, work)
        return False
    behind = slipping * (state.feed[ix.ASKED] - state.v[n])
    caught_up = behind <= ASKED_WITHIN * (1.0 + abs(state.feed[ix.ASKED]))
    # A drive that has just begun to slip takes one step, regardless of rounding.
    began_before = state.clock[ix.TIME] > state.feed[ix.SINCE]
    if caught_up and began_before and slipping * acceleration[n] >= 0.0:
        state.counter[ix.SLIPPING] = 0
        return False
    # The base may reverse on its way to the mark.
    aim(model, state)
    return True


@kernel
def time_to_change(model: Model, state: State, acceleration: Array) -> float:
    """Return the time until a slipping drive reaches its next mark or the requested speed [s]."""
    v, a, soonest = state.v[model.n], acceleration[model.n], math.inf
    behind = state.feed[ix.ASKED] - v
    if behind * a > 0.0:
        soonest = behind / a
    gap = state.feed[ix.NEXT] - state.q[model.n]
    if math.isfinite(gap):
        sign = math.copysign(1.0, gap)
        soonest = min(soonest, time_across(abs(gap), sign * v, sign * a)[0])
    return max(soonest, SOONEST)


@inlined
def is_at_mark(state: State) -> bool:
    """Whether the base is at the next mark."""
    if not slips(state):
        return float(state.clock[ix.TIME]) >= float(state.clock[ix.MARK])
    way = float(state.feed[ix.WAY])
    gap = float(state.feed[ix.NEXT] - state.q[state.q.size - 2])
    return state.counter[ix.FEEDING] == 1 and way != 0.0 and way * gap <= MARK_WITHIN


@kernel
def aim(model: Model, state: State) -> None:
    """Set the base's next mark, which is the x [m] of the next event, and the direction to it.

    On the way out, the mark is where the outermost held component is released. On the way in, the
    marks are the positions a whole number of diagonals inside the mouth, where components may be
    held again, and the position at which the feed started. Magnets that act only outside are added
    and removed at whole diagonals, including the mouth itself.
    """
    i = state.counter[ix.N_HELD] - 1
    x, v, diagonal = float(state.q[model.n]), state.v[model.n], float(model.bodies.length[i])
    whole = 0
    if v > 0.0 and model.at_mouth and x < 0.0:
        while -(whole + 1) * diagonal > x:
            whole += 1
        mark = -whole * diagonal
    elif v > 0.0:
        mark = diagonal * sincos(float(state.q[i]))[1]
    else:
        if not model.at_mouth:
            whole = 1
        while -whole * diagonal >= x:
            whole += 1
        mark = max(-whole * diagonal, x - advance(model, state))
    state.feed[ix.NEXT] = mark
    state.feed[ix.WAY] = 0.0 if v == 0.0 else math.copysign(1.0, v)


@kernel
def pass_mark(model: Model, state: State, work: Work) -> None:
    """Handle the event at the mark that the base has reached."""
    n, mark = model.n, float(state.feed[ix.NEXT])
    inward = state.feed[ix.WAY] < 0.0
    if abs(state.q[n] - mark) <= MARK_WITHIN:
        state.q[n] = mark  # removes rounding; a slipping drive may be farther
    if not inward and mark > 0.0:
        release(model, state)
        if state.counter[ix.N_HELD] == 0:
            state.counter[ix.SLIPPING] = 0
            carry(model, state, work)
            ledger.close_millisecond(state, float(state.account[ix.IMPULSE]))
        return
    if inward and is_at_stop(model, state):
        stop(model, state, work)
    while inward and lies_in_tube(model, state):
        hold(model, state, work)


@kernel
def stop(model: Model, state: State, work: Work) -> None:
    """Let the pusher's stop halt the base's inward motion."""
    stalled = slips(state) and state.feed[ix.ASKED] > 0.0
    state.counter[ix.SLIPPING] = STALLED if stalled else 0
    change_speed(model, state, work, 0.0)


@inlined
def lies_in_tube(model: Model, state: State) -> bool:
    """Whether the innermost free component lies straight and deep enough to be held."""
    if not is_partly_out(model, state):
        return False
    i = state.counter[ix.N_HELD]
    deep = float(state.q[model.n]) <= -float(model.bodies.length[i])
    return deep and abs(float(state.q[i])) <= STRAIGHT


@kernel
def load(model: Model, state: State, work: Work) -> None:
    """Add magnets to components that are now outside, and remove those of components now inside.

    This applies only if magnets act only outside. A component counts as inside if its leading hinge
    would be inside if all components between it and the base lay in line.
    """
    if not model.at_mouth:
        return
    n, inner = model.n, state.counter[ix.N_HELD] - 1
    x, leaves = state.q[n], state.v[n] >= 0.0
    energy, changed = 0.0, False
    for i in range(n):
        mouth = (inner - i) * model.bodies.length[i]
        outside = i >= inner and (x > mouth or (x == mouth and leaves))
        if outside != charged(model, i):
            if not changed:
                energy = potential_of(model, state, work)
                changed = True
            for face in range(4):
                model.charge[i, face] = state.waiting[i, face] if outside else 0.0
    if changed:
        state.account[ix.LOADED] += potential_of(model, state, work) - energy


@kernel
def potential_of(model: Model, state: State, work: Work) -> float:
    """Return the energy whose gradient gives the magnets' forces [J]."""
    first = place_all(state.counter[ix.N_HELD], model, state.q, work.pose)
    return potential_energy(first, model, state.q, work)


@kernel
def release(model: Model, state: State) -> None:
    """Release the outermost held component; velocities do not jump.

    The base becomes that component's inner hinge, which is at the mouth or, if the drive slips,
    slightly beyond it.
    """
    move_base(model, state, state.counter[ix.N_HELD] - 1, -1.0)
    state.counter[ix.N_HELD] -= 1


@kernel
def hold(model: Model, state: State, work: Work) -> None:
    """Hold the innermost free component again at its current heading; this is an inelastic impact.

    The component stops turning, and the base becomes its outer hinge.
    """
    n, i = model.n, state.counter[ix.N_HELD]
    rate = float(state.v[i])
    energy, along = kinetic(i, model, state, work)
    x, y = move_base(model, state, i, 1.0)
    state.counter[ix.N_HELD] = i + 1
    spread(i + 1, model, state, work, -y * rate, x * rate, articulated.DRIVEN)
    new_energy, new_along = kinetic(i + 1, model, state, work)
    impulse = new_along - along
    ledger.note_impulse(state, impulse, float(state.v[n]))
    state.account[ix.IMPACTS] += energy - new_energy + impulse * state.v[n]


@kernel
def move_base(model: Model, state: State, i: int, way: float) -> tuple[float, float]:
    """Move the base to component i's other hinge; return the vector between the two hinges [m].

    ``way`` is 1 outward and −1 inward; the vector points outward. The component does not turn.
    """
    s, c = sincos(float(state.q[i]))
    x, y = model.bodies.length[i] * c, model.bodies.length[i] * s
    state.q[model.n] += way * x
    state.q[model.n + 1] += way * y
    state.v[i] = 0.0
    state.lock[i] = 0
    state.stuck[i] = 0
    state.counter[ix.FRESH] = 1
    return x, y


@kernel
def change_speed(model: Model, state: State, work: Work, speed: float) -> None:
    """Give the base another feed speed [m/s]; the chain outside feels an impulse.

    If this violates constraints, the impact at the beginning of the next step restores them.
    """
    lo, before = state.counter[ix.N_HELD], float(state.v[model.n])
    if speed == before:
        return
    _, along = kinetic(lo, model, state, work)
    state.v[model.n] = speed
    spread(lo, model, state, work, before - speed, 0.0, articulated.DRIVEN)
    _, new_along = kinetic(lo, model, state, work)
    ledger.note_impulse(state, new_along - along, 0.5 * (before + speed))
