"""Forces, torques and energy of the chain's magnets in an external field.

A uniform field exerts a torque on a component's magnetic moment but no force. A fixed magnet acts
by its pole faces, which are divided into strips no wider than the chain's faces. The interaction of
a strip and a casing is summed over nodes, with more nodes near a pole face, as in `pairs`.
"""

import math

from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.magnets.laws import COULOMB, FacePair, node_force, node_law
from magfold_env.engine.magnets.multipoles import D10
from magfold_env.engine.magnets.pairs import BLEND, add_forces, refine, whole_lanes
from magfold_env.engine.state import Loads, Model, Nodes, Pose

ROOT = math.sqrt(COULOMB)  # a factor in moments


@inlined
def add_field(lo: int, model: Model, pose: Pose, nodes: Nodes, loads: Loads) -> None:
    """Add the field's forces [N] and torques [N·m] on components from ``lo`` on.

    The magnets' nodes must be filled in; any computation of magnet forces or energies does this.
    """
    for i in range(lo, model.n):
        if nodes.faces[i] > 0:
            _, px, py, t = in_field(model, pose, nodes, i, False)
            loads.fx[i] += px
            loads.fy[i] += py
            loads.torque[i] += t


@inlined
def add_magnet_forces(lo: int, model: Model, pose: Pose, nodes: Nodes, loads: Loads) -> None:
    """Add the summed forces between components from ``lo`` on, and the field's forces on them."""
    add_forces(lo, model.magnets, model.charge, pose, nodes, loads)
    if model.field.present:
        add_field(lo, model, pose, nodes, loads)


@kernel
def field_energy(lo: int, model: Model, pose: Pose, nodes: Nodes) -> float:
    """Return the energy in the field [J] of the magnets of components from ``lo`` on."""
    total = 0.0
    for i in range(lo, model.n):
        if nodes.faces[i] > 0:
            total += in_field(model, pose, nodes, i, True)[0]
    return total


@inlined
def in_field(
    model: Model, pose: Pose, nodes: Nodes, i: int, with_energy: bool
) -> tuple[float, float, float, float]:
    """Return the energy [J], force [N] and torque about its centre [N·m] of component i.

    The energy is complete only if ``with_energy`` is true.
    """
    field, moment = model.field, nodes.segments.moment
    mx, my = moment[i, 0, D10] / ROOT, moment[i, 1, D10] / ROOT
    u, fx, fy, t = -(mx * field.x + my * field.y), 0.0, 0.0, mx * field.y - my * field.x
    if field.strip_q.size > 0:
        base = sum_strips(model, pose, nodes, i, with_energy)
        near = refine_strips(model, pose, nodes, i, with_energy)
        u += base[0] + near[0]
        fx += base[1] + near[1]
        fy += base[2] + near[2]
        t += base[3] + near[3]
    return u, fx, fy, t


@kernel
def sum_strips(
    model: Model, pose: Pose, nodes: Nodes, i: int, with_energy: bool
) -> tuple[float, float, float, float]:
    """Return the fixed magnet's part of `in_field`, summed over its strips with level 0's nodes."""
    magnets, field = model.magnets, model.field
    strips = magnets.strips
    rank = magnets.rank_count.size - 1
    count = 2 * magnets.rank_count[rank] * nodes.faces[i]
    lanes = whole_lanes(count)
    x, y, half = nodes.x[rank, i], nodes.y[rank, i], nodes.half[rank, i]
    lane_x, lane_y, lane_u = nodes.lane_x, nodes.lane_y, nodes.lane_u
    for a in range(lanes):
        lane_x[a] = 0.0
        lane_y[a] = 0.0
        lane_u[a] = 0.0
    h, nearest2 = field.strip_half, magnets.nearest2
    for g in range(field.strip_q.size):
        for m in range(magnets.level_count[0]):
            at = magnets.level_node[0, m]
            px = field.strip_x[g] + at * field.strip_tx
            py = field.strip_y[g] + at * field.strip_ty
            q = field.strip_q[g] * magnets.level_weight[0, m]
            for a in range(lanes):
                dx, dy = x[a] - px, y[a] - py
                sum2 = (half[a] + h) * (half[a] + h)
                difference2 = (half[a] - h) * (half[a] - h)
                r2 = max(dx * dx + dy * dy, nearest2)
                if with_energy:
                    force, u = node_law(strips, False, sum2, difference2, r2)
                    lane_u[a] += q * u
                else:
                    force = node_force(strips, sum2, difference2, r2)
                lane_x[a] += q * force * dx
                lane_y[a] += q * force * dy
    energy, fx, fy, torque = 0.0, 0.0, 0.0, 0.0
    for a in range(count):
        q = COULOMB * nodes.q[rank, i, a]
        gx, gy = q * lane_x[a], q * lane_y[a]
        energy += q * lane_u[a]
        fx += gx
        fy += gy
        torque += (x[a] - pose.x[i]) * gy - (y[a] - pose.y[i]) * gx
    return energy, fx, fy, torque


@kernel
def refine_strips(
    model: Model, pose: Pose, nodes: Nodes, i: int, with_energy: bool
) -> tuple[float, float, float, float]:
    """Return the correction of `sum_strips` for strips near component i's pole faces."""
    magnets, field, charge = model.magnets, model.field, model.charge
    energy, fx, fy, torque = 0.0, 0.0, 0.0, 0.0
    if magnets.level_radius.size == 1:
        return energy, fx, fy, torque
    c, s = pose.cos[i], pose.sin[i]
    outermost = magnets.level_radius[1] * BLEND
    reach = magnets.depth + outermost
    for g in range(field.strip_q.size):
        away_x, away_y = pose.x[i] - field.strip_x[g], pose.y[i] - field.strip_y[g]
        if away_x * away_x + away_y * away_y >= reach * reach:
            continue
        for f in range(8):
            ax = c * magnets.face_x[f] - s * magnets.face_y[f]
            ay = s * magnets.face_x[f] + c * magnets.face_y[f]
            ex, ey = away_x + ax, away_y + ay
            q = COULOMB * field.strip_q[g] * charge[i, f % 4] * (1.0 if f < 4 else -1.0)
            if q == 0.0 or ex * ex + ey * ey >= outermost * outermost:
                continue
            # Strips of the north pole come first and face along the magnet's heading.
            outward = -1.0 if field.graded[f] != 0 and 2 * g >= field.strip_q.size else 1.0
            faces = FacePair(
                False, magnets.face_half[f], field.strip_half, ex, ey,
                c * magnets.face_tx[f] - s * magnets.face_ty[f],
                s * magnets.face_tx[f] + c * magnets.face_ty[f],
                outward * field.strip_tx, outward * field.strip_ty,
            )  # fmt: skip
            u, px, py, t = refine(magnets, faces, field.graded[f] != 0, with_energy, nodes)
            energy += q * u
            fx += q * px
            fy += q * py
            torque += q * (t + ax * py - ay * px)
    return energy, fx, fy, torque
