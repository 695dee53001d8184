"""The interaction of casings at least three joints apart, looked up in one table.

The energy of two casings depends on the distance r of their centres and on the direction of each in
the other's frame, and is bilinear in the charges of their faces. A right-angle turn maps a casing's
faces onto each other, so the energies of one face pair, turned, are those of all sixteen pairs. One
table of cubic splines over 1/r and the two directions therefore gives them all, as sixteen stencils
of 4 × 4 × 4 splines at different places. When a pair enters a new cell of the table, the stencils
are summed with the charges and stored; the sum depends only on charges and cell.

A small table cannot resolve faces 1 mm apart, so in the table the energy of poles nearer than a
*softening radius* is its Taylor polynomial about that radius. `stiffen` sums the difference over
the nodes of the few faces that are so near, and corrects these sums for faces that may touch, as
`pairs` does. The energy is twice differentiable, and forces and torques are its exact gradient.
"""

import math

import numpy as np

from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.elementary import direction
from magfold_env.engine.magnets import laws
from magfold_env.engine.magnets.pairs import LANES, grade, sum_lanes, whole_lanes
from magfold_env.engine.state import Array, FarTable, Magnets, Nodes, Pose, Stencils

SPLINES = 4  # that are nonzero between two knots
FACES = 4
PLACES = SPLINES * SPLINES
SIXTH, TWO_THIRDS = 1.0 / 6.0, 2.0 / 3.0
TWO_PI = 2.0 * math.pi

# Rows of `Stencils.column`, which has one column per pair: the second casing's position in the
# first one's frame, and its heading relative to the first; then 1/r, the cell, and for each
# coordinate the values and slopes of the cubic splines there.
X, Y, TURN, INVERSE, RADIAL, TOWARD, BACK, WEIGHT = range(8)
SLOPE = WEIGHT + SPLINES
NEXT = 2 * SPLINES  # offset of the next coordinate's rows
ROWS = WEIGHT + 3 * NEXT


@kernel
def look_up(
    table: FarTable, charge: Array, pose: Pose, turn: float, i: int, j: int, stencils: Stencils
) -> tuple[float, float, float, float]:
    """Return the softened energy [J], and the force [N] and torque [N·m] of casing j on casing i.

    The torque is about i's centre; ``turn`` is j's heading less i's [rad].
    """
    see(pose, turn, i, j, stencils.column, 0)
    locate(table, 1, stencils.column)
    return interpolate(table, charge, pose, i, j, stencils, 0)


@inlined
def see(pose: Pose, turn: float, i: int, j: int, column: Array, p: int) -> None:
    """Store in column p the pose of casing j in the frame of casing i."""
    c, s = pose.cos[i], pose.sin[i]
    dx, dy = pose.x[j] - pose.x[i], pose.y[j] - pose.y[i]
    column[X, p], column[Y, p], column[TURN, p] = c * dx + s * dy, c * dy - s * dx, turn


@kernel
def locate(table: FarTable, count: int, column: Array) -> None:
    """Locate the poses of the first ``count`` columns in the table, vectorised if several."""
    if column.shape[0] != ROWS or column.shape[1] != LANES:
        return  # never reached: tells the compiler the rows' spacing
    spaces, turns = table.energy.shape[0] - 3, table.energy.shape[1] - 3
    nearest, density, whole = 1.0 / table.end, table.density, float(turns)
    for p in range(LANES if count > 1 else 1):
        x, y = column[X, p], column[Y, p]
        inverse = 1.0 / math.sqrt(max(x * x + y * y, laws.NEAREST2))
        there = direction(x, y)
        radial = (inverse - nearest) * density
        toward, back = _knots(there, whole), _knots(there + math.pi - column[TURN, p], whole)
        # Beyond the first and last knots, the outermost polynomials continue.
        a = min(max(np.floor(radial), 0.0), spaces - 1.0)
        b = min(max(np.floor(toward), 0.0), whole - 1.0)
        e = min(max(np.floor(back), 0.0), whole - 1.0)
        column[INVERSE, p] = inverse
        column[RADIAL, p], column[TOWARD, p], column[BACK, p] = a, b, e
        _basis(radial - a, column, WEIGHT, p)
        _basis(toward - b, column, WEIGHT + NEXT, p)
        _basis(back - e, column, WEIGHT + 2 * NEXT, p)


