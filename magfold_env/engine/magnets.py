"""Forces, torques and energy of the magnets.

A pole face is a rectangle of uniform charge, standing on the plane (``strips``), or a row of
point charges in the plane (``points``, the paper's). Along the width both are sums over nodes.

With equal heights H the out-of-plane integral between two nodes at in-plane distance ρ is closed,
with S = √(ρ² + H²): force 2 d / (ρ² (ρ + S)), energy (2/H²)(H asinh(H/ρ) − S + ρ), both times
(µ0/4π) q_k q_l.

Every pair of casings is summed with a few *base* nodes, in loops that vectorise. Pairs of pole
faces whose centres are near are then corrected: level k adds w_k(ρ) (U_k − U_{k−1}), U_k being
the pair's energy with level k's nodes and w_k a twice differentiable step that is 1 within
``level_radius[k]`` and 0 beyond ``BLEND`` times that. Forces are the exact gradient of this
energy, so refinement takes no energy from the chain and gives it none.
"""

from __future__ import annotations

import math

from magfold_env.engine.jit import inlined, kernel
from magfold_env.engine.state import Array, Magnets, Nodes, Pose

COULOMB = 1e-7  # µ0 / 4π [N/A²]
BLEND = 1.1
LANES = 8  # doubles in a vector register


@inlined
def node_force(strips: bool, height2: float, r2: float) -> float:
    """Force between unit charges divided by their distance vector, without µ0/4π [1/m³]."""
    r = math.sqrt(r2)
    if strips:
        return 2.0 / (r2 * (r + math.sqrt(r2 + height2)))
    return 1.0 / (r2 * r)


@inlined
def node_energy(strips: bool, height2: float, r2: float) -> float:
    """Energy of unit charges, without µ0/4π [1/m]."""
    r = math.sqrt(r2)
    if strips:
        h = math.sqrt(height2)
        # H asinh(H/ρ) − S + ρ loses digits far away; there is nothing else to lose them to.
        s = math.sqrt(r2 + height2)
        return 2.0 / height2 * (h * math.asinh(h / r) - height2 / (s + r))
    return 1.0 / r


@inlined
def step_down(ratio: float) -> tuple[float, float]:
    """Weight and its derivative: 1 for ratio ≤ 1, 0 for ratio ≥ BLEND, C² between."""
    if ratio <= 1.0:
        return 1.0, 0.0
    if ratio >= BLEND:
        return 0.0, 0.0
    t = (ratio - 1.0) / (BLEND - 1.0)
    return (
        1.0 - t * t * t * (10.0 - 15.0 * t + 6.0 * t * t),
        -30.0 * t * t * (1.0 - t) * (1.0 - t) / (BLEND - 1.0),
    )


@kernel
def spread_nodes(lo: int, magnets: Magnets, charge: Array, pose: Pose, nodes: Nodes) -> None:
    """Fill the base nodes' positions [m] and charges [A·m], each (n, nodes a casing)."""
    for i in range(lo, pose.x.size):
        c, s = pose.cos[i], pose.sin[i]
        x, y = pose.x[i], pose.y[i]
        for a in range(magnets.node_x.size):
            nodes.x[i, a] = x + c * magnets.node_x[a] - s * magnets.node_y[a]
            nodes.y[i, a] = y + s * magnets.node_x[a] + c * magnets.node_y[a]
            nodes.q[i, a] = magnets.node_weight[a] * charge[i, magnets.node_face[a]]


