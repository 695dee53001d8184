"""Joint stops, and squares against squares and against the tube's walls.

Neighbours meet only at their stops. Components two or three apart cannot overlap while the stops
between them hold (``tests/engine/test_contact.py`` searches for a counterexample), so pairs
start at four apart. A pair is separated along the normal of one face of either box; the face
with the largest distance to the other box is the reference, and the corners of the other box
within reach of it are the contacts.

On the lattice of folded shapes many squares touch exactly where joint stops already hold them.
Squares therefore collide only when they overlap by `SHRINK` of their side: contacts that repeat
the stops never act, and neither do corners that meet corners there.
"""

from __future__ import annotations

import math

from magfold_env.engine.jit import inlined, kernel
from magfold_env.engine.state import Array, Model, Pose, Work

HALF_PI = math.pi / 2.0
APART = 4
SHRINK = 1e-4
TOUCH = 1e-6  # contacts act within this share of the side
FACE_C = math.sqrt(0.5)  # a square's first face looks 45° to the left of its heading


@kernel
def place_boxes(first: int, model: Model, pose: Pose, work: Work) -> None:
    """Squares of components ``first`` on, and the tube's walls as boxes n and n + 1.

    A box has a centre, an axis (c, s) and half sizes along it and across. Face k of a box looks
    along the axis turned by k right angles: a square's faces are front-left, back-left,
    back-right, front-right.
    """
    n = model.n
    for i in range(first, n):
        work.box_x[i] = pose.x[i]
        work.box_y[i] = pose.y[i]
        work.box_c[i] = FACE_C * (pose.cos[i] - pose.sin[i])
        work.box_s[i] = FACE_C * (pose.sin[i] + pose.cos[i])
        work.box_a[i] = 0.5 * (1.0 - SHRINK) * model.side
        work.box_b[i] = 0.5 * (1.0 - SHRINK) * model.side
    if model.tube:
        length = 2.0 * n * model.bodies.length[0]
        for k in range(2):
            sign = 1.0 - 2.0 * k
            work.box_x[n + k] = -0.5 * length
            work.box_y[n + k] = sign * 0.5 * (model.bore + model.wall)
            work.box_c[n + k] = 1.0
            work.box_s[n + k] = 0.0
            work.box_a[n + k] = 0.5 * length
            work.box_b[n + k] = 0.5 * model.wall


@inlined
def face_normal(work: Work, box: int, face: int) -> tuple[float, float, float]:
    """Outward normal of a face and its distance from the box's centre."""
    c, s = work.box_c[box], work.box_s[box]
    if face == 0:
        return c, s, work.box_a[box]
    if face == 1:
        return -s, c, work.box_b[box]
    if face == 2:
        return -c, -s, work.box_a[box]
    return s, -c, work.box_b[box]


@inlined
def corner(work: Work, box: int, k: int) -> tuple[float, float]:
    """Corner k of a box relative to its centre [m]."""
    a = work.box_a[box] if k in (0, 3) else -work.box_a[box]
    b = work.box_b[box] if k in (0, 1) else -work.box_b[box]
    c, s = work.box_c[box], work.box_s[box]
    return c * a - s * b, s * a + c * b


@inlined
def face_distance(work: Work, box: int, face: int, other: int) -> float:
    """Signed distance of the nearest corner of ``other`` from a face's line [m]."""
    nx, ny, half = face_normal(work, box, face)
    # The support of a box against −n has a closed form.
    along = abs(work.box_c[other] * nx + work.box_s[other] * ny)
    across = abs(work.box_c[other] * ny - work.box_s[other] * nx)
    centre = (work.box_x[other] - work.box_x[box]) * nx + (
        work.box_y[other] - work.box_y[box]
    ) * ny
    return centre - half - along * work.box_a[other] - across * work.box_b[other]


@kernel
def separation(work: Work, i: int, j: int) -> tuple[float, int, int]:
    """Largest face distance of two boxes [m], and the reference box and face that have it.

    Positive exactly when the boxes do not touch.
    """
    best = -1e300
    box, face = i, 0
    for f in range(4):
        d = face_distance(work, i, f, j)
        if d > best:
            best, box, face = d, i, f
    for f in range(4):
        d = face_distance(work, j, f, i)
        if d > best:
            best, box, face = d, j, f
    return best, box, face


@inlined
def may_touch(model: Model, work: Work, i: int, j: int) -> bool:
    """Cheap test that drops pairs too far apart to touch; ``j >= n`` is a wall."""
    reach = model.bodies.length[0] * 1.01
    if j < model.n:
        dx = work.box_x[i] - work.box_x[j]
        dy = work.box_y[i] - work.box_y[j]
        return dx * dx + dy * dy < reach * reach
    return (
        work.box_x[i] < 0.6 * reach
        and abs(work.box_y[i] - work.box_y[j]) < 0.6 * reach + work.box_b[j]
    )


@inlined
def next_partner(model: Model, lo: int, i: int, j: int) -> int:
    """The box after ``j`` that ``i`` can meet; begins after ``j = i`` and ends at n + 2.

    Components in the tube, all before ``lo``, meet neither each other nor the walls.
    """
    j = j + 1 if j > i else i + APART
    if j < model.n:
        return j
    if not model.tube or i < lo:
        return model.n + 2
    return max(j, model.n)


