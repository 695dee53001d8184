"""Moreau's time-stepping, for phases in which contacts or stops rattle or components creep.

A step, after Moreau and Jean, has two halves. The first half moves the chain to a middle position.
Its velocity is the one nearest to the free velocity, in the metric of the mass matrix, that makes
no gap negative and leaves components at rest that friction holds. The velocity is then found again
with the forces, masses and gaps at the middle, for the second half and the end. The friction of
slow components is solved for too, so that its direction may change within the step. Impacts, even
simultaneous ones, happen inside steps without being located. The momentum of a free chain is
corrected separately, because only external forces change it.
"""

import math

from magfold_env.engine import indices as ix
from magfold_env.engine import outcomes
from magfold_env.engine.chain import articulated, feed, ledger
from magfold_env.engine.chain.momentum import (
    energy_outside,
    keep_momentum,
    kinetic_of,
    momentum_along,
    outer_force,
)
from magfold_env.engine.chain.tube import is_partly_out, place_all, whole_mass
from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.contact import events, sweep
from magfold_env.engine.contact.complementarity import solve_nonnegative
from magfold_env.engine.contact.constraints import (
    collect_within,
    first_joint,
    hold_joints,
    open_joints,
    place_touching,
)
from magfold_env.engine.contact.jacobian import HALF_PI
from magfold_env.engine.elementary import square
from magfold_env.engine.friction import law
from magfold_env.engine.friction.solver import solve_with_friction
from magfold_env.engine.friction.sticking import STOPPED
from magfold_env.engine.state import Array, Model, Record, State, Work, copy
from magfold_env.engine.stepping import dynamics
from magfold_env.engine.stepping.recorder import record_line

NEAR_STOP = 1e-6  # [rad] a joint this near to its stop may reach it at any rate
COARSEST = 0.01  # [s]
FINEST = 10.0  # shortest step, in tolerances of the lightest component's typical rate
TURN = 0.1  # [rad] limit on a component's turn in a step, at its old rate
SHARE = 0.05  # of the tolerance: limit on an angle's change by a step's change of velocity
GROWTH = 1.5  # largest ratio of a step's length to the previous one
CAUTION = 0.9  # times the longest step that seems adequate
TINY = 1e-300
CAUGHT_UP = 0.01  # share of a step by which a slipping drive may overshoot
HOPELESS = 1e-3  # in finest steps: shorter ones do not help either
ROUNDING = 1e-12  # [m/s]
VIOLENT = 100.0  # times the energy of the free motion: no valid change takes more


@kernel
def moreau_step(
    model: Model, state: State, work: Work, record: Record, until: float, rattles: bool
) -> int:
    """Take one step from the state, whose pose and forces are in ``work``; return the outcome.

    If something ``rattles``, the step uses the new velocity from its beginning; otherwise the
    velocity changes linearly.
    """
    lo, n, moreau = state.counter[ix.N_HELD], model.n, work.moreau
    if model.frictional and mark_slow(lo, model, state, work):
        dynamics.smooth_forces(lo, model, state.q, state.v, work)
        state.counter[ix.EVALUATIONS] += 1
    dynamics.unconstrained(lo, model, work, work.chain.unlocked, moreau.smooth)
    state.counter[ix.STEPS] += 1
    remaining = until - state.clock[ix.TIME]
    outcome, h, next_step = attempt_step(model, state, work, remaining, rattles)
    driven = feed.drives(model, state)
    if outcome == outcomes.NO_SOLUTION and driven and state.v[n] != 0.0:
        # The chain cannot move at the requested speed.
        feed.slip(model, state, work, float(state.v[n]))
        return outcomes.TOUCHED
    if outcome != outcomes.ACCEPTED:
        return outcome
    impulse, lost = take_account(model, state, work, h)
    most = ledger.most_force(model, state) * max(h, ledger.MEAN_OVER)
    if driven and abs(impulse) > most:
        # The impulse exceeds the drive's limit.
        feed.slip(model, state, work, impulse)
        return outcomes.TOUCHED
    state.clock[ix.STEP] = next_step
    state.account[ix.IMPACTS] += lost
    record_line(record, state, state.clock[ix.TIME] + h, moreau.new_q, moreau.new_v, impulse)
    if is_partly_out(model, state):
        ledger.pass_time(state, state.clock[ix.TIME] + h, impulse)
        feed.note_step(state, work, impulse, moreau.new_q[n] - state.q[n])
    copy(moreau.new_q, state.q, lo)
    copy(moreau.new_v, state.v, lo)
    state.clock[ix.TIME] = until if h >= remaining else state.clock[ix.TIME] + h
    # A joint that reaches its stop keeps its rate until the next step's impact.
    open_joints(lo, model, state)
    for i in range(lo, n):
        if work.friction.slow[i] == 1 and abs(state.v[i]) * model.friction_radius < ROUNDING:
            state.v[i] = 0.0
    hold_joints(lo, model, state.lock, state.q, state.v)
    return outcomes.TOUCHED


