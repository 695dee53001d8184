"""Forces, torques and energy of the magnets.

A pole face is a rectangle of uniform charge, standing on the plane (``strips``), or a row of
point charges in the plane (``points``, the paper's). Along the width both are sums over nodes,
which act on each other as ``engine.magnet_laws`` says.

Casings far from each other need few nodes: a pair is summed at the *rank* that its distance asks
for, all pole faces with equally many nodes; beyond the *far radius* it is expanded in
``engine.expansions``. Pole faces whose centres are near are then corrected one pair of them at a
time, *level* by level. All follow one pattern: with U_k the energy by the k-th rule, the pair's
energy is U_0 + Σ w_k (U_k − U_{k−1}), where w_k is a twice differentiable step from 1 within a
radius to 0 a little beyond it. Forces are the exact gradient of this energy, so refinement takes
no energy from the chain and gives it none. ``engine.segments`` picks the pairs.
"""

from __future__ import annotations

import math

from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.magnets.expansions import TERMS, expansion, turn_moments
from magfold_env.engine.magnets.laws import COULOMB, between_rules, node_force, node_law
from magfold_env.engine.magnets.multipoles import PARTS, turn_row
from magfold_env.engine.magnets.near_faces import LANES, near_pair
from magfold_env.engine.magnets.segments import SPREAD, begin, finish, list_pairs
from magfold_env.engine.state import Array, IntArray, Magnets, Nodes, Pose


@kernel
def spread_charges(magnets: Magnets, charge: Array, nodes: Nodes) -> None:
    """Fill charges [A·m] and places of all casings' nodes, and moments, in the casings' frames.

    Faces without charge have no nodes.
    """
    # Loaded here, not at every turn of the loops.
    body, charged, per_face = nodes.segments.body, nodes.segments.charged, nodes.faces
    along, across, strength, half = nodes.along, nodes.across, nodes.q, nodes.half
    node_x, node_y, share = magnets.node_x, magnets.node_y, magnets.node_weight
    face_half, face_moment, face_wide = magnets.face_half, magnets.face_moment, magnets.face_wide
    wide = nodes.body
    for i in range(charge.shape[0]):
        faces = 0
        for p in range(PARTS):
            body[i, p] = 0.0
        for t in range(len(TERMS)):
            wide[i, 0, t], wide[i, 1, t] = 0.0, 0.0
        for f in range(4):
            if charge[i, f] != 0.0:
                faces += 1
                for p in range(PARTS):
                    body[i, p] += charge[i, f] * face_moment[f, p]
                for t in range(len(TERMS)):
                    wide[i, 0, t] += charge[i, f] * face_wide[f, 0, t]
                    wide[i, 1, t] += charge[i, f] * face_wide[f, 1, t]
        per_face[i] = faces
        charged[i] = 1 if faces > 0 else 0
        for rank in range(magnets.rank_count.size):
            count = magnets.rank_count[rank]
            k = 0
            for f in range(8):
                q = charge[i, f % 4]
                if q == 0.0:
                    continue
                for a in range(f * count, (f + 1) * count):
                    along[rank, i, k] = node_x[rank, a]
                    across[rank, i, k] = node_y[rank, a]
                    strength[rank, i, k] = share[rank, a] * q
                    half[rank, i, k] = face_half[f]
                    k += 1
            for a in range(k, whole_lanes(k)):
                along[rank, i, a] = along[rank, i, 0]
                across[rank, i, a] = across[rank, i, 0]
                strength[rank, i, a] = 0.0
                half[rank, i, a] = face_half[0]


@inlined
def whole_lanes(count: int) -> int:
    """Return how many entries fill vectors; those too many weigh nothing."""
    return (count + LANES - 1) // LANES * LANES


@kernel
def spread_nodes(
    lo: int, magnets: Magnets, cos: Array, sin: Array, x: Array, y: Array, nodes: Nodes
) -> None:
    """Fill the nodes' positions [m] and the moments for casings ``lo`` on."""
    for i in range(lo, x.size):
        turn_row(nodes.segments.body, i, cos[i], sin[i], nodes.segments.moment)
        turn_moments(magnets.far_order, nodes.body, i, cos[i], sin[i], nodes.expanded, nodes.moment)
    for rank in range(magnets.rank_count.size):
        place_nodes(
            lo, rank, 2 * magnets.rank_count[rank], nodes.faces, nodes.along, nodes.across,
            cos, sin, x, y, nodes.x, nodes.y,
        )  # fmt: skip