@kernel
def deepest(lo: int, model: Model, work: Work) -> float:
    """Smallest separation of any pair that may touch [m]; a large number if there is none."""
    worst = 1.0
    for i in range(max(lo - 1, 0), model.n):
        j = next_partner(model, lo, i, i)
        while j < model.n + 2:
            if may_touch(model, work, i, j):
                worst = min(worst, separation(work, i, j)[0])
            j = next_partner(model, lo, i, j)
    return worst


@kernel
def collect_contacts(lo: int, model: Model, work: Work, row: int) -> int:
    """Append a row [reference box, face, other box, corner] for every touching corner.

    Returns the number of rows, −1 if there is no room for them.
    """
    touch = TOUCH * model.side
    for i in range(max(lo - 1, 0), model.n):
        j = next_partner(model, lo, i, i)
        while j < model.n + 2:
            if may_touch(model, work, i, j):
                gap, box, face = separation(work, i, j)
                if gap < touch:
                    other = i + j - box
                    nx, ny, half = face_normal(work, box, face)
                    dx = work.box_x[other] - work.box_x[box]
                    dy = work.box_y[other] - work.box_y[box]
                    for k in range(4):
                        px, py = corner(work, other, k)
                        if (dx + px) * nx + (dy + py) * ny - half < touch:
                            if row >= work.bias.size:
                                return -1
                            work.row_id[row, 0] = box
                            work.row_id[row, 1] = face
                            work.row_id[row, 2] = other
                            work.row_id[row, 3] = k
                            row += 1
            j = next_partner(model, lo, i, j)
    return row


@kernel
def contact_gap(work: Work, r: int) -> float:
    """Distance of contact row r's corner from its face [m]."""
    box, face = work.row_id[r, 0], work.row_id[r, 1]
    other, k = work.row_id[r, 2], work.row_id[r, 3]
    nx, ny, half = face_normal(work, box, face)
    px, py = corner(work, other, k)
    dx = work.box_x[other] - work.box_x[box]
    dy = work.box_y[other] - work.box_y[box]
    return (dx + px) * nx + (dy + py) * ny - half


@inlined
def add_point(
    lo: int, model: Model, pose: Pose, row: Array, i: int, px: float, py: float,
    nx: float, ny: float,
) -> None:  # fmt: skip
    """Add to a Jacobian row the velocity along n of the point (px, py) of component i."""
    n = model.n
    # Bodies in the tube move with the base; walls (i >= n) do not move.
    if i >= n:
        return
    row[n] += nx
    row[n + 1] += ny
    if i < lo:
        return
    # Component k < i carries the point by ω_k × its own hinge-to-hinge vector.
    for k in range(lo, i):
        row[k] += model.bodies.length[k] * (pose.cos[k] * ny - pose.sin[k] * nx)
    hx = px - (pose.x[i] - model.bodies.reach[i] * pose.cos[i])
    hy = py - (pose.y[i] - model.bodies.reach[i] * pose.sin[i])
    row[i] += hx * ny - hy * nx


@kernel
def contact_row(
    lo: int, model: Model, pose: Pose, work: Work, r: int, v: Array
) -> None:
    """Fill Jacobian and bias of contact row r.

    The gap is g = n·(p − c) − half with n and c of the reference box and p the other's corner;
    the bias is what of g̈ is left when all accelerations are zero. Needs `place_boxes`, and
    `centripetal` accelerations in ``work.ax``, ``work.ay``.
    """
    n = model.n
    box, face = work.row_id[r, 0], work.row_id[r, 1]
    other, k = work.row_id[r, 2], work.row_id[r, 3]
    nx, ny, _ = face_normal(work, box, face)
    ox, oy = corner(work, other, k)
    px, py = work.box_x[other] + ox, work.box_y[other] + oy
    row = work.jacobian[r]
    row[:] = 0.0
    add_point(lo, model, pose, row, other, px, py, nx, ny)
    # The same point taken as part of the reference box: together the exact rate of g.
    add_point(lo, model, pose, row, box, px, py, -nx, -ny)
    # g̈ = −ω² n·x + 2 ω n⊥·ẋ + n·(p̈ − c̈), x = p − c.
    x, y = px - work.box_x[box], py - work.box_y[box]
    vx, vy, ax, ay = 0.0, 0.0, 0.0, 0.0
    w = 0.0
    if other < n:
        vx, vy = v[n], v[n + 1]
        if other >= lo:
            u = v[other]
            vx = work.vx[other] - u * oy
            vy = work.vy[other] + u * ox
            ax = work.ax[other] - u * u * ox
            ay = work.ay[other] - u * u * oy
    if box < n:
        if box >= lo:
            w = v[box]
            vx -= work.vx[box]
            vy -= work.vy[box]
            ax -= work.ax[box]
            ay -= work.ay[box]
        else:
            vx -= v[n]
            vy -= v[n + 1]
    work.bias[r] = (
        -w * w * (nx * x + ny * y) + 2.0 * w * (nx * vy - ny * vx) + nx * ax + ny * ay
    )


@kernel
def stop_row(lo: int, model: Model, work: Work, r: int, joint: int, sign: int) -> None:
    """Fill row r for joint ``joint`` (between components joint − 1 and joint) at its stop.

    The gap is π/2 − sign·(φ_joint − φ_{joint−1}).
    """
    row = work.jacobian[r]
    row[:] = 0.0
    row[joint] = -sign
    if joint > lo:
        row[joint - 1] = sign
    work.bias[r] = 0.0
    work.row_id[r, 0] = joint
    work.row_id[r, 1] = sign
