"""Forces, torques and energy of the magnets.

A pole face is an upright rectangle of uniform charge (``strips``), or a row of point charges in the
plane (``points``, the paper's model). Along the width, both are sums over nodes, which interact by
``engine.magnets.laws``.

Distant casings need few nodes: a pair is summed at the *rank* for its distance, which has equally
many nodes on all pole faces; beyond the *far radius*, ``engine.magnets.multipoles`` expands the
pair. Pairs of pole faces with near centres are then corrected one by one, *level* by level. All
rules follow one pattern: if U_k is the energy by the k-th rule, the pair's energy is U_0 + Σ w_k
(U_k − U_{k−1}), where w_k is a twice differentiable step from 1 within a radius to 0 a little
beyond it. Forces are the exact gradient of this energy, so refinement neither adds nor removes
energy. ``engine.magnets.multipole_tree`` selects the pairs.
"""

import math

from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.magnets import laws, multipole_tree, sheets
from magfold_env.engine.magnets.laws import FacePair
from magfold_env.engine.magnets.multipoles import HIGHEST, MOST, clear, expansion, turn_moments
from magfold_env.engine.state import Array, Loads, Magnets, Nodes, Pose

BLEND = 1.1  # a level ends at this many radii
LANES = 8  # doubles in a vector register


@kernel
def spread_charges(magnets: Magnets, charge: Array, nodes: Nodes) -> None:
    """Fill in all nodes' charges [A·m] and positions, and the moments, in the casings' frames.

    Faces without charge have no nodes.
    """
    # These are loaded here, not in every iteration of the loops.
    body, charged, per_face = nodes.segments.body, nodes.segments.charged, nodes.faces
    along, across, strength, half = nodes.along, nodes.across, nodes.q, nodes.half
    node_x, node_y, share = magnets.node_x, magnets.node_y, magnets.node_weight
    face_half, face_moment = magnets.face_half, magnets.face_moment
    for i in range(charge.shape[0]):
        faces = 0
        clear(body, i, HIGHEST)
        for f in range(4):
            if charge[i, f] != 0.0:
                faces += 1
                for t in range(MOST):
                    body[i, 0, t] += charge[i, f] * face_moment[f, 0, t]
                    body[i, 1, t] += charge[i, f] * face_moment[f, 1, t]
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
    """Return a count rounded up to whole vectors; additional entries have zero weight."""
    return (count + LANES - 1) // LANES * LANES


@kernel
def spread_nodes(lo: int, magnets: Magnets, pose: Pose, nodes: Nodes) -> None:
    """Fill in the nodes' positions [m] and the moments from casing ``lo`` on."""
    turn_casings(lo, magnets, pose, nodes)
    for rank in range(magnets.rank_count.size):
        place_nodes(lo, rank, 2 * magnets.rank_count[rank], pose, nodes)


@inlined
def turn_casings(lo: int, magnets: Magnets, pose: Pose, nodes: Nodes) -> None:
    """Turn the moments into the world's frame, from casing ``lo`` on."""
    for i in range(lo, pose.x.size):
        turn_moments(magnets.far_order, i, pose.cos[i], pose.sin[i], nodes.segments)


@kernel
def place_nodes(lo: int, rank: int, count: int, pose: Pose, nodes: Nodes) -> None:
    """Fill in the positions of one rank's nodes, ``count`` per charged face of a casing."""
    along, across, out_x, out_y = nodes.along, nodes.across, nodes.x, nodes.y
    for i in range(lo, pose.x.size):
        c, s, xi, yi = pose.cos[i], pose.sin[i], pose.x[i], pose.y[i]
        for a in range(whole_lanes(count * nodes.faces[i])):
            u, v = along[rank, i, a], across[rank, i, a]
            out_x[rank, i, a] = xi + c * u - s * v
            out_y[rank, i, a] = yi + s * u + c * v


@inlined
def casing_pair(
    magnets: Magnets, charge: Array, pose: Pose, nodes: Nodes, i: int, j: int, with_energy: bool
) -> tuple[float, float, float, float]:
    """Return the energy [J], and casing j's force [N] and torque [N·m] on i, about i's centre.

    The energy is complete only if ``with_energy`` is true.
    """
    u, fx, fy, t = far_pair(magnets, pose, nodes, i, j, with_energy)
    ex, ey = pose.x[j] - pose.x[i], pose.y[j] - pose.y[i]
    if ex * ex + ey * ey < magnets.reach * magnets.reach:
        nu, nx, ny, nt = near_pair(magnets, charge, pose, nodes, i, j, with_energy)
        u += nu
        fx += nx
        fy += ny
        t += nt
    return u, fx, fy, t