@kernel
def interpolate(
    table: FarTable, charge: Array, pose: Pose, i: int, j: int, stencils: Stencils, p: int
) -> tuple[float, float, float, float]:
    """Like `look_up`, for a pair whose column p is already located."""
    column, value, here = stencils.column, stencils.value, stencils.here
    turns = table.energy.shape[1] - 3
    # If a number is not finite, the first cell is used.
    a, b, e = max(int(column[RADIAL, p]), 0), int(column[TOWARD, p]), int(column[BACK, p])
    pair, cell = i * pose.x.size + j, (a * turns + b) * turns + e
    slot = pair % stencils.pair.size
    if stencils.pair[slot] != pair or stencils.cell[slot] != cell:
        stencils.pair[slot], stencils.cell[slot] = pair, cell
        _fold(table.energy, charge, i, j, a, b, e, slot, stencils)
    if value.shape[1] != SPLINES or value.shape[2] != PLACES or here.shape[1] != PLACES:
        return 0.0, 0.0, 0.0, 0.0
    row = WEIGHT + 2 * NEXT
    w0, w1, w2, w3 = column[row, p], column[row + 1, p], column[row + 2, p], column[row + 3, p]
    row = SLOPE + 2 * NEXT
    d0, d1, d2, d3 = column[row, p], column[row + 1, p], column[row + 2, p], column[row + 3, p]
    for k in range(PLACES):
        v0, v1, v2, v3 = value[slot, 0, k], value[slot, 1, k], value[slot, 2, k], value[slot, 3, k]
        here[0, k] = (w0 * v0 + w1 * v1) + (w2 * v2 + w3 * v3)
        here[1, k] = (d0 * v0 + d1 * v1) + (d2 * v2 + d3 * v3)
    energy, by_radial, by_toward, by_back = 0.0, 0.0, 0.0, 0.0
    for k in range(SPLINES):
        u, v, w = 0.0, 0.0, 0.0
        for m in range(SPLINES):
            u += column[WEIGHT + NEXT + m, p] * here[0, SPLINES * k + m]
            v += column[SLOPE + NEXT + m, p] * here[0, SPLINES * k + m]
            w += column[WEIGHT + NEXT + m, p] * here[1, SPLINES * k + m]
        energy += column[WEIGHT + k, p] * u
        by_radial += column[SLOPE + k, p] * u
        by_toward += column[WEIGHT + k, p] * v
        by_back += column[WEIGHT + k, p] * w
    # The energy's slopes along and across r; the force on i is the gradient at j's position.
    inverse, x, y = column[INVERSE, p], column[X, p], column[Y, p]
    along = -by_radial * inverse * inverse * table.density * inverse
    torque = by_toward * turns / TWO_PI
    across = (torque + by_back * turns / TWO_PI) * inverse * inverse
    px, py = along * x - across * y, along * y + across * x
    c, s = pose.cos[i], pose.sin[i]
    return energy, c * px - s * py, s * px + c * py, torque


@inlined
def _knots(angle: float, turns: float) -> float:
    """Convert an angle to units of knots, reduced to the range from 0 to ``turns``."""
    knots = angle * (turns / TWO_PI)
    return knots - turns * np.floor(knots / turns)


