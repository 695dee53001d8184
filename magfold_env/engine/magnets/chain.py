"""The magnets of a chain whose joints keep within their stops, at a fraction of the sums' cost.

Neighbours and components two apart are looked up in splines of their joints' angles; all other
pairs are summed. Where every joint between two components is at its stop their relative pose is
fixed, and what they do to each other is found once and kept. The forces are the gradient of
`chain_energy`, which is that of ``pairs`` to within the splines' error.
"""

from __future__ import annotations

import math

from magfold_env.engine.chain import articulated
from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.magnets import lookup, outer_field, pairs
from magfold_env.engine.magnets.rigid_pairs import find_stops, is_rigid, renew
from magfold_env.engine.magnets.segments import begin, finish, list_pairs
from magfold_env.engine.state import Array, Loads, Model, Nodes, Pose, Rigid, Work, copy

TABLED = 2  # components at most so far apart are looked up


@kernel
def add_chain_forces(
    first: int, lo: int, model: Model, q: Array, pose: Pose, nodes: Nodes, rigid: Rigid,
    loads: Loads,
) -> None:  # fmt: skip
    """Add the magnets' forces [N] and torques [N·m] on components ``lo`` on.

    Components ``first`` on are charged; those before ``lo`` are held, and nothing is added for
    pairs of them. Energies of joint angles act as torques alone: they are generalised forces of
    the headings ``q``.
    """
    if not (model.contact and model.magnets.tables.end > 0.0):
        pairs.add_forces(first, model.magnets, model.charge, pose, nodes, loads)
        return
    if find_stops(first, q, model.charge, rigid.charge, rigid.stop, rigid.reach, rigid.code):
        renew(first, model, nodes, rigid)
    magnets, segments = model.magnets, nodes.segments
    pairs.spread_nodes(first, magnets, pose, nodes)
    begin(first, pose.x, pose.y, segments)
    while True:
        count, _ = list_pairs(
            first, lo, model.n, magnets.group_radius, magnets.group_terms, False, segments
        )
        if count == 0:
            break
        near = add_pairs(count, model, q, pose, nodes, rigid, loads)
        for p in range(near):
            i, j = segments.pair[p, 0], segments.pair[p, 1]
            _, u, v, t = pairs.near_pair(magnets, model.charge, pose, nodes, i, j, False)
            pairs.act(pose, i, j, u, v, t, loads)
    finish(first, model.n, segments, loads)


@kernel
def add_pairs(
    count: int, model: Model, q: Array, pose: Pose, nodes: Nodes, rigid: Rigid, loads: Loads
) -> int:
    """Add the forces of pairs, but not near faces' corrections: how many need them.

    Those are left in front.
    """
    magnets, pair, charge = model.magnets, nodes.segments.pair, model.charge
    tables, reach = magnets.tables, magnets.reach
    cos, sin, x, y = pose.cos, pose.sin, pose.x, pose.y
    code, joined, force, torque = rigid.code, rigid.reach, rigid.force, loads.torque
    near = 0
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
            bend(i, j, lookup.one_slope(tables, q[j] - q[i], charge, i, nodes), 0.0, torque)
        elif j - i == TABLED:
            u, v = lookup.two_slopes(tables, q[i + 1] - q[i], q[j] - q[i + 1], charge, i, nodes)
            bend(i, j, u, v, torque)
        else:
            if math.hypot(x[j] - x[i], y[j] - y[i]) < reach:
                pair[near, 0], pair[near, 1] = i, j
                near += 1
            _, u, v, t = pairs.far_pair(magnets, pose, nodes, i, j, False)
            pairs.act(pose, i, j, u, v, t, loads)
    return near


@inlined
def bend(i: int, j: int, slope: float, next_slope: float, torque: Array) -> None:
    """Add the torques of an energy with the given slopes by the angles of joints i + 1 and j."""
    torque[i] += slope
    torque[i + 1] -= slope
    torque[j - 1] += next_slope
    torque[j] -= next_slope


@kernel
def chain_energy(first: int, model: Model, q: Array, pose: Pose, nodes: Nodes) -> float:
    """Energy of all pairs of components ``first`` on [J] whose gradient `add_chain_forces` is."""
    magnets, charge = model.magnets, model.charge
    if not (model.contact and magnets.tables.end > 0.0):
        return pairs.energy(first, magnets, charge, pose, nodes)
    tables = magnets.tables
    pairs.spread_charges(magnets, charge, nodes)
    pairs.spread_nodes(first, magnets, pose, nodes)
    total, segments = 0.0, nodes.segments
    begin(first, pose.x, pose.y, segments)
    while True:
        count, far = list_pairs(
            first, first, model.n, magnets.group_radius, magnets.group_terms, True, segments
        )
        total += far
        if count == 0:
            return total
        for p in range(count):
            i, j = int(segments.pair[p, 0]), int(segments.pair[p, 1])
            angle, next_angle = q[i + 1] - q[i], q[j] - q[i + 1]
            if j - i == 1:
                total += lookup.one_energy(tables, angle, charge, i, nodes)
            elif j - i == TABLED:
                total += lookup.two_energy(tables, angle, next_angle, charge, i, nodes)
            else:
                total += pairs.casing_pair(magnets, charge, pose, nodes, i, j, True)[0]


def magnet_energy(first: int, model: Model, work: Work) -> float:
    """Energy of components ``first`` on at the pose in ``work`` [J]."""
    if not model.magnetic:
        return 0.0
    total = pairs.energy(first, model.magnets, model.charge, work.pose, work.nodes)
    return float(total) + _outer(first, model, work)


def potential_energy(first: int, model: Model, q: Array, work: Work) -> float:
    """Energy whose exact gradient the simulated magnet forces are [J].

    Within the magnets' accuracy it is `magnet_energy`, which sums where the dynamics looks up.
    """
    if not model.magnetic:
        return 0.0
    total = chain_energy(first, model, q, work.pose, work.nodes)
    return float(total) + _outer(first, model, work)


def _outer(first: int, model: Model, work: Work) -> float:
    if not model.field.present:
        return 0.0
    return float(outer_field.field_energy(first, model, work.pose, work.nodes))


@kernel
def magnet_loads(model: Model, headings: Array, work: Work, out: Array) -> None:
    """Fill ``out`` (shapes, n) [N·m] for headings (shapes, n) [rad]."""
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
        articulated.generalise(
            0,
            model.bodies,
            work.pose,
            work.loads,
            work.chain.force,
        )
        for k in range(n):
            out[shape, k] = work.chain.force[k]
