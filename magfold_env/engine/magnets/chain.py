"""Forces and energy of a chain's magnets for joints within their stops, faster than by sums.

Neighbours and components two apart use splines of their joint angles; other pairs use a table or
sums. If every joint between two components is at its stop, their relative pose is fixed, so their
interaction is computed once and stored. A base-3 integer encodes the stops between them and thus
the pose; the interaction is computed for exactly that pose, so it does not depend on the chain's
history. The forces are the gradient of `chain_energy`, which equals the energy in `pairs` to within
the splines' error.
"""

import math

from magfold_env.engine.chain import articulated
from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.magnets import far_table, laws, multipole_tree, outer_field, pairs
from magfold_env.engine.magnets.multipoles import expansion
from magfold_env.engine.magnets.near_table import one_joint, two_joints
from magfold_env.engine.state import (
    Array,
    IntArray,
    Loads,
    Magnets,
    Model,
    Nodes,
    Pose,
    Rigid,
    Work,
    copy,
)

HALF_PI = math.pi / 2.0
AT_STOP = 1e-9  # [rad] a joint this near to its stop is at it
LEFT, RIGHT = 1, 2
TABLED = 2  # components at most this far apart use splines of joint angles


@kernel
def add_chain_forces(
    first: int, lo: int, model: Model, q: Array, pose: Pose, nodes: Nodes, rigid: Rigid,
    loads: Loads,
) -> None:  # fmt: skip
    """Add the magnets' forces [N] and torques [N·m] on components from ``lo`` on.

    The magnets of components from ``first`` on act. Components before ``lo`` are held, and pairs of
    held components are omitted. Energies that depend on joint angles give only torques, the
    generalised forces of the headings ``q``.
    """
    if not (model.contact and model.magnets.tables.end > 0.0):
        pairs.add_forces(first, model.magnets, model.charge, pose, nodes, loads)
        return
    refresh_cache(first, model, q, nodes, rigid)
    magnets = model.magnets
    spread(first, model, pose, nodes)
    multipole_tree.begin(first, pose.x, pose.y, nodes.segments)
    while True:
        count, _ = multipole_tree.list_pairs(
            first, lo, model.n, magnets.group_radius, False, nodes.segments
        )
        if count == 0:
            break
        add_pairs(count, model, q, pose, nodes, rigid, loads)
    multipole_tree.finish(first, model.n, nodes.segments, loads)


@inlined
def spread(first: int, model: Model, pose: Pose, nodes: Nodes) -> None:
    """Rotate the needed nodes and moments into the world's frame, from casing ``first`` on."""
    end = model.magnets.tables.far.end
    if end == 0.0 or model.field.present:
        pairs.spread_nodes(first, model.magnets, pose, nodes)
    elif (model.n - 1) * model.bodies.length[0] > end / laws.SPREAD and (
        # Segments need all moments; pairs need them only beyond the table.
        nodes.segments.start.size > 1 or widest(first, pose) > end / laws.SPREAD
    ):
        pairs.turn_casings(first, model.magnets, pose, nodes)


@inlined
def widest(first: int, pose: Pose) -> float:
    """Return the diagonal of the centres' bounding box from casing ``first`` on [m]."""
    left, right, low, high = math.inf, -math.inf, math.inf, -math.inf
    for i in range(first, pose.x.size):
        left, right = min(left, pose.x[i]), max(right, pose.x[i])
        low, high = min(low, pose.y[i]), max(high, pose.y[i])
    width, height = right - left, high - low
    return math.sqrt(width * width + height * height)