@kernel
def attempt_step(
    model: Model, state: State, work: Work, remaining: float, rattles: bool
) -> tuple[int, float, float]:
    """Find a step that is accurate enough, and store its end in ``work.moreau``.

    The step is shortened until forces change little, because poles may almost meet, and until the
    velocity changes little, but not below a limit, because in an impact it always jumps. Returns
    ACCEPTED or another outcome, the step's length [s], and the length of the next step [s].
    """
    lo, moreau = state.counter[ix.N_HELD], work.moreau
    fastest = model.fastest_rate
    for k in range(lo, model.n):
        fastest = max(fastest, abs(state.v[k]))
    finest = min(FINEST * model.tolerance / model.fastest_rate, TURN / fastest)
    # Friction reverses when a component stops, so no step goes far beyond that moment.
    stop = max(state.clock[ix.BRAKE], 0.1 * finest)
    h = min(max(GROWTH * state.clock[ix.STEP], finest), COARSEST, stop)
    near_stop = NEAR_STOP
    while True:
        h = min(h, remaining)
        shorter_helps = h > HOPELESS * finest
        found = velocity_after(model, state, work, h, 0.0 if rattles else 0.75, near_stop)
        if not found and not shorter_helps:
            return outcomes.NO_SOLUTION, h, h
        # Closing gaps may change the velocity too much; a shorter step helps. A slipping drive
        # would exceed the requested speed and add energy, so the step ends at this speed.
        share = until_caught_up(model, state, moreau.new_v) if found else 0.25
        if share < 1.0 - CAUGHT_UP and shorter_helps:
            h *= max(share, 0.1)
            continue
        moved, bent = changes(model, state, work, h)
        if not math.isfinite(moved):
            return outcomes.NOT_FINITE, h, h
        if bent > SHARE * model.tolerance and shorter_helps:
            h *= 0.5
            continue
        # Changes by forces grow with the square of a step's length, those by impacts linearly.
        shorter = CAUTION * math.sqrt(SHARE * model.tolerance / max(moved, TINY))
        if moved > SHARE * model.tolerance and h > finest:
            h = max(min(max(shorter, 0.1), 0.8) * h, finest)
            continue
        if moved > SHARE * model.tolerance and not rattles:
            # It is an impact: with the old velocity, closing gaps would become overlaps.
            rattles = True
            continue
        past = go_to_end(model, state, work, h, 0.0 if rattles else 0.25)
        if past > sweep.PAST * model.tolerance and near_stop == NEAR_STOP:
            # An impact has turned back a joint that was leaving its stop.
            near_stop = HALF_PI
            continue
        if not (shorter_helps and passes_by(model, state, work)):
            return outcomes.ACCEPTED, h, min(shorter / GROWTH, 1.0) * h
        h *= 0.5


@inlined
def until_caught_up(model: Model, state: State, new_v: Array) -> float:
    """Return the fraction of a step at which a slipping drive reaches the requested speed, or 1."""
    if not (is_partly_out(model, state) and feed.slips(state)):
        return 1.0
    missing = state.feed[ix.ASKED] - state.v[model.n]
    share = missing / (new_v[model.n] - state.v[model.n])
    return share if state.counter[ix.SLIPPING] * missing > 0.0 and 0.0 < share < 1.0 else 1.0


@inlined
def changes(model: Model, state: State, work: Work, h: float) -> tuple[float, float]:
    """Return the largest displacements in a step due to changes of velocity and of forces.

    Both are in radians, or in units of a square's side.
    """
    moreau, moved, bent = work.moreau, 0.0, 0.0
    for k in range(state.counter[ix.N_HELD], model.n + 2):
        turn = 0.5 * h * abs(moreau.new_v[k] - state.v[k])
        moved = max(moved, turn if k < model.n else turn / model.side)
        turn = 0.5 * h * h * abs(moreau.middle_smooth[k] - moreau.smooth[k])
        bent = max(bent, turn if k < model.n else turn / model.side)
    return moved, bent