@kernel
def far_pair(
    magnets: Magnets, pose: Pose, nodes: Nodes, i: int, j: int, with_energy: bool
) -> tuple[float, float, float, float]:
    """Like `casing_pair`, without the corrections for near faces."""
    far, parts = magnets.far_radius, nodes.segments
    ex, ey = pose.x[i] - pose.x[j], pose.y[i] - pose.y[j]
    distance = math.sqrt(ex * ex + ey * ey)
    if distance >= laws.SPREAD * far:
        return expansion(magnets.far_order, parts.moment, i, j, ex, ey, parts.scratch)
    between = distance > far
    room = distance - 2.0 * magnets.depth
    summed = ranked_pair(magnets, pose, nodes, i, j, room, between or with_energy)
    if not between:
        return summed
    beyond = expansion(magnets.far_order, parts.moment, i, j, ex, ey, parts.scratch)
    return laws.between_rules(summed, beyond, distance / far, laws.SPREAD, far, ex, ey)


@kernel
def ranked_pair(
    magnets: Magnets, pose: Pose, nodes: Nodes, i: int, j: int, room: float, with_energy: bool
) -> tuple[float, float, float, float]:
    """Like `far_pair`, but summed over nodes at any distance, without multipoles.

    ``room`` [m] is the centres' distance less the depths of both casings' outer faces.
    """
    rank_radius = magnets.rank_radius
    rank = rank_radius.size - 1
    while rank > 0 and room >= laws.SPREAD * rank_radius[rank]:
        rank -= 1
    blended = rank > 0 and room > rank_radius[rank]
    fine = rank_pair(magnets, pose, nodes, rank, i, j, blended or with_energy)
    if not blended:
        return fine
    coarse = rank_pair(magnets, pose, nodes, rank - 1, i, j, True)
    ex, ey = pose.x[i] - pose.x[j], pose.y[i] - pose.y[j]
    radius = rank_radius[rank]
    return laws.between_rules(fine, coarse, room / radius, laws.SPREAD, radius, ex, ey)


@kernel
def rank_pair(
    magnets: Magnets, pose: Pose, nodes: Nodes, rank: int, i: int, j: int, with_energy: bool
) -> tuple[float, float, float, float]:
    """Return the result of `casing_pair`, summed over the nodes of one rank.

    The energy is 0 unless ``with_energy`` is true.
    """
    strips, even = magnets.strips, magnets.even
    node_x, node_y, node_q, half = nodes.x, nodes.y, nodes.q, nodes.half
    lane_x, lane_y, lane_u = nodes.lane_x, nodes.lane_y, nodes.lane_u
    per_face = 2 * magnets.rank_count[rank]
    count_i, count_j = per_face * nodes.faces[i], per_face * nodes.faces[j]
    xi, yi = pose.x[i], pose.y[i]
    lanes = whole_lanes(count_i)
    for a in range(lanes):
        lane_x[a] = 0.0
        lane_y[a] = 0.0
        lane_u[a] = 0.0
    sum2, difference2, nearest2 = magnets.height2, 0.0, magnets.nearest2
    for b in range(count_j):
        x, y, q, h = node_x[rank, j, b], node_y[rank, j, b], node_q[rank, j, b], half[rank, j, b]
        if with_energy:
            for a in range(lanes):
                dx = node_x[rank, i, a] - x
                dy = node_y[rank, i, a] - y
                if not even:
                    sum2 = (half[rank, i, a] + h) * (half[rank, i, a] + h)
                    difference2 = (half[rank, i, a] - h) * (half[rank, i, a] - h)
                r2 = max(dx * dx + dy * dy, nearest2)
                g, u = laws.node_law(strips, even, sum2, difference2, r2)
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
                r2 = max(dx * dx + dy * dy, nearest2)
                g = q * laws.node_force(strips, sum2, difference2, r2)
                lane_x[a] += g * dx
                lane_y[a] += g * dy
    energy, fx, fy, torque = 0.0, 0.0, 0.0, 0.0
    for a in range(count_i):
        q = laws.COULOMB * node_q[rank, i, a]
        gx = q * lane_x[a]
        gy = q * lane_y[a]
        energy += q * lane_u[a]
        fx += gx
        fy += gy
        torque += (node_x[rank, i, a] - xi) * gy - (node_y[rank, i, a] - yi) * gx
    return energy, fx, fy, torque