@kernel
def place_nodes(
    lo: int, rank: int, count: int, faces: IntArray, along: Array, across: Array,
    cos: Array, sin: Array, x: Array, y: Array, out_x: Array, out_y: Array,
) -> None:  # fmt: skip
    """Do so for the nodes of one rank, ``count`` for each of a casing's charged faces."""
    for i in range(lo, x.size):
        c, s, xi, yi = cos[i], sin[i], x[i], y[i]
        for a in range(whole_lanes(count * faces[i])):
            u, v = along[rank, i, a], across[rank, i, a]
            out_x[rank, i, a] = xi + c * u - s * v
            out_y[rank, i, a] = yi + s * u + c * v


@inlined
def casing_pair(
    magnets: Magnets, charge: Array, pose: Pose, nodes: Nodes, i: int, j: int, with_energy: bool
) -> tuple[float, float, float, float]:
    """Energy [J], force on casing i [N] and torque about its centre [N·m] by casing j.

    The energy is complete only ``with_energy``.
    """
    u, fx, fy, t = far_pair(
        magnets.strips, magnets.even, magnets.height2, magnets.depth,
        magnets.rank_count, magnets.rank_radius, magnets.far_radius, magnets.far_order,
        pose.x, pose.y, i, j, with_energy, nodes.faces, nodes.x, nodes.y, nodes.q, nodes.half,
        nodes.moment, nodes.expanded, nodes.lane_x, nodes.lane_y, nodes.lane_u,
    )  # fmt: skip
    if math.hypot(pose.x[j] - pose.x[i], pose.y[j] - pose.y[i]) < magnets.reach:
        nu, nx, ny, nt = near_pair(magnets, charge, pose, i, j, with_energy, nodes)
        u += nu
        fx += nx
        fy += ny
        t += nt
    return u, fx, fy, t


@kernel
def far_pair(
    strips: bool, even: bool, height2: float, depth: float,
    rank_count: IntArray, rank_radius: Array, far_radius: float, far_order: int,
    x: Array, y: Array, i: int, j: int, with_energy: bool, faces: IntArray,
    node_x: Array, node_y: Array, node_q: Array, half: Array, moment: Array, expanded: Array,
    lane_x: Array, lane_y: Array, lane_u: Array,
) -> tuple[float, float, float, float]:  # fmt: skip
    """As `casing_pair` without near faces' corrections.

    Hot kernels take the arrays they need: fields of tuples may be loaded anew within loops.
    """
    ex, ey = x[i] - x[j], y[i] - y[j]
    distance = math.sqrt(ex * ex + ey * ey)
    if distance >= SPREAD * far_radius:
        return expansion(far_order, moment, i, j, ex, ey, expanded)
    between = distance > far_radius
    summed = ranked_pair(
        strips, even, height2, rank_count, rank_radius, distance - 2.0 * depth, ex, ey,
        x, y, i, j, between or with_energy, faces,
        node_x, node_y, node_q, half, lane_x, lane_y, lane_u,
    )  # fmt: skip
    if not between:
        return summed
    beyond = expansion(far_order, moment, i, j, ex, ey, expanded)
    return between_rules(summed, beyond, distance / far_radius, SPREAD, far_radius, ex, ey)


@kernel
def ranked_pair(
    strips: bool, even: bool, height2: float, rank_count: IntArray, rank_radius: Array,
    room: float, ex: float, ey: float, x: Array, y: Array, i: int, j: int, with_energy: bool,
    faces: IntArray, node_x: Array, node_y: Array, node_q: Array, half: Array,
    lane_x: Array, lane_y: Array, lane_u: Array,
) -> tuple[float, float, float, float]:  # fmt: skip
    """As `far_pair`, summed over nodes at any distance.

    ``room`` [m] is the centres' distance less the depths of both casings' outer faces; (ex, ey) [m]
    points from j to i.
    """
    rank = rank_count.size - 1
    while rank > 0 and room >= SPREAD * rank_radius[rank]:
        rank -= 1
    blended = rank > 0 and room > rank_radius[rank]
    fine = rank_pair(
        strips, even, height2, rank, 2 * rank_count[rank] * faces[i],
        2 * rank_count[rank] * faces[j], i, j, x[i], y[i], blended or with_energy,
        node_x, node_y, node_q, half, lane_x, lane_y, lane_u,
    )  # fmt: skip
    if not blended:
        return fine
    coarse = rank_pair(
        strips, even, height2, rank - 1, 2 * rank_count[rank - 1] * faces[i],
        2 * rank_count[rank - 1] * faces[j], i, j, x[i], y[i], True,
        node_x, node_y, node_q, half, lane_x, lane_y, lane_u,
    )  # fmt: skip
    radius = rank_radius[rank]
    return between_rules(fine, coarse, room / radius, SPREAD, radius, ex, ey)


