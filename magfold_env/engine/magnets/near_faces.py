"""Corrections to a pair of casings for their pole faces that are near each other.

See ``engine.magnets`` for how they enter the pair's energy.
"""

from __future__ import annotations

import math

from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.magnets.laws import COULOMB, node_force, node_law, step_down
from magfold_env.engine.state import Array, IntArray, Magnets, Nodes, Pose

BLEND = 1.1  # a level ends at this many radii
LANES = 8  # doubles in a vector register


@inlined
def near_pair(
    magnets: Magnets, charge: Array, pose: Pose, i: int, j: int, with_energy: bool, nodes: Nodes
) -> tuple[float, float, float, float]:
    """Correct the near pole faces of casings i and j: energy [J], force on i [N], torque on i.

    The torque is about the centre of i [N·m]. The energy is complete only ``with_energy``.
    """
    return near_faces(
        magnets.strips, magnets.even, charge, pose.cos, pose.sin, pose.x, pose.y,
        i, j, with_energy, magnets.face_x, magnets.face_y,
        magnets.face_tx, magnets.face_ty, magnets.face_half,
        magnets.level_count, magnets.level_radius, magnets.level_node, magnets.level_weight,
        nodes.lane_x, nodes.lane_y, nodes.lane_u,
    )  # fmt: skip


@kernel
def near_faces(
    strips: bool, even: bool, charge: Array, cos: Array, sin: Array, x: Array, y: Array,
    i: int, j: int, with_energy: bool, face_x: Array, face_y: Array,
    face_tx: Array, face_ty: Array, face_half: Array,
    level_count: IntArray, level_radius: Array, level_node: Array, level_weight: Array,
    lane_x: Array, lane_y: Array, lane_u: Array,
) -> tuple[float, float, float, float]:  # fmt: skip
    """As `near_pair`, with the arrays one by one."""
    energy, fx, fy, torque = 0.0, 0.0, 0.0, 0.0
    ci, si, cj, sj = cos[i], sin[i], cos[j], sin[j]
    dx, dy = x[j] - x[i], y[j] - y[i]
    outermost = level_radius[1] * BLEND
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
            q = COULOMB * qa * charge[j, g % 4] * (1.0 if g < 4 else -1.0)
            if q == 0.0:
                continue
            u, px, py, t = refine(
                strips, even, face_half[f], face_half[g],
                level_count, level_radius, level_node, level_weight, ex, ey,
                ci * face_tx[f] - si * face_ty[f],
                si * face_tx[f] + ci * face_ty[f],
                cj * face_tx[g] - sj * face_ty[g],
                sj * face_tx[g] + cj * face_ty[g],
                with_energy, lane_x, lane_y, lane_u,
            )  # fmt: skip
            energy += q * u
            fx += q * px
            fy += q * py
            torque += q * (t + ax * py - ay * px)
    return energy, fx, fy, torque


@inlined
def refine(
    strips: bool, even: bool, half_a: float, half_b: float,
    level_count: IntArray, level_radius: Array, level_node: Array, level_weight: Array,
    ex: float, ey: float, atx: float, aty: float, btx: float, bty: float, with_energy: bool,
    lane_x: Array, lane_y: Array, lane_u: Array,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Sum of w_k (U_k − U_{k−1}) over the levels and its gradient, as `level_sum` gives them."""
    distance = math.sqrt(ex * ex + ey * ey)
    levels = level_count.size
    last = 1
    blended = with_energy
    for level in range(1, levels):
        radius = level_radius[level]
        if distance < radius * BLEND:
            last = level
            blended = blended or distance > radius
    energy, fx, fy, torque = 0.0, 0.0, 0.0, 0.0
    low, lx, ly, lt = 0.0, 0.0, 0.0, 0.0
    for level in range(last + 1):
        radius = level_radius[level]
        if 0 < level < last and distance <= level_radius[level + 1]:
            continue  # the next level is in full force too: this one cancels
        u, px, py, t = level_sum(
            strips, even, half_a, half_b, level_count[level], level,
            level_node, level_weight, ex, ey, atx, aty, btx, bty,
            blended, lane_x, lane_y, lane_u,
        )  # fmt: skip
        if level > 0:
            weight, slope = step_down(distance / radius, BLEND)
            # −∂w/∂x (U_k − U_{k−1}) acts along the line of the faces' centres.
            push = -slope / radius * (u - low) / distance
            energy += weight * (u - low)
            fx += weight * (px - lx) + push * ex
            fy += weight * (py - ly) + push * ey
            torque += weight * (t - lt)
        low, lx, ly, lt = u, px, py, t
    return energy, fx, fy, torque


@kernel
def level_sum(
    strips: bool, even: bool, half_a: float, half_b: float, count: int, level: int,
    nodes: Array, weights: Array,
    ex: float, ey: float, atx: float, aty: float, btx: float, bty: float,
    with_energy: bool, lane_x: Array, lane_y: Array, lane_u: Array,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Energy, force on face a and its torque about its centre, for faces of unit charge.

    Face a's centre is (ex, ey) [m] from face b's; vectors as long as the faces are wide lie along
    them. Faces stand half their heights above the plane and below it. Without µ0/4π. The energy is
    0 unless asked for.
    """
    sum2 = (half_a + half_b) * (half_a + half_b)
    difference2 = (half_a - half_b) * (half_a - half_b)
    # The lanes are face a's nodes, padded with weightless ones to the width of a vector.
    lanes = (count + LANES - 1) // LANES * LANES
    for k in range(lanes):
        lane_x[k] = 0.0
        lane_y[k] = 0.0
        lane_u[k] = 0.0
    for m in range(count):
        fx0, fy0 = ex - nodes[level, m] * btx, ey - nodes[level, m] * bty
        w = weights[level, m]
        if with_energy:
            for k in range(lanes):
                dx = fx0 + nodes[level, k] * atx
                dy = fy0 + nodes[level, k] * aty
                g, u = node_law(strips, even, sum2, difference2, dx * dx + dy * dy)
                lane_x[k] += w * g * dx
                lane_y[k] += w * g * dy
                lane_u[k] += w * u
        else:
            for k in range(lanes):
                dx = fx0 + nodes[level, k] * atx
                dy = fy0 + nodes[level, k] * aty
                g = w * node_force(strips, sum2, difference2, dx * dx + dy * dy)
                lane_x[k] += g * dx
                lane_y[k] += g * dy
    energy, fx, fy, torque = 0.0, 0.0, 0.0, 0.0
    for k in range(count):
        w = weights[level, k]
        px, py = w * lane_x[k], w * lane_y[k]
        energy += w * lane_u[k]
        fx += px
        fy += py
        torque += nodes[level, k] * (atx * py - aty * px)
    return energy, fx, fy, torque


@kernel
def level_pair(
    magnets: Magnets, level: int, f: int, g: int, ax: float, ay: float, atx: float, aty: float,
    bx: float, by: float, btx: float, bty: float, with_energy: bool, nodes: Nodes,
) -> tuple[float, float, float, float]:  # fmt: skip
    """As `level_sum` for faces f and g by centre and vector, torque about the origin."""
    u, fx, fy, t = level_sum(
        magnets.strips, magnets.even, magnets.face_half[f], magnets.face_half[g],
        magnets.level_count[level], level, magnets.level_node, magnets.level_weight,
        ax - bx, ay - by, atx, aty, btx, bty, with_energy, nodes.lane_x, nodes.lane_y, nodes.lane_u,
    )  # fmt: skip
    return u, fx, fy, t + ax * fy - ay * fx