@kernel
def near_pair(
    magnets: Magnets, charge: Array, pose: Pose, nodes: Nodes, i: int, j: int, with_energy: bool
) -> tuple[float, float, float, float]:
    """Return the corrections of `casing_pair` for near pole faces of casings i and j.

    The energy is complete only if ``with_energy`` is true.
    """
    face_x, face_y, half = magnets.face_x, magnets.face_y, magnets.face_half
    face_tx, face_ty = magnets.face_tx, magnets.face_ty
    energy, fx, fy, torque = 0.0, 0.0, 0.0, 0.0
    ci, si, cj, sj = pose.cos[i], pose.sin[i], pose.cos[j], pose.sin[j]
    dx, dy = pose.x[j] - pose.x[i], pose.y[j] - pose.y[i]
    outermost = magnets.level_radius[1] * BLEND
    for f in range(8):
        qa = charge[i, f % 4] * (1.0 if f < 4 else -1.0)
        ax = ci * face_x[f] - si * face_y[f]
        ay = si * face_x[f] + ci * face_y[f]
        for g in range(8):
            bx = dx + cj * face_x[g] - sj * face_y[g]
            by = dy + sj * face_x[g] + cj * face_y[g]
            ex, ey = ax - bx, ay - by
            distance2 = ex * ex + ey * ey
            if distance2 >= outermost * outermost:
                continue
            q = laws.COULOMB * qa * charge[j, g % 4] * (1.0 if g < 4 else -1.0)
            if q == 0.0:
                continue
            faces = FacePair(
                magnets.even, half[f], half[g], ex, ey,
                ci * face_tx[f] - si * face_ty[f], si * face_tx[f] + ci * face_ty[f],
                cj * face_tx[g] - sj * face_ty[g], sj * face_tx[g] + cj * face_ty[g],
            )  # fmt: skip
            u, px, py, t = refine(magnets, faces, magnets.graded[f, g] != 0, with_energy, nodes)
            energy += q * u
            fx += q * px
            fy += q * py
            torque += q * (t + ax * py - ay * px)
    return energy, fx, fy, torque


@inlined
def refine(
    magnets: Magnets, faces: FacePair, graded: bool, with_energy: bool, nodes: Nodes
) -> tuple[float, float, float, float]:
    """Return the sum of w_k (U_k − U_{k−1}) over levels and its gradient, in `level_sum`'s form.

    For ``graded`` faces, which may touch, `sheets.between` replaces all levels except 0.
    """
    if graded:
        return grade(magnets, 0, faces, with_energy, nodes)
    level_radius = magnets.level_radius
    distance = math.sqrt(faces.x * faces.x + faces.y * faces.y)
    last = 1
    blended = with_energy
    for level in range(1, level_radius.size):
        radius = level_radius[level]
        if distance < radius * BLEND:
            last = level
            blended = blended or distance > radius
    energy, fx, fy, torque = 0.0, 0.0, 0.0, 0.0
    low, lx, ly, lt = 0.0, 0.0, 0.0, 0.0
    for level in range(last + 1):
        radius = level_radius[level]
        if 0 < level < last and distance <= level_radius[level + 1]:
            continue  # the next level has full weight too, so this one cancels
        u, px, py, t = level_sum(magnets, level, faces, blended, nodes)
        if level > 0:
            weight, slope = laws.step_down(distance / radius, BLEND)
            # −∂w/∂x (U_k − U_{k−1}) acts along the line between the faces' centres.
            push = -slope / radius * (u - low) / distance
            energy += weight * (u - low)
            fx += weight * (px - lx) + push * faces.x
            fy += weight * (py - ly) + push * faces.y
            torque += weight * (t - lt)
        low, lx, ly, lt = u, px, py, t
    return energy, fx, fy, torque


@kernel
def grade(
    magnets: Magnets, level: int, faces: FacePair, with_energy: bool, nodes: Nodes
) -> tuple[float, float, float, float]:
    """Return the correction that replaces a level by `sheets.between` within the first radius."""
    radius = magnets.level_radius[1]
    ratio = math.sqrt(faces.x * faces.x + faces.y * faces.y) / radius
    if ratio >= BLEND:
        return 0.0, 0.0, 0.0, 0.0
    low = level_sum(magnets, level, faces, with_energy or ratio > 1.0, nodes)
    high = sheets.between(magnets, faces)
    u, fx, fy, t = laws.between_rules(high, low, ratio, BLEND, radius, faces.x, faces.y)
    return u - low[0], fx - low[1], fy - low[2], t - low[3]