@inlined
def go_to_end(model: Model, state: State, work: Work, h: float, old: float) -> float:
    """Find a step's end; its second half mixes a share ``old`` of the old velocity into the new.

    Joints are kept from passing their stops. Returns the largest correction of an angle [rad].
    """
    moreau, lo = work.moreau, state.counter[ix.N_HELD]
    copy(moreau.middle_q, moreau.new_q, 0)
    for k in range(lo, model.n + 2):
        moreau.new_q[k] += 0.5 * h * (moreau.new_v[k] + old * (state.v[k] - moreau.new_v[k]))
    past = 0.0
    if model.contact:
        for k in range(first_joint(lo), model.n):
            angle = moreau.new_q[k] - moreau.new_q[k - 1]
            if abs(angle) > HALF_PI:
                past = max(past, abs(angle) - HALF_PI)
                moreau.new_q[k] = moreau.new_q[k - 1] + math.copysign(HALF_PI, angle)
    return past


@inlined
def passes_by(model: Model, state: State, work: Work) -> bool:
    """Whether the step makes squares meet other squares or solids whose gaps it ignored."""
    if not (model.contact and events.may_collide(model)):
        return False
    lo, new_q = state.counter[ix.N_HELD], work.moreau.new_q
    place_touching(lo, model, new_q, work)
    sweep.follow_line(lo, model, state.q, new_q, work)
    squares = sweep.may_meet(model, state, work)
    return events.first_missed(model, state, squares, False, work)[2] < 0.0


@kernel
def mark_slow(lo: int, model: Model, state: State, work: Work) -> bool:
    """Mark nearly resting components, whose friction the step solves for; return whether any exist.

    Only the other components, when they come to a stop, bound the step.
    """
    found = False
    brake = math.inf
    law.find_velocities(lo, model, state, work)
    for i in range(lo, model.n):
        slide = law.slide_of(model, work, state.v, i)
        slow = state.stuck[i] == 1 or slide < STOPPED * model.tolerance * model.side
        work.friction.slow[i] = int(slow)
        found = found or slow
        if not slow:
            brake = min(brake, work.friction.braking[i])
    state.clock[ix.BRAKE] = brake
    return found


@kernel
def velocity_after(
    model: Model, state: State, work: Work, h: float, old: float, near_stop: float
) -> bool:
    """Store a step's middle position and new velocity in ``work.moreau``; ``h`` is its length.

    The first half mixes a share ``old`` of the old velocity into the new one. Joints within
    ``near_stop`` [rad] of a stop are kept from passing it at any rate. Returns False if the
    velocity could not be found. The smooth accelerations of the state must be known.
    """
    lo, n, moreau = state.counter[ix.N_HELD], model.n, work.moreau
    # If a step is repeated, the pose and inertias here are still the middle's; restore the state's.
    place_all(lo, model, state.q, work.pose)
    articulated.factor(lo, model.bodies, work.pose, work.chain.unlocked, work.chain)
    if not constrain(model, state, state.q, moreau.smooth, work, h, h, near_stop):
        return False
    copy(state.q, moreau.middle_q, 0)
    copy(state.v, moreau.middle_v, 0)
    for k in range(lo, n + 2):
        moreau.middle_q[k] += 0.5 * h * (moreau.new_v[k] + old * (state.v[k] - moreau.new_v[k]))
        moreau.middle_v[k] = 0.5 * (state.v[k] + moreau.new_v[k])
    state.counter[ix.EVALUATIONS] += 1
    middle = moreau.middle_smooth
    dynamics.smooth_accelerations(lo, model, moreau.middle_q, moreau.middle_v, work, middle)
    push_x, push_y, twist = outer_force(lo, model, work)
    articulated.generalise(lo, model.bodies, work.pose, work.loads, moreau.force)
    if not constrain(model, state, moreau.middle_q, middle, work, h, 0.5 * h, near_stop):
        return False
    end = moreau.new_q
    for k in range(n + 2):
        end[k] = moreau.middle_q[k] + 0.5 * h * moreau.new_v[k]
    keep_momentum(model, state, work, end, moreau.new_v, h * push_x, h * push_y, h * twist)
    return True


