"""Accelerations of one chain: smooth forces, then active constraints and friction.

The accelerations are those nearest to the unconstrained ones, in the metric of the mass matrix,
that keep every touching pair from approaching (Gauss's principle). `project` does the same for
velocities, which gives Moreau's inelastic impact.
"""

from magfold_env.engine import indices as ix
from magfold_env.engine.chain import articulated
from magfold_env.engine.chain.recursion import swing
from magfold_env.engine.chain.tube import base_mass, place_all
from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.contact import boxes, jacobian
from magfold_env.engine.contact.complementarity import solve_nonnegative
from magfold_env.engine.friction import law
from magfold_env.engine.magnets import chain, outer_field
from magfold_env.engine.state import Array, IntArray, Model, State, Work


@inlined
def smooth_forces(lo: int, model: Model, q: Array, v: Array, work: Work) -> None:
    """Find the generalised forces of magnets, fields, gravity, inertia and friction.

    Leaves the pose and the centres' velocities in ``work``. Charged components that are still in
    the tube act on the others.
    """
    n = model.n
    bodies, pose = model.bodies, work.pose
    first = place_all(lo, model, q, pose)
    articulated.centre_motion(lo, bodies, pose, v, work.centres)
    for i in range(n):
        work.loads.fx[i] = 0.0
        work.loads.fy[i] = 0.0
        work.loads.torque[i] = 0.0
    if model.magnetic:
        chain.add_chain_forces(first, lo, model, q, pose, work.nodes, work.rigid, work.loads)
    if model.tube:
        find_pull(first, lo, model, work)
    if model.magnetic and model.field.present:
        outer_field.add_field(lo, model, pose, work.nodes, work.loads)
    if model.frictional:
        law.add_sliding(lo, model, v, work)
    for i in range(lo, n):
        m = bodies.mass[i]
        work.loads.fx[i] += m * (model.gravity_x - work.centres.ax[i])
        work.loads.fy[i] += m * (model.gravity_y - work.centres.ay[i])
    articulated.generalise(lo, bodies, pose, work.loads, work.chain.force)
    if work.chain.base[ix.CARRIED] > 0.0:
        work.chain.force[n] += work.chain.base[ix.DRIVE] + work.chain.base[ix.PULL]


@kernel
def find_pull(first: int, lo: int, model: Model, work: Work) -> None:
    """Store the force of magnets, fields and gravity on the held components along the tube [N].

    The loads must contain only the forces of the chain's own magnets; their total on the held
    components is the reaction to their total on the free ones.
    """
    pull = 0.0
    for i in range(lo, model.n):
        pull -= work.loads.fx[i]
    for i in range(lo):
        pull += model.bodies.mass[i] * model.gravity_x
        if model.field.present and i >= first:
            pull += outer_field.in_field(model, work.pose, work.nodes, i, False)[1]
    work.chain.base[ix.PULL] = pull


@inlined
def unconstrained(lo: int, model: Model, work: Work, lock: IntArray, out: Array) -> None:
    """Compute the accelerations (n + 2,) under the smooth forces, without constraints.

    Joints whose ``lock`` is not 0 do not turn. Leaves the articulated inertias in ``work``.
    """
    base = base_mass(lo, model, work)
    articulated.factor(lo, model.bodies, work.pose, lock, work.chain)
    articulated.solve(lo, model.bodies, work.pose, lock, base, work.chain.force, out, work.chain)


@kernel
def smooth_accelerations(lo: int, model: Model, q: Array, v: Array, work: Work, out: Array) -> None:
    """Compute the smooth forces and the accelerations (n + 2,) under these forces alone."""
    smooth_forces(lo, model, q, v, work)
    unconstrained(lo, model, work, work.chain.unlocked, out)


@inlined
def rigid_accelerations(model: Model, state: State, work: Work, out: Array) -> bool:
    """Compute accelerations (n + 2,) under the smooth forces if joints at their stops stay there.

    Locked components then move as rigid bodies, without constraints to solve for. Returns whether
    all stops press; only then is the result valid. The multipliers are the stops' torques.
    """
    unconstrained(state.counter[ix.N_HELD], model, work, state.lock, out)
    for r in range(work.rows.counts[ix.JOINT_STOPS]):
        k, sign = work.rows.id[r, 0], work.rows.id[r, 1]
        work.rows.multiplier[r] = -sign * work.chain.hold[k]
        if work.rows.multiplier[r] < 0.0:
            return False
    return True


@kernel
def respond(lo: int, model: Model, work: Work, count: int) -> None:
    """Compute the rows' responses M⁻¹Jᵀ and their Delassus matrix J M⁻¹Jᵀ."""
    n = model.n
    base = base_mass(lo, model, work)
    for r in range(count):
        row, response = work.rows.jacobian[r], work.rows.response[r]
        articulated.solve(
            lo, model.bodies, work.pose, work.chain.unlocked, base, row, response, work.chain
        )
    for r in range(count):
        for c in range(r + 1):
            total = 0.0
            for k in range(lo, n + 2):
                total += work.rows.jacobian[c, k] * work.rows.response[r, k]
            work.rows.delassus[r, c] = total
            work.rows.delassus[c, r] = total


