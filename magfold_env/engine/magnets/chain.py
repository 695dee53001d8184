"""The magnets of a chain whose joints keep within their stops, at a fraction of the sums' cost.

Neighbours and components two apart are looked up in splines of their joints' angles; all other
pairs are summed. Where every joint between two components is at its stop their relative pose is
fixed, and what they do to each other is found once and kept. The forces are the gradient of
`chain_energy`, which is that of ``engine.magnets`` to within the splines' error.

What runs at every evaluation takes arrays one by one: fields of tuples may be loaded anew within
loops.
"""

from __future__ import annotations

import math

from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.magnets.lookup import one_energy, one_slope, two_energy, two_slopes
from magfold_env.engine.magnets.pairs import (
    act,
    add_forces,
    casing_pair,
    energy,
    far_pair,
    near_pair,
    spread_charges,
    spread_nodes,
)
from magfold_env.engine.magnets.rigid_pairs import find_stops, is_rigid, renew
from magfold_env.engine.magnets.segments import begin, finish, list_pairs
from magfold_env.engine.state import Array, IntArray, Model, Nodes, Pose, Rigid

TABLED = 2  # components at most so far apart are looked up


@kernel
def add_chain_forces(
    first: int, lo: int, model: Model, q: Array, pose: Pose,
    nodes: Nodes, rigid: Rigid, fx: Array, fy: Array, torque: Array,
) -> None:  # fmt: skip
    """Add the magnets' forces [N] and torques [N·m] on components ``lo`` on.

    Components ``first`` on are charged; those before ``lo`` are held, and nothing is added for
    pairs of them. Energies of joint angles act as torques alone: they are generalised forces of
    the headings ``q``.
    """
    if not (model.contact and model.magnets.tables.end > 0.0):
        add_forces(first, model.magnets, model.charge, pose, nodes, fx, fy, torque)
        return
    if find_stops(first, q, model.charge, rigid.charge, rigid.stop, rigid.reach, rigid.code):
        renew(first, model, nodes, rigid)
    magnets, tables, segments = model.magnets, model.magnets.tables, nodes.segments
    spread_nodes(first, magnets, pose.cos, pose.sin, pose.x, pose.y, nodes)
    begin(first, pose.x, pose.y, segments)
    while True:
        count, _ = list_pairs(
            first, lo, model.n, magnets.group_radius, magnets.group_terms, False, segments
        )
        if count == 0:
            break
        near = add_pairs(
            count, segments.pair, magnets.strips, magnets.even, magnets.height2, magnets.depth,
            magnets.reach, magnets.rank_count, magnets.rank_radius, magnets.far_radius,
            magnets.far_order, tables.end, tables.one, tables.two,
            model.charge, q, pose.cos, pose.sin, pose.x, pose.y, nodes.faces,
            nodes.x, nodes.y, nodes.q, nodes.half, nodes.moment, nodes.expanded,
            nodes.lane_x, nodes.lane_y, nodes.lane_u, nodes.spline, nodes.row,
            rigid.code, rigid.reach, rigid.force, fx, fy, torque,
        )  # fmt: skip
        for p in range(near):
            i, j = segments.pair[p, 0], segments.pair[p, 1]
            _, u, v, t = near_pair(magnets, model.charge, pose, i, j, False, nodes)
            act(pose.x, pose.y, i, j, u, v, t, fx, fy, torque)
    finish(first, model.n, segments, fx, fy, torque)


@kernel
def add_pairs(
    count: int, pair: IntArray, strips: bool, even: bool, height2: float, depth: float,
    reach: float, rank_count: IntArray, rank_radius: Array, far_radius: float, far_order: int,
    end: float, one: Array, two: Array,
    charge: Array, q: Array, cos: Array, sin: Array, x: Array, y: Array, faces: IntArray,
    node_x: Array, node_y: Array, node_q: Array, half: Array, moment: Array, expanded: Array,
    lane_x: Array, lane_y: Array, lane_u: Array, spline: Array, row: Array,
    code: IntArray, joined: IntArray, force: Array, fx: Array, fy: Array, torque: Array,
) -> int:  # fmt: skip
    """Add the forces of pairs, but not near faces' corrections: how many need them.

    Those are left in front.
    """
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
                act(x, y, i, j, c * u - s * v, s * u + c * v, t, fx, fy, torque)
        elif j - i == 1:
            bend(i, j, one_slope(one, end, q[j] - q[i], charge, i, spline, row), 0.0, torque)
        elif j - i == TABLED:
            u, v = two_slopes(two, end, q[i + 1] - q[i], q[j] - q[i + 1], charge, i, spline, row)
            bend(i, j, u, v, torque)
        else:
            if math.hypot(x[j] - x[i], y[j] - y[i]) < reach:
                pair[near, 0], pair[near, 1] = i, j
                near += 1
            _, u, v, t = far_pair(
                strips, even, height2, depth, rank_count, rank_radius, far_radius, far_order,
                x, y, i, j, False, faces, node_x, node_y, node_q, half, moment, expanded,
                lane_x, lane_y, lane_u,
            )  # fmt: skip
            act(x, y, i, j, u, v, t, fx, fy, torque)
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
        return energy(first, magnets, charge, pose, nodes)
    end, one, two = magnets.tables.end, magnets.tables.one, magnets.tables.two
    spread_charges(magnets, charge, nodes)
    spread_nodes(first, magnets, pose.cos, pose.sin, pose.x, pose.y, nodes)
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
                total += one_energy(one, end, angle, charge, i, nodes.spline, nodes.row)
            elif j - i == TABLED:
                total += two_energy(two, end, angle, next_angle, charge, i, nodes.spline, nodes.row)
            else:
                total += casing_pair(magnets, charge, pose, nodes, i, j, True)[0]