@inlined
def apart(
    magnets: Magnets, charge: Array, pose: Pose, turn: float, nodes: Nodes, i: int, j: int,
    with_energy: bool,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Return the result of `pairs.casing_pair` for casings at least three joints apart.

    ``turn`` is j's heading less i's [rad].
    """
    far, column = magnets.tables.far, nodes.stencils.column
    if far.end > 0.0:
        far_table.see(pose, turn, i, j, column, 0)
        far_table.locate(far, 1, column)
    return located(magnets, charge, pose, nodes, i, j, 0, with_energy)


@inlined
def located(
    magnets: Magnets, charge: Array, pose: Pose, nodes: Nodes, i: int, j: int, place: int,
    with_energy: bool,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Like `apart`, for a pair that `look_ahead` has located in the table, if there is a table."""
    far, parts = magnets.tables.far, nodes.segments
    if far.end == 0.0:
        return pairs.casing_pair(magnets, charge, pose, nodes, i, j, with_energy)
    ex, ey = pose.x[i] - pose.x[j], pose.y[i] - pose.y[j]
    distance, begins = math.sqrt(ex * ex + ey * ey), far.end / laws.SPREAD
    if distance >= far.end:
        return expansion(magnets.far_order, parts.moment, i, j, ex, ey, parts.scratch)
    u, fx, fy, t = far_table.interpolate(far, charge, pose, i, j, nodes.stencils, place)
    if distance < far.reach:
        v, gx, gy, s = far_table.stiffen(magnets, charge, pose, nodes, i, j, with_energy)
        return u + v, fx + gx, fy + gy, t + s
    if distance <= begins:
        return u, fx, fy, t
    beyond = expansion(magnets.far_order, parts.moment, i, j, ex, ey, parts.scratch)
    ratio = distance / begins
    return laws.between_rules((u, fx, fy, t), beyond, ratio, laws.SPREAD, begins, ex, ey)


@inlined
def look_ahead(
    begin: int, count: int, model: Model, q: Array, pose: Pose, nodes: Nodes, rigid: Rigid
) -> int:
    """Locate the next pairs in the table, as many as one look-up takes; return their number.

    They are those of the pairs listed from ``begin`` on that are at least three joints apart.
    """
    far, column, pair = model.magnets.tables.far, nodes.stencils.column, nodes.segments.pair
    if far.end == 0.0:
        return count
    seen = 0
    for p in range(begin, count):
        i, j = int(pair[p, 0]), int(pair[p, 1])
        if j - i > TABLED and not is_rigid(i, j, rigid.reach, rigid.code):
            far_table.see(pose, q[j] - q[i], i, j, column, seen)
            seen += 1
            if seen == far_table.LANES:
                break
    far_table.locate(far, seen, column)
    return seen


@kernel
def add_pairs(
    count: int, model: Model, q: Array, pose: Pose, nodes: Nodes, rigid: Rigid, loads: Loads
) -> None:
    """Add the forces of the listed pairs."""
    pair, charge, tables = nodes.segments.pair, model.charge, model.magnets.tables
    cos, sin = pose.cos, pose.sin
    code, joined, force, torque = rigid.code, rigid.reach, rigid.force, loads.torque
    place, seen = 0, 0
    for p in range(count):
        i, j = int(pair[p, 0]), int(pair[p, 1])
        k = j - i - 1
        if is_rigid(i, j, joined, code):
            u, v, t = force[i, k, 0], force[i, k, 1], force[i, k, 2]
            if j - i <= TABLED:
                bend(i, j, u, v, torque)
            else:
                c, s = cos[i], sin[i]
                pairs.act(pose, i, j, c * u - s * v, s * u + c * v, t, loads)
        elif j - i == 1:
            bend(i, j, one_joint(tables, q[j] - q[i], charge, i, i, nodes)[1], 0.0, torque)
        elif j - i == TABLED:
            _, u, v = two_joints(tables, q[i + 1] - q[i], q[j] - q[i + 1], charge, i, i, nodes)
            bend(i, j, u, v, torque)
        else:
            if place == seen:
                place, seen = 0, look_ahead(p, count, model, q, pose, nodes, rigid)
            _, u, v, t = located(model.magnets, charge, pose, nodes, i, j, place, False)
            place += 1
            pairs.act(pose, i, j, u, v, t, loads)


@inlined
def bend(i: int, j: int, slope: float, next_slope: float, torque: Array) -> None:
    """Add the torques of an energy, given its derivatives in the angles of joints i + 1 and j."""
    torque[i] += slope
    torque[i + 1] -= slope
    torque[j - 1] += next_slope
    torque[j] -= next_slope


@inlined
def is_rigid(i: int, j: int, reach: IntArray, code: IntArray) -> bool:
    """Whether component j is rigidly joined to i and their forces are stored."""
    return j <= reach[i] and j - i <= code.shape[1]


@kernel
def refresh_cache(first: int, model: Model, q: Array, nodes: Nodes, rigid: Rigid) -> None:
    """Mark the joints at their stops, and update the stored forces of rigidly joined pairs.

    If charges have changed, distribute them over the nodes too.
    """
    n, charge, stop, reach, code = model.n, model.charge, rigid.stop, rigid.reach, rigid.code
    changed = False
    for i in range(n):
        for a in range(4):
            changed |= charge[i, a] != rigid.charge[i, a]
    if changed:
        pairs.spread_charges(model.magnets, charge, nodes)
        for i in range(n):
            copy(charge[i], rigid.charge[i], 0)
        code[:] = 0
        invalidate_cache(nodes)
    # There is no joint 0, so its entry holds the first component.
    changed |= stop[0] != first + 1
    stop[0] = first + 1
    for k in range(first + 1, n):
        angle = q[k] - q[k - 1]
        now = 0
        if abs(abs(angle) - HALF_PI) <= AT_STOP:
            now = LEFT if angle > 0.0 else RIGHT
        changed |= now != stop[k]
        stop[k] = now
    if not changed:
        return
    reach[n - 1] = n - 1
    for i in range(n - 2, first - 1, -1):
        reach[i] = reach[i + 1] if stop[i + 1] > 0 else i
    for i in range(first, n):
        stops = 0
        for j in range(i + 1, min(reach[i], i + code.shape[1]) + 1):
            stops = 3 * stops + stop[j]
            if code[i, j - i - 1] != stops:
                code[i, j - i - 1] = stops
                cache_rigid_pair(model, i, j, rigid)


@inlined
def invalidate_cache(nodes: Nodes) -> None:
    """Invalidate all stored values that contain charges."""
    nodes.bends.one_cell[:] = 0
    nodes.bends.two_cell[:] = 0
    nodes.stencils.pair[:] = 0


@kernel
def cache_rigid_pair(model: Model, i: int, j: int, rigid: Rigid) -> None:
    """Store a pair's interaction for the pose with every joint between the two exactly at its stop.

    For a pair with splines of joint angles, the interaction consists of derivatives with respect to
    the angles. For other pairs, it is a force and a torque in the frame of i.
    """
    kept, nodes = rigid.force[i, j - i - 1], rigid.nodes
    invalidate_cache(nodes)
    tables = model.magnets.tables
    angle, next_angle = stop_angle(rigid.stop[i + 1]), stop_angle(rigid.stop[j])
    if j - i == 1:
        kept[0], kept[1] = one_joint(tables, angle, model.charge, i, 0, nodes)[1], 0.0
        return
    if j - i == 2:
        _, kept[0], kept[1] = two_joints(tables, angle, next_angle, model.charge, i, 0, nodes)
        return
    pose, bodies = rigid.pose, model.bodies
    pose.cos[0], pose.sin[0], pose.x[0], pose.y[0] = 1.0, 0.0, 0.0, 0.0
    c, s, turn = 1.0, 0.0, 0.0
    x, y = bodies.length[i] - bodies.reach[i], 0.0
    for k in range(i + 1, j + 1):
        turn += stop_angle(rigid.stop[k])
        c, s = (-s, c) if rigid.stop[k] == LEFT else (s, -c)
        along = bodies.reach[k] if k == j else bodies.length[k]
        x += along * c
        y += along * s
    pose.cos[1], pose.sin[1], pose.x[1], pose.y[1] = c, s, x, y
    copy(model.charge[i], rigid.charges[0], 0)
    copy(model.charge[j], rigid.charges[1], 0)
    pairs.spread_charges(model.magnets, rigid.charges, nodes)
    spread(0, model, pose, nodes)
    _, kept[0], kept[1], kept[2] = apart(
        model.magnets, rigid.charges, pose, turn, nodes, 0, 1, False
    )


@inlined
def stop_angle(stop: int) -> float:
    """Return the angle of a joint at its stop [rad]."""
    return HALF_PI if stop == LEFT else -HALF_PI


@kernel
def chain_energy(first: int, model: Model, q: Array, pose: Pose, nodes: Nodes) -> float:
    """Return the energy of all pairs from component ``first`` on [J]; see `add_chain_forces`."""
    magnets, charge = model.magnets, model.charge
    if not (model.contact and magnets.tables.end > 0.0):
        return pairs.energy(first, magnets, charge, pose, nodes)
    tables = magnets.tables
    pairs.spread_charges(magnets, charge, nodes)
    invalidate_cache(nodes)
    spread(first, model, pose, nodes)
    total, pair = 0.0, nodes.segments.pair
    multipole_tree.begin(first, pose.x, pose.y, nodes.segments)
    while True:
        count, far = multipole_tree.list_pairs(
            first, first, model.n, magnets.group_radius, True, nodes.segments
        )
        total += far
        if count == 0:
            return total
        for p in range(count):
            i, j = int(pair[p, 0]), int(pair[p, 1])
            angle, next_angle = q[i + 1] - q[i], q[j] - q[i + 1]
            if j - i == 1:
                total += one_joint(tables, angle, charge, i, i, nodes)[0]
            elif j - i == TABLED:
                total += two_joints(tables, angle, next_angle, charge, i, i, nodes)[0]
            else:
                turn = q[j] - q[i]
                total += apart(magnets, charge, pose, turn, nodes, i, j, True)[0]


@kernel
def magnet_energy(first: int, model: Model, work: Work) -> float:
    """Return the energy [J] of components from ``first`` on, with any field, at the known pose."""
    if not model.magnetic:
        return 0.0
    total = pairs.energy(first, model.magnets, model.charge, work.pose, work.nodes)
    return total + _outer(first, model, work)


@kernel
def potential_energy(first: int, model: Model, q: Array, work: Work) -> float:
    """Return the energy whose exact gradient gives the simulated magnet forces [J].

    It equals `magnet_energy`, which uses sums instead of tables, to within the magnets' accuracy.
    """
    if not model.magnetic:
        return 0.0
    total = chain_energy(first, model, q, work.pose, work.nodes)
    return total + _outer(first, model, work)


@kernel
def _outer(first: int, model: Model, work: Work) -> float:
    if not model.field.present:
        return 0.0
    return outer_field.field_energy(first, model, work.pose, work.nodes)


@kernel
def magnet_loads(model: Model, headings: Array, work: Work, out: Array) -> None:
    """Fill ``out`` with magnets' generalised forces [N·m] at headings [rad], both (shapes, n)."""
    n = model.n
    q = work.stages.q
    q[n] = 0.0
    q[n + 1] = 0.0
    for shape in range(headings.shape[0]):
        copy(headings[shape], q, 0)
        articulated.place(0, model.bodies, q, work.pose)
        work.loads.fx[:] = 0.0
        work.loads.fy[:] = 0.0
        work.loads.torque[:] = 0.0
        outer_field.add_magnet_forces(0, model, work.pose, work.nodes, work.loads)
        articulated.generalise(0, model.bodies, work.pose, work.loads, work.chain.force)
        for k in range(n):
            out[shape, k] = work.chain.force[k]