@kernel
def rank_pair(
    strips: bool, even: bool, height2: float, rank: int, count_i: int, count_j: int,
    i: int, j: int, xi: float, yi: float, with_energy: bool,
    node_x: Array, node_y: Array, node_q: Array, half: Array,
    lane_x: Array, lane_y: Array, lane_u: Array,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Energy, force on casing i and its torque about (xi, yi), over the nodes of one rank.

    The energy is 0 unless asked for.
    """
    lanes = whole_lanes(count_i)
    for a in range(lanes):
        lane_x[a] = 0.0
        lane_y[a] = 0.0
        lane_u[a] = 0.0
    sum2, difference2 = height2, 0.0
    for b in range(count_j):
        x, y, q, h = node_x[rank, j, b], node_y[rank, j, b], node_q[rank, j, b], half[rank, j, b]
        if with_energy:
            for a in range(lanes):
                dx = node_x[rank, i, a] - x
                dy = node_y[rank, i, a] - y
                if not even:
                    sum2 = (half[rank, i, a] + h) * (half[rank, i, a] + h)
                    difference2 = (half[rank, i, a] - h) * (half[rank, i, a] - h)
                g, u = node_law(strips, even, sum2, difference2, dx * dx + dy * dy)
                lane_x[a] += q * g * dx
                lane_y[a] += q * g * dy
                lane_u[a] += q * u
        else:
            for a in range(lanes):
                dx = node_x[rank, i, a] - x
                dy = node_y[rank, i, a] - y
                if not even:
                    sum2 = (half[rank, i, a] + h) * (half[rank, i, a] + h)
                    difference2 = (half[rank, i, a] - h) * (half[rank, i, a] - h)
                g = q * node_force(strips, sum2, difference2, dx * dx + dy * dy)
                lane_x[a] += g * dx
                lane_y[a] += g * dy
    energy, fx, fy, torque = 0.0, 0.0, 0.0, 0.0
    for a in range(count_i):
        q = COULOMB * node_q[rank, i, a]
        gx = q * lane_x[a]
        gy = q * lane_y[a]
        energy += q * lane_u[a]
        fx += gx
        fy += gy
        torque += (node_x[rank, i, a] - xi) * gy - (node_y[rank, i, a] - yi) * gx
    return energy, fx, fy, torque


@kernel
def add_forces(
    lo: int, magnets: Magnets, charge: Array, pose: Pose,
    nodes: Nodes, fx: Array, fy: Array, torque: Array,
) -> None:  # fmt: skip
    """Add the magnets' forces [N] and torques about the centres [N·m] of casings ``lo`` on."""
    spread_charges(magnets, charge, nodes)
    spread_nodes(lo, magnets, pose.cos, pose.sin, pose.x, pose.y, nodes)
    n, pair = pose.x.size, nodes.segments.pair
    begin(lo, pose.x, pose.y, nodes.segments)
    while True:
        count, _ = list_pairs(
            lo, lo, n, magnets.group_radius, magnets.group_terms, False, nodes.segments
        )
        if count == 0:
            break
        for p in range(count):
            i, j = pair[p, 0], pair[p, 1]
            _, px, py, t = casing_pair(magnets, charge, pose, nodes, i, j, False)
            act(pose.x, pose.y, i, j, px, py, t, fx, fy, torque)
    finish(lo, n, nodes.segments, fx, fy, torque)


@inlined
def act(
    x: Array, y: Array, i: int, j: int, px: float, py: float, t: float,
    fx: Array, fy: Array, torque: Array,
) -> None:  # fmt: skip
    """Add the force of casing j on casing i, with its torque about i's centre, and the reaction."""
    fx[i] += px
    fy[i] += py
    torque[i] += t
    fx[j] -= px
    fy[j] -= py
    # Both laws act along lines, so the pair's torques balance.
    torque[j] += (x[j] - x[i]) * py - (y[j] - y[i]) * px - t


@kernel
def energy(lo: int, magnets: Magnets, charge: Array, pose: Pose, nodes: Nodes) -> float:
    """Energy of all pairs of casings ``lo`` on [J]; pairs of faces within a casing left out."""
    spread_charges(magnets, charge, nodes)
    spread_nodes(lo, magnets, pose.cos, pose.sin, pose.x, pose.y, nodes)
    total, pair = 0.0, nodes.segments.pair
    begin(lo, pose.x, pose.y, nodes.segments)
    while True:
        count, far = list_pairs(
            lo, lo, pose.x.size, magnets.group_radius, magnets.group_terms, True, nodes.segments
        )
        total += far
        if count == 0:
            return total
        for p in range(count):
            total += casing_pair(magnets, charge, pose, nodes, pair[p, 0], pair[p, 1], True)[0]