@kernel
def level_sum(
    magnets: Magnets, level: int, faces: FacePair, with_energy: bool, scratch: Nodes
) -> tuple[float, float, float, float]:
    """Return the energy, and the force and torque on face a, for faces of unit charge.

    The torque is about a's centre. Results lack µ0/4π; without ``with_energy`` the energy is 0.
    """
    strips, even, count = magnets.strips, faces.even, magnets.level_count[level]
    nodes, weights, nearest2 = magnets.level_node, magnets.level_weight, magnets.nearest2
    lane_x, lane_y, lane_u = scratch.lane_x, scratch.lane_y, scratch.lane_u
    atx, aty = faces.ax, faces.ay
    sum2 = (faces.half_a + faces.half_b) * (faces.half_a + faces.half_b)
    difference2 = (faces.half_a - faces.half_b) * (faces.half_a - faces.half_b)
    # The lanes are face a's nodes, padded with zero-weight nodes to whole vectors.
    lanes = whole_lanes(count)
    for k in range(lanes):
        lane_x[k] = 0.0
        lane_y[k] = 0.0
        lane_u[k] = 0.0
    for m in range(count):
        fx0 = faces.x - nodes[level, m] * faces.bx
        fy0 = faces.y - nodes[level, m] * faces.by
        w = weights[level, m]
        if with_energy:
            for k in range(lanes):
                dx = fx0 + nodes[level, k] * atx
                dy = fy0 + nodes[level, k] * aty
                r2 = max(dx * dx + dy * dy, nearest2)
                g, u = laws.node_law(strips, even, sum2, difference2, r2)
                lane_x[k] += w * g * dx
                lane_y[k] += w * g * dy
                lane_u[k] += w * u
        else:
            for k in range(lanes):
                dx = fx0 + nodes[level, k] * atx
                dy = fy0 + nodes[level, k] * aty
                r2 = max(dx * dx + dy * dy, nearest2)
                g = w * laws.node_force(strips, sum2, difference2, r2)
                lane_x[k] += g * dx
                lane_y[k] += g * dy
    return sum_lanes(weights[level], nodes[level], count, (atx, aty), lane_x, lane_y, lane_u)


@inlined
def sum_lanes(
    weights: Array, places: Array, count: int, along: tuple[float, float],
    lane_x: Array, lane_y: Array, lane_u: Array,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Sum the energies, forces and torques (about a face's middle) of its nodes at ``places``."""
    energy, fx, fy, torque = 0.0, 0.0, 0.0, 0.0
    for k in range(count):
        w = weights[k]
        px, py = w * lane_x[k], w * lane_y[k]
        energy += w * lane_u[k]
        fx += px
        fy += py
        torque += places[k] * (along[0] * py - along[1] * px)
    return energy, fx, fy, torque


@kernel
def add_forces(
    lo: int, magnets: Magnets, charge: Array, pose: Pose, nodes: Nodes, loads: Loads
) -> None:
    """Add the magnets' forces [N] and torques about the centres [N·m] from casing ``lo`` on."""
    spread_charges(magnets, charge, nodes)
    spread_nodes(lo, magnets, pose, nodes)
    n, pair = pose.x.size, nodes.segments.pair
    multipole_tree.begin(lo, pose.x, pose.y, nodes.segments)
    while True:
        count, _ = multipole_tree.list_pairs(lo, lo, n, magnets.group_radius, False, nodes.segments)
        if count == 0:
            break
        for p in range(count):
            i, j = pair[p, 0], pair[p, 1]
            _, px, py, t = casing_pair(magnets, charge, pose, nodes, i, j, False)
            act(pose, i, j, px, py, t, loads)
    multipole_tree.finish(lo, n, nodes.segments, loads)


@inlined
def act(pose: Pose, i: int, j: int, px: float, py: float, t: float, loads: Loads) -> None:
    """Add the force of casing j on casing i, with its torque about i's centre, and the reaction."""
    loads.fx[i] += px
    loads.fy[i] += py
    loads.torque[i] += t
    loads.fx[j] -= px
    loads.fy[j] -= py
    # Both laws give central forces, so the pair's torques balance.
    loads.torque[j] += (pose.x[j] - pose.x[i]) * py - (pose.y[j] - pose.y[i]) * px - t


@kernel
def energy(lo: int, magnets: Magnets, charge: Array, pose: Pose, nodes: Nodes) -> float:
    """Return the energy of all pairs from casing ``lo`` on [J], but not that within casings."""
    spread_charges(magnets, charge, nodes)
    spread_nodes(lo, magnets, pose, nodes)
    total, pair = 0.0, nodes.segments.pair
    multipole_tree.begin(lo, pose.x, pose.y, nodes.segments)
    while True:
        count, far = multipole_tree.list_pairs(
            lo, lo, pose.x.size, magnets.group_radius, True, nodes.segments
        )
        total += far
        if count == 0:
            return total
        for p in range(count):
            total += casing_pair(magnets, charge, pose, nodes, pair[p, 0], pair[p, 1], True)[0]