@kernel
def constrain(
    model: Model, state: State, q: Array, acceleration: Array, work: Work, h: float, left: float,
    near_stop: float,
) -> bool:  # fmt: skip
    """Find the velocity after a step ``h``, nearest to the free one, that closes no gap of ``q``.

    ``left`` is the time for which the gaps must last; ``near_stop`` is as in `velocity_after`. The
    pose and inertias of ``q`` must be known. Returns False if the velocity could not be found.
    """
    lo, n = state.counter[ix.N_HELD], model.n
    v = work.moreau.new_v
    copy(state.v, v, 0)
    for k in range(lo, n + 2):
        v[k] += h * acceleration[k]
    rows = collect_within(lo, model, q, work, v, left, near_stop)
    if rows < 0:
        return False
    count = rows
    work.rows.counts[ix.CONTACTS] = rows
    work.rows.counts[ix.ALL_ROWS] = 0
    if model.frictional:
        articulated.centripetal(
            lo, model.bodies, work.pose, state.v, work.centres.ax, work.centres.ay
        )
    for i in range(lo, n):
        if work.friction.slow[i] == 1:
            if count + 3 > work.rows.bias.size:
                return False
            law.friction_rows(lo, model, work.pose, work, count, i)
            count += 3
    dynamics.respond(lo, model, work, count)
    # Friction is a force, so the unknowns are then accelerations over the step, not velocities.
    unit = h if count > rows else 1.0
    for r in range(count):
        # Conditions on gaps hold in this pose, and those on friction hold at the step's end.
        rest = work.rows.bias[r] if r < rows else left * work.rows.bias[r]
        work.rows.bias[r] = (rest + dynamics.rate_of(lo, work, r, v)) / unit
        work.rows.equality[r] = 0
        work.rows.passive[r] = 1
    solved = solve(rows, count, work, model)
    if not solved or too_violent(lo, rows, count, model, work, v, unit):
        for r in range(rows):
            work.rows.bias[r] = max(work.rows.bias[r], dynamics.rate_of(lo, work, r, v) / unit)
            work.rows.passive[r] = 1
        solved = solve(rows, count, work, model)
    for r in range(count):
        work.rows.multiplier[r] *= unit
    work.rows.counts[ix.SOLVED] = count
    dynamics.apply_multipliers(lo, count, work, v)
    return solved


@kernel
def take_account(model: Model, state: State, work: Work, h: float) -> tuple[float, float]:
    """Return the drive's impulse [N·s] and the energy lost in contacts [J] during the step.

    Both follow from the momentum and energy balances over the step. Where velocities jump, sums of
    impulses times rates would have a first-order error, because the impulses are computed with the
    mass matrix at the middle of the step.
    """
    lo, n, rows, moreau = state.counter[ix.N_HELD], model.n, work.rows, work.moreau
    lost = kinetic_of(lo, model, work, state.q, state.v)
    along = momentum_along(lo, model, work, state.v)
    lost -= kinetic_of(lo, model, work, moreau.new_q, moreau.new_v)
    along = momentum_along(lo, model, work, moreau.new_v) - along
    mean = moreau.middle_v
    for k in range(lo, n + 2):
        mean[k] = (moreau.new_q[k] - state.q[k]) / h
        lost += h * moreau.force[k] * mean[k]
    for r in range(rows.counts[ix.CONTACTS], rows.counts[ix.SOLVED]):
        lost += rows.multiplier[r] * dynamics.rate_of(lo, work, r, mean)
    if not is_partly_out(model, state):
        return 0.0, lost
    pull = h * work.chain.base[ix.PULL]
    impulse = h * work.chain.base[ix.DRIVE]
    if not feed.slips(state):
        impulse = along - h * moreau.force[n] - pull
        for r in range(rows.counts[ix.JOINT_STOPS], rows.counts[ix.SOLVED]):
            impulse -= rows.multiplier[r] * rows.jacobian[r, n]
    return impulse, lost + (impulse + pull) * mean[n]


@inlined
def solve(rows: int, count: int, work: Work, model: Model) -> bool:
    """Find the multipliers of ``rows`` gaps, and of friction in the following rows."""
    if count > rows:
        return solve_with_friction(rows, count, work, model.friction_limit)
    return solve_nonnegative(count, work)


@kernel
def too_violent(
    lo: int, rows: int, count: int, model: Model, work: Work, v: Array, unit: float
) -> bool:
    """Whether the multipliers change the free velocity ``v`` by more than gaps can require.

    At rest no gap closes, so keeping all gaps open takes no more energy than the free motion has,
    except for removing overlaps. Squares that overlap others on both sides may need a velocity that
    is unbounded or does not exist; their overlaps are left for later.
    """
    fastest = 0.0
    for r in range(work.rows.counts[ix.JOINT_STOPS], rows):
        fastest = max(fastest, dynamics.rate_of(lo, work, r, v) - unit * work.rows.bias[r])
    change = 0.0
    for r in range(count):
        for c in range(count):
            change += work.rows.multiplier[r] * work.rows.delassus[r, c] * work.rows.multiplier[c]
    energy = energy_outside(lo, model, work, v) + 0.5 * whole_mass(model) * square(fastest)
    return not 0.5 * unit * unit * change <= VIOLENT * energy