@kernel
def fill_rows(lo: int, model: Model, v: Array, work: Work) -> None:
    """Fill in Jacobians, biases and responses of the constraints in ``work.rows.id``."""
    stops, rows = work.rows.counts[ix.JOINT_STOPS], work.rows.counts[ix.CONTACTS]
    count = work.rows.counts[ix.ALL_ROWS]
    for r in range(stops):
        jacobian.stop_row(lo, model, work, r, work.rows.id[r, 0], work.rows.id[r, 1])
    if rows > stops:
        boxes.place_boxes(boxes.first_box(lo), model, work.pose, work)
        for r in range(stops, rows):
            jacobian.contact_row(lo, model, work.pose, work, r, v)
    for r in range(rows, count, 3):
        law.friction_rows(lo, model, work.pose, work, r, work.rows.id[r, 0])
    respond(lo, model, work, count)


@inlined
def rate_of(lo: int, work: Work, r: int, v: Array) -> float:
    """Return row r's Jacobian times ``v``."""
    total = 0.0
    for k in range(lo, v.size):
        total += work.rows.jacobian[r, k] * v[k]
    return total


@inlined
def apply_multipliers(lo: int, count: int, work: Work, out: Array) -> None:
    """Add the rows' responses, times their multipliers, to ``out``."""
    for r in range(count):
        lam = work.rows.multiplier[r]
        if lam != 0.0:
            for k in range(lo, out.size):
                out[k] += work.rows.response[r, k] * lam


@inlined
def accelerations(model: Model, state: State, q: Array, v: Array, work: Work, out: Array) -> bool:
    """Compute accelerations (n + 2,) under the step's constraints; return whether they were found.

    Components marked in ``state.stuck`` stay at rest.
    """
    state.counter[ix.EVALUATIONS] += 1
    if model.pinned and not (model.magnetic or model.frictional or model.contact):
        swing(model, q, v, work, out)
        return True
    return constrained(model, state, q, v, work, out)


@kernel
def constrained(model: Model, state: State, q: Array, v: Array, work: Work, out: Array) -> bool:
    """Do the work of `accelerations` for any chain."""
    lo = state.counter[ix.N_HELD]
    if model.frictional:
        # Rounding moves components that friction holds, but these must not count as sliding.
        for i in range(lo, model.n):
            work.friction.slow[i] = state.stuck[i]
    smooth_forces(lo, model, q, v, work)
    is_free = work.rows.counts[ix.ALL_ROWS] == work.rows.counts[ix.JOINT_STOPS]
    work.rows.counts[ix.SOLVED] = work.rows.counts[ix.ALL_ROWS]
    if is_free and rigid_accelerations(model, state, work, out):
        return True
    unconstrained(lo, model, work, work.chain.unlocked, out)
    fill_rows(lo, model, v, work)
    rows, count = work.rows.counts[ix.CONTACTS], work.rows.counts[ix.ALL_ROWS]
    for r in range(count):
        work.rows.bias[r] += rate_of(lo, work, r, out)
        work.rows.equality[r] = 1 if r >= rows else 0
    solved = solve_nonnegative(count, work)
    apply_multipliers(lo, count, work, out)
    return solved


@inlined
def lost(lo: int, rows: int, work: Work, v: Array) -> float:
    """Return the energy lost in an impact [J]: rows' impulses times mean rates (Thomson's theorem).

    ``v`` holds the velocities after the impact; ``work.rows.bias`` still holds the rates before it.
    """
    total = 0.0
    for r in range(rows):
        impulse = work.rows.multiplier[r]
        if impulse != 0.0:
            total -= 0.5 * impulse * (work.rows.bias[r] + rate_of(lo, work, r, v))
    return total


@kernel
def project(model: Model, state: State, v: Array, work: Work, slow: float) -> bool:
    """Apply Moreau's impact: replace ``v`` with the nearest velocity that no row forbids.

    "Nearest" refers to the metric of the mass matrix. Corners that would separate more slowly than
    ``slow`` [m/s] are kept together, which ends rocking. The pose must be known.
    """
    lo = state.counter[ix.N_HELD]
    rows = work.rows.counts[ix.CONTACTS]
    if rows == 0:
        return True
    articulated.centre_motion(lo, model.bodies, work.pose, v, work.centres)
    articulated.factor(lo, model.bodies, work.pose, work.chain.unlocked, work.chain)
    fill_rows(lo, model, v, work)
    for r in range(rows):
        work.rows.bias[r] = rate_of(lo, work, r, v)
        work.rows.equality[r] = 0
        work.rows.passive[r] = 1
    solved = solve_nonnegative(rows, work)
    again = False
    for r in range(work.rows.counts[ix.JOINT_STOPS], rows):
        after = work.rows.bias[r]
        for c in range(rows):
            after += work.rows.delassus[r, c] * work.rows.multiplier[c]
        if work.rows.passive[r] == 0 and after < slow:
            work.rows.equality[r] = 1
            again = True
    if again:
        solved = solve_nonnegative(rows, work)
    apply_multipliers(lo, rows, work, v)
    return solved