@kernel
def level_pair(
    magnets: Magnets, level: int, ax: float, ay: float, atx: float, aty: float,
    bx: float, by: float, btx: float, bty: float, with_energy: bool, lane_x: Array, lane_y: Array,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Energy, force on face a and its torque about the origin, for faces of unit charge.

    Faces are given by centre and direction; without µ0/4π. The energy is 0 unless asked for.
    """
    count = magnets.level_count[level]
    # The lanes are face a's nodes, padded with weightless ones to the width of a vector.
    lanes = (count + LANES - 1) // LANES * LANES
    node = magnets.level_node[level]
    weight = magnets.level_weight[level]
    ex, ey = ax - bx, ay - by
    for k in range(lanes):
        lane_x[k] = 0.0
        lane_y[k] = 0.0
    for m in range(count):
        fx0, fy0, w = ex - node[m] * btx, ey - node[m] * bty, weight[m]
        for k in range(lanes):
            dx = fx0 + node[k] * atx
            dy = fy0 + node[k] * aty
            g = w * node_force(magnets.strips, magnets.height2, dx * dx + dy * dy)
            lane_x[k] += g * dx
            lane_y[k] += g * dy
    energy, fx, fy, torque = 0.0, 0.0, 0.0, 0.0
    for k in range(count):
        px, py = weight[k] * lane_x[k], weight[k] * lane_y[k]
        fx += px
        fy += py
        torque += (ax + node[k] * atx) * py - (ay + node[k] * aty) * px
    if with_energy:
        for m in range(count):
            for k in range(count):
                dx = ex - node[m] * btx + node[k] * atx
                dy = ey - node[m] * bty + node[k] * aty
                energy += (
                    weight[m]
                    * weight[k]
                    * node_energy(magnets.strips, magnets.height2, dx * dx + dy * dy)
                )
    return energy, fx, fy, torque


@kernel
def near_pair(
    magnets: Magnets, charge: Array, pose: Pose, i: int, j: int, with_energy: bool,
    lane_x: Array, lane_y: Array,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Correct the near pole faces of casings i and j: energy [J], force on i [N], torque on i.

    The torque is about the centre of i [N·m]. The energy is complete only ``with_energy``.
    """
    energy, fx, fy, torque = 0.0, 0.0, 0.0, 0.0
    ci, si, cj, sj = pose.cos[i], pose.sin[i], pose.cos[j], pose.sin[j]
    dx, dy = pose.x[j] - pose.x[i], pose.y[j] - pose.y[i]
    outermost = magnets.level_radius[1] * BLEND
    for f in range(8):
        qa = charge[i, f % 4] * (1.0 if f < 4 else -1.0)
        ax = ci * magnets.face_x[f] - si * magnets.face_y[f]
        ay = si * magnets.face_x[f] + ci * magnets.face_y[f]
        for g in range(8):
            bx = dx + cj * magnets.face_x[g] - sj * magnets.face_y[g]
            by = dy + sj * magnets.face_x[g] + cj * magnets.face_y[g]
            ex, ey = ax - bx, ay - by
            distance2 = ex * ex + ey * ey
            if distance2 >= outermost * outermost:
                continue
            q = COULOMB * qa * charge[j, g % 4] * (1.0 if g < 4 else -1.0)
            if q == 0.0:
                continue
            u, px, py, t = refine(
                magnets, math.sqrt(distance2), ax, ay,
                ci * magnets.face_tx[f] - si * magnets.face_ty[f],
                si * magnets.face_tx[f] + ci * magnets.face_ty[f],
                bx, by,
                cj * magnets.face_tx[g] - sj * magnets.face_ty[g],
                sj * magnets.face_tx[g] + cj * magnets.face_ty[g],
                with_energy, lane_x, lane_y,
            )  # fmt: skip
            energy += q * u
            fx += q * px
            fy += q * py
            torque += q * t
    return energy, fx, fy, torque


@kernel
def refine(
    magnets: Magnets, distance: float, ax: float, ay: float, atx: float, aty: float,
    bx: float, by: float, btx: float, bty: float, with_energy: bool, lane_x: Array, lane_y: Array,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Sum of w_k (U_k − U_{k−1}) over the levels, and its gradient, for faces of unit charge."""
    energy, fx, fy, torque = 0.0, 0.0, 0.0, 0.0
    levels = magnets.level_count.size
    blended = with_energy
    for level in range(1, levels):
        radius = magnets.level_radius[level]
        blended = blended or radius < distance < radius * BLEND
    low = level_pair(magnets, 0, ax, ay, atx, aty, bx, by, btx, bty, blended, lane_x, lane_y)
    for level in range(1, levels):
        radius = magnets.level_radius[level]
        weight, slope = step_down(distance / radius)
        if weight == 0.0:
            break
        if level + 1 < levels and distance <= magnets.level_radius[level + 1]:
            continue  # the next level is in full force too: this one cancels
        high = level_pair(
            magnets, level, ax, ay, atx, aty, bx, by, btx, bty, blended, lane_x, lane_y
        )
        gain = high[0] - low[0]
        energy += weight * gain
        fx += weight * (high[1] - low[1])
        fy += weight * (high[2] - low[2])
        torque += weight * (high[3] - low[3])
        if slope != 0.0:
            # −∂w/∂x (U_k − U_{k−1}) acts along the line of the faces' centres.
            push = -slope / radius * gain / distance
            fx += push * (ax - bx)
            fy += push * (ay - by)
            torque += push * (ax * (ay - by) - ay * (ax - bx))
        low = high
    return energy, fx, fy, torque


@kernel
def add_forces(
    lo: int, magnets: Magnets, charge: Array, pose: Pose,
    nodes: Nodes, fx: Array, fy: Array, torque: Array,
) -> None:  # fmt: skip
    """Add the magnets' forces [N] and torques about the centres [N·m] of casings ``lo`` on."""
    n = pose.x.size
    count = magnets.node_x.size
    strips, height2 = magnets.strips, magnets.height2
    spread_nodes(lo, magnets, charge, pose, nodes)
    node_x, node_y, node_q = nodes.x, nodes.y, nodes.q
    lane_x, lane_y = nodes.lane_x, nodes.lane_y
    for i in range(lo, n):
        xi, yi = pose.x[i], pose.y[i]
        for j in range(i + 1, n):
            for a in range(count):
                lane_x[a] = 0.0
                lane_y[a] = 0.0
            for b in range(count):
                x, y, q = node_x[j, b], node_y[j, b], node_q[j, b]
                for a in range(count):
                    dx = node_x[i, a] - x
                    dy = node_y[i, a] - y
                    g = q * node_force(strips, height2, dx * dx + dy * dy)
                    lane_x[a] += g * dx
                    lane_y[a] += g * dy
            px, py, t = 0.0, 0.0, 0.0
            for a in range(count):
                gx = COULOMB * node_q[i, a] * lane_x[a]
                gy = COULOMB * node_q[i, a] * lane_y[a]
                px += gx
                py += gy
                t += (node_x[i, a] - xi) * gy - (node_y[i, a] - yi) * gx
            ex, ey = pose.x[j] - xi, pose.y[j] - yi
            if magnets.level_count.size > 1 and ex * ex + ey * ey < magnets.reach**2:
                _, nx, ny, nt = near_pair(magnets, charge, pose, i, j, False, lane_x, lane_y)
                px += nx
                py += ny
                t += nt
            fx[i] += px
            fy[i] += py
            torque[i] += t
            fx[j] -= px
            fy[j] -= py
            # Both laws act along lines, so the pair's torques balance.
            torque[j] += ex * py - ey * px - t


@kernel
def energy(lo: int, magnets: Magnets, charge: Array, pose: Pose, nodes: Nodes) -> float:
    """Energy of all pairs of casings ``lo`` on [J]; pairs of faces within a casing left out."""
    n = pose.x.size
    count = magnets.node_x.size
    spread_nodes(lo, magnets, charge, pose, nodes)
    node_x, node_y, node_q = nodes.x, nodes.y, nodes.q
    lane_x, lane_y = nodes.lane_x, nodes.lane_y
    total = 0.0
    for i in range(lo, n):
        for j in range(i + 1, n):
            for a in range(count):
                u = 0.0
                for b in range(count):
                    dx = node_x[i, a] - node_x[j, b]
                    dy = node_y[i, a] - node_y[j, b]
                    u += node_q[j, b] * node_energy(
                        magnets.strips, magnets.height2, dx * dx + dy * dy
                    )
                total += COULOMB * node_q[i, a] * u
            ex, ey = pose.x[j] - pose.x[i], pose.y[j] - pose.y[i]
            if magnets.level_count.size > 1 and ex * ex + ey * ey < magnets.reach**2:
                total += near_pair(magnets, charge, pose, i, j, True, lane_x, lane_y)[0]
    return total