@inlined
def _basis(t: float, column: Array, row: int, p: int) -> None:
    """Fill eight rows with four cubic splines at ``t`` between two knots, and their slopes."""
    s = 1.0 - t
    t2, s2 = t * t, s * s
    column[row, p] = SIXTH * (s2 * s)
    column[row + 1, p] = TWO_THIRDS + t2 * (0.5 * t - 1.0)
    column[row + 2, p] = TWO_THIRDS + s2 * (0.5 * s - 1.0)
    column[row + 3, p] = SIXTH * (t2 * t)
    column[row + 4, p] = -0.5 * s2
    column[row + 5, p] = t * (1.5 * t - 2.0)
    column[row + 6, p] = s * (2.0 - 1.5 * s)
    column[row + 7, p] = 0.5 * t2


@kernel
def _fold(
    energy: Array, charge: Array, i: int, j: int, a: int, b: int, e: int,
    slot: int, stencils: Stencils,
) -> None:  # fmt: skip
    """Sum the stencils of all pairs of faces, weighted with their charges.

    Relative to the f-th face, everything else is turned back by f right angles. Directions from the
    second casing that are right angles apart are side by side in the table, so that its four faces
    are summed together.
    """
    value, product, here, column = stencils.value, stencils.product, stencils.sum, stencils.begin
    turns = energy.shape[1] - 3
    quarter = turns // FACES
    first = FACES * (e % quarter)
    for f in range(FACES):
        column[f] = (b + (FACES - f) * quarter) % turns
        for k in range(PLACES):
            product[f, k] = charge[i, f] * charge[j, (e // quarter - k + PLACES) % FACES]
    for k in range(SPLINES):
        row = a + k
        for m in range(SPLINES):
            c0, c1, c2, c3 = column[0] + m, column[1] + m, column[2] + m, column[3] + m
            for p in range(PLACES):
                q = first + p
                u, v = product[0, p] * energy[row, c0, q], product[1, p] * energy[row, c1, q]
                w, z = product[2, p] * energy[row, c2, q], product[3, p] * energy[row, c3, q]
                here[p] = (u + v) + (w + z)
            place = SPLINES * k + m
            value[slot, 0, place] = (here[0] + here[1]) + (here[2] + here[3])
            value[slot, 1, place] = (here[4] + here[5]) + (here[6] + here[7])
            value[slot, 2, place] = (here[8] + here[9]) + (here[10] + here[11])
            value[slot, 3, place] = (here[12] + here[13]) + (here[14] + here[15])


@kernel
def stiffen(
    magnets: Magnets, charge: Array, pose: Pose, nodes: Nodes, i: int, j: int, with_energy: bool
) -> tuple[float, float, float, float]:
    """Return the correction of the table's softening, in the form of `look_up`.

    The energy is 0 unless ``with_energy`` is true.
    """
    face_x, face_y, face_tx, face_ty = (
        magnets.face_x,
        magnets.face_y,
        magnets.face_tx,
        magnets.face_ty,
    )
    soft, width = (
        magnets.tables.far.soft,
        math.sqrt(face_tx[0] * face_tx[0] + face_ty[0] * face_ty[0]),
    )
    energy, fx, fy, torque = 0.0, 0.0, 0.0, 0.0
    # The relative pose in the frame of i.
    ci, si, cj, sj = pose.cos[i], pose.sin[i], pose.cos[j], pose.sin[j]
    ex, ey = pose.x[j] - pose.x[i], pose.y[j] - pose.y[i]
    dx, dy = ci * ex + si * ey, ci * ey - si * ex
    c, s = ci * cj + si * sj, ci * sj - si * cj
    most, last = soft + width, magnets.level_radius.size - 1
    farthest = (1.0 + 1e-9) * (most + magnets.depth)
    for g in range(2 * FACES):
        bx = dx + c * face_x[g] - s * face_y[g]
        by = dy + s * face_x[g] + c * face_y[g]
        if bx * bx + by * by >= farthest * farthest:
            continue  # no face of i is near
        btx, bty = c * face_tx[g] - s * face_ty[g], s * face_tx[g] + c * face_ty[g]
        for f in range(2 * FACES):
            x, y = face_x[f] - bx, face_y[f] - by
            if x * x + y * y >= most * most:
                continue
            q = laws.COULOMB * charge[i, f % FACES] * charge[j, g % FACES]
            if q == 0.0:
                continue
            q = q if (f < FACES) == (g < FACES) else -q
            # Distance of each face from the other's line, times the width.
            atx, aty = face_tx[f], face_ty[f]
            half = 0.5 * abs(btx * aty - bty * atx)
            from_a, from_b = abs(x * aty - y * atx) - half, abs(x * bty - y * btx) - half
            u, px, py, t = 0.0, 0.0, 0.0, 0.0
            if max(from_a, from_b) < soft * width:
                u, px, py, t = _stiff_faces(
                    magnets, x, y, (atx, aty), (btx, bty), with_energy, nodes
                )
            if magnets.graded[f, g] != 0:
                tall = magnets.face_half[f]
                faces = laws.FacePair(True, tall, tall, x, y, atx, aty, btx, bty)
                v, gx, gy, gt = grade(magnets, last, faces, with_energy, nodes)
                u, px, py, t = u + v, px + gx, py + gy, t + gt
            energy += q * u
            fx += q * px
            fy += q * py
            torque += q * (t + face_x[f] * py - face_y[f] * px)
    return energy, ci * fx - si * fy, si * fx + ci * fy, torque


@kernel
def _stiff_faces(
    magnets: Magnets, x: float, y: float, a: tuple[float, float], b: tuple[float, float],
    with_energy: bool, scratch: Nodes,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Return the correction for unit faces along ``a`` and ``b``; (x, y) points from b to a."""
    table, level = magnets.tables.far, magnets.level_radius.size - 1
    count, sum2, nearest2 = magnets.level_count[level], magnets.height2, magnets.nearest2
    offset, share = magnets.level_node, magnets.level_weight
    lane_x, lane_y, lane_u = scratch.lane_x, scratch.lane_y, scratch.lane_u
    p0, p1, p2, p3 = table.soften[0], table.soften[1], table.soften[2], table.soften[3]
    soft2 = table.soft * table.soft
    lanes = whole_lanes(count)
    for k in range(lanes):
        lane_x[k] = 0.0
        lane_y[k] = 0.0
        lane_u[k] = 0.0
    width2 = a[0] * a[0] + a[1] * a[1]
    for m in range(count):
        x0, y0 = x - offset[level, m] * b[0], y - offset[level, m] * b[1]
        # The node's distance from the other face's line.
        off = x0 * a[1] - y0 * a[0]
        if off * off >= soft2 * width2:
            continue
        w = share[level, m]
        for k in range(lanes):
            dx, dy = x0 + offset[level, k] * a[0], y0 + offset[level, k] * a[1]
            r2 = max(dx * dx + dy * dy, nearest2)
            # Outside the radius there is no difference.
            rest = min(r2 - soft2, 0.0)
            inside = w if rest < 0.0 else 0.0
            g = laws.node_force(True, sum2, 0.0, r2)
            g += 2.0 * (p1 + rest * (2.0 * p2 + rest * 3.0 * p3))
            lane_x[k] += inside * g * dx
            lane_y[k] += inside * g * dy
        if with_energy:
            for k in range(lanes):
                dx, dy = x0 + offset[level, k] * a[0], y0 + offset[level, k] * a[1]
                r2 = max(dx * dx + dy * dy, nearest2)
                rest = min(r2 - soft2, 0.0)
                inside = w if rest < 0.0 else 0.0
                _, u = laws.node_law(True, True, sum2, 0.0, r2)
                lane_u[k] += inside * (u - (p0 + rest * (p1 + rest * (p2 + rest * p3))))
    return sum_lanes(share[level], offset[level], count, a, lane_x, lane_y, lane_u)
