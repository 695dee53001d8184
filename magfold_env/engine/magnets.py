"""Forces, torques and energy of the magnets.

A pole face is a rectangle of uniform charge, standing on the plane (``strips``), or a row of
point charges in the plane (``points``, the paper's). Along the width both are sums over nodes,
which act on each other as ``engine.magnet_laws`` says.

Casings far from each other need few nodes: a pair is summed at the *rank* that its distance asks
for, all eight pole faces with equally many nodes. Pole faces whose centres are near are then
corrected one pair of them at a time, *level* by level. Both follow one pattern: with U_k the
energy with the nodes of rank or level k, the pair's energy is U_0 + Σ w_k (U_k − U_{k−1}), where
w_k is a twice differentiable step from 1 within a radius to 0 a little beyond it. Forces are the
exact gradient of this energy, so refinement takes no energy from the chain and gives it none.
"""

from __future__ import annotations

import math

from magfold_env.engine.jit import inlined, kernel
from magfold_env.engine.magnet_laws import COULOMB, node_force, node_law, step_down
from magfold_env.engine.near_faces import near_pair
from magfold_env.engine.state import Array, IntArray, Magnets, Nodes, Pose

SPREAD = 1.25  # and a rank at so many, counted from where outer faces could meet


@kernel
def spread_charges(magnets: Magnets, charge: Array, nodes: Nodes) -> None:
    """Fill the charges of all casings' nodes [A·m]."""
    for rank in range(magnets.rank_count.size):
        for i in range(charge.shape[0]):
            for a in range(magnets.rank_count[rank]):
                q = charge[i, magnets.node_face[rank, a]]
                nodes.q[rank, i, a] = magnets.node_weight[rank, a] * q


@kernel
def spread_nodes(
    lo: int, rank_count: IntArray, node_x: Array, node_y: Array,
    cos: Array, sin: Array, x: Array, y: Array, out_x: Array, out_y: Array,
) -> None:  # fmt: skip
    """Fill the nodes' positions [m] for casings ``lo`` on."""
    for rank in range(rank_count.size):
        for i in range(lo, x.size):
            c, s, xi, yi = cos[i], sin[i], x[i], y[i]
            for a in range(rank_count[rank]):
                u, v = node_x[rank, a], node_y[rank, a]
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
        magnets.strips, magnets.height2, magnets.depth, magnets.rank_count, magnets.rank_radius,
        pose.x, pose.y, i, j, with_energy,
        nodes.x, nodes.y, nodes.q, nodes.lane_x, nodes.lane_y, nodes.lane_u,
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
    strips: bool, height2: float, depth: float, rank_count: IntArray, rank_radius: Array,
    x: Array, y: Array, i: int, j: int, with_energy: bool,
    node_x: Array, node_y: Array, node_q: Array, lane_x: Array, lane_y: Array, lane_u: Array,
) -> tuple[float, float, float, float]:  # fmt: skip
    """As `casing_pair` without near faces' corrections.

    Hot kernels take the arrays they need: tuples of arrays are slow to pass on.
    """
    ex, ey = x[j] - x[i], y[j] - y[i]
    distance = math.sqrt(ex * ex + ey * ey)
    room = distance - 2.0 * depth
    rank = rank_count.size - 1
    while rank > 0 and room >= SPREAD * rank_radius[rank]:
        rank -= 1
    blended = rank > 0 and room > rank_radius[rank]
    u, fx, fy, t = rank_pair(
        strips, height2, rank_count[rank], rank, i, j, x[i], y[i], blended or with_energy,
        node_x, node_y, node_q, lane_x, lane_y, lane_u,
    )  # fmt: skip
    if blended:
        low, lx, ly, lt = rank_pair(
            strips, height2, rank_count[rank - 1], rank - 1, i, j, x[i], y[i], True,
            node_x, node_y, node_q, lane_x, lane_y, lane_u,
        )  # fmt: skip
        radius = rank_radius[rank]
        weight, slope = step_down(room / radius, SPREAD)
        # −∂w/∂x (U_k − U_{k−1}) acts along the line of the centres.
        push = slope / radius * (u - low) / distance
        u = low + weight * (u - low)
        fx = lx + weight * (fx - lx) + push * ex
        fy = ly + weight * (fy - ly) + push * ey
        t = lt + weight * (t - lt)
    return u, fx, fy, t


@kernel
def rank_pair(
    strips: bool, height2: float, count: int, rank: int, i: int, j: int,
    xi: float, yi: float, with_energy: bool,
    node_x: Array, node_y: Array, node_q: Array, lane_x: Array, lane_y: Array, lane_u: Array,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Energy, force on casing i and its torque about (xi, yi), over the nodes of one rank.

    The energy is 0 unless asked for.
    """
    for a in range(count):
        lane_x[a] = 0.0
        lane_y[a] = 0.0
        lane_u[a] = 0.0
    for b in range(count):
        x, y, q = node_x[rank, j, b], node_y[rank, j, b], node_q[rank, j, b]
        if with_energy:
            for a in range(count):
                dx = node_x[rank, i, a] - x
                dy = node_y[rank, i, a] - y
                g, u = node_law(strips, height2, dx * dx + dy * dy)
                lane_x[a] += q * g * dx
                lane_y[a] += q * g * dy
                lane_u[a] += q * u
        else:
            for a in range(count):
                dx = node_x[rank, i, a] - x
                dy = node_y[rank, i, a] - y
                g = q * node_force(strips, height2, dx * dx + dy * dy)
                lane_x[a] += g * dx
                lane_y[a] += g * dy
    energy, fx, fy, torque = 0.0, 0.0, 0.0, 0.0
    for a in range(count):
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
    spread_nodes(
        lo, magnets.rank_count, magnets.node_x, magnets.node_y,
        pose.cos, pose.sin, pose.x, pose.y, nodes.x, nodes.y,
    )  # fmt: skip
    for i in range(lo, pose.x.size):
        for j in range(i + 1, pose.x.size):
            _, px, py, t = casing_pair(magnets, charge, pose, nodes, i, j, False)
            act(pose.x, pose.y, i, j, px, py, t, fx, fy, torque)


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
    spread_nodes(
        lo, magnets.rank_count, magnets.node_x, magnets.node_y,
        pose.cos, pose.sin, pose.x, pose.y, nodes.x, nodes.y,
    )  # fmt: skip
    total = 0.0
    for i in range(lo, pose.x.size):
        for j in range(i + 1, pose.x.size):
            total += casing_pair(magnets, charge, pose, nodes, i, j, True)[0]
    return total
