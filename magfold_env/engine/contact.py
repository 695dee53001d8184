"""Joint stops, and squares against squares and against the tube's walls.

Neighbours meet only at their stops. Components two or three apart cannot overlap while the stops
between them hold (``tests/engine/test_contact.py`` searches for a counterexample), so pairs
start at four apart.

Boxes have rounded corners: a box is a *core* with sharp corners, widened by a radius. The gap of
two boxes is the distance of their cores less both radii, and that distance is always one of a
corner of one core from the other core. A row is such a corner; its normal turns continuously when
the corner slides off the end of a face, or over another corner.

On the lattice of folded shapes many squares touch exactly where joint stops already hold them.
Squares therefore collide only when they overlap by `SHRINK` of their side: contacts that repeat
the stops never act.
"""

from __future__ import annotations

import math

from magfold_env.engine.jit import inlined, kernel
from magfold_env.engine.state import Array, Model, Pose, Work

HALF_PI = math.pi / 2.0
APART = 4
SHRINK = 1e-4
OVERLAP = 1e-3  # share of the side: deeper, and squares overlap
TOUCH = 1e-5  # contacts act within this share of the side
FACE_C = math.sqrt(0.5)  # a square's first face looks 45° to the left of its heading


@kernel
def place_boxes(first: int, model: Model, pose: Pose, work: Work) -> None:
    """Cores of the squares of components ``first`` on, and of the walls as boxes n and n + 1.

    A box has a centre, an axis (c, s) and half sizes along it and across.
    """
    n = model.n
    half = 0.5 * (1.0 - SHRINK) * model.side - model.rounding
    for i in range(first, n):
        work.box_x[i] = pose.x[i]
        work.box_y[i] = pose.y[i]
        work.box_c[i] = FACE_C * (pose.cos[i] - pose.sin[i])
        work.box_s[i] = FACE_C * (pose.sin[i] + pose.cos[i])
        work.box_a[i] = half
        work.box_b[i] = half
    if model.tube:
        length = 2.0 * n * model.bodies.length[0]
        radius = wall_rounding(model)
        for k in range(2):
            sign = 1.0 - 2.0 * k
            work.box_x[n + k] = -0.5 * length
            work.box_y[n + k] = sign * 0.5 * (model.bore + model.wall)
            work.box_c[n + k] = 1.0
            work.box_s[n + k] = 0.0
            work.box_a[n + k] = 0.5 * length - radius
            work.box_b[n + k] = 0.5 * model.wall - radius


@inlined
def wall_rounding(model: Model) -> float:
    """Radius of the wall's edges [m]: as the casings', but never more than the wall allows."""
    return min(model.rounding, 0.25 * model.wall)


@inlined
def clearance(model: Model, box: int, other: int) -> float:
    """Sum of two boxes' radii [m]; at most one of them is a wall."""
    if box < model.n and other < model.n:
        return 2.0 * model.rounding
    return model.rounding + wall_rounding(model)


@inlined
def corner(work: Work, box: int, k: int) -> tuple[float, float]:
    """Corner k of a box's core relative to its centre [m]."""
    a = work.box_a[box] if k in (0, 3) else -work.box_a[box]
    b = work.box_b[box] if k in (0, 1) else -work.box_b[box]
    c, s = work.box_c[box], work.box_s[box]
    return c * a - s * b, s * a + c * b


@inlined
def corner_offset(work: Work, box: int, other: int, k: int) -> tuple[float, float, bool]:
    """Corner k of ``other`` from the nearest point of the core of ``box``, in the box's frame [m].

    And whether that point is a corner. Zero if the corner is inside.
    """
    px, py = corner(work, other, k)
    x = work.box_x[other] + px - work.box_x[box]
    y = work.box_y[other] + py - work.box_y[box]
    c, s = work.box_c[box], work.box_s[box]
    along, across = c * x + s * y, c * y - s * x
    a, b = work.box_a[box], work.box_b[box]
    dx = along - min(max(along, -a), a)
    dy = across - min(max(across, -b), b)
    return dx, dy, dx != 0.0 and dy != 0.0


@inlined
def corner_gap(model: Model, work: Work, box: int, other: int, k: int) -> float:
    """Gap between corner k of ``other`` and ``box`` [m].

    Where two corners face each other it is the same seen from either box, so that one row takes
    over from the other without a jump.
    """
    dx, dy, _ = corner_offset(work, box, other, k)
    return math.sqrt(dx * dx + dy * dy) - clearance(model, box, other)


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
    """Return the box after ``j`` that ``i`` can meet; begin with ``j = i``, end at n + 2.

    Components in the tube, all before ``lo``, meet neither each other nor the walls.
    """
    j = j + 1 if j > i else min(i + APART, model.n)
    if j < model.n:
        return j
    if not model.tube or i < lo:
        return model.n + 2
    return j


@kernel
def collect_contacts(lo: int, model: Model, work: Work, row: int) -> int:
    """Append a row [box, other box, corner of the other] for every touching corner.

    Returns the number of rows, −1 if there is no room for them.
    """
    touch = TOUCH * model.side
    for i in range(max(lo - 1, 0), model.n):
        j = next_partner(model, lo, i, i)
        while j < model.n + 2:
            if may_touch(model, work, i, j):
                for c in range(8):
                    box, other = (i, j) if c < 4 else (j, i)
                    if corner_gap(model, work, box, other, c % 4) < touch:
                        if row >= work.bias.size:
                            return -1
                        work.row_id[row, 0] = box
                        work.row_id[row, 1] = other
                        work.row_id[row, 2] = c % 4
                        row += 1
            j = next_partner(model, lo, i, j)
    return row


@kernel
def overlapping_pair(model: Model, work: Work) -> tuple[int, int]:
    """Return two components that overlap, (−1, −1) if none do. Needs `place_boxes`."""
    for i in range(model.n):
        for j in range(i + APART, model.n):
            dx, dy = work.box_x[i] - work.box_x[j], work.box_y[i] - work.box_y[j]
            if dx * dx + dy * dy < 0.25 * model.side**2:
                return i, j
            if may_touch(model, work, i, j):
                for c in range(8):
                    box, other = (i, j) if c < 4 else (j, i)
                    along, across, _ = corner_offset(work, box, other, c % 4)
                    inside = along == 0.0 and across == 0.0
                    if inside and corner_depth(work, box, other, c % 4) > OVERLAP * model.side:
                        return i, j
    return -1, -1


@inlined
def corner_depth(work: Work, box: int, other: int, k: int) -> float:
    """How deep corner k of the core of ``other`` is inside that of ``box`` [m]."""
    px, py = corner(work, other, k)
    x = work.box_x[other] + px - work.box_x[box]
    y = work.box_y[other] + py - work.box_y[box]
    c, s = work.box_c[box], work.box_s[box]
    return min(work.box_a[box] - abs(c * x + s * y), work.box_b[box] - abs(c * y - s * x))


@inlined
def is_row(work: Work, box: int, other: int, corner: int) -> bool:
    """Whether this corner is one of the step's contacts."""
    for r in range(work.row_count[0], work.row_count[1]):
        if work.row_id[r, 0] == box and work.row_id[r, 1] == other and work.row_id[r, 2] == corner:
            return True
    return False


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


@inlined
def corner_velocity(
    lo: int, model: Model, work: Work, box: int, other: int, ox: float, oy: float, v: Array
) -> tuple[float, float, float]:
    """Velocity [m/s] of the point (ox, oy) from the centre of ``other``, and rate of ``box``.

    The velocity is relative to the centre of ``box``. Bodies before ``lo`` move with the base,
    walls not at all.
    """
    n = model.n
    vx, vy, w = 0.0, 0.0, 0.0
    if other < n:
        vx, vy = v[n], v[n + 1]
        if other >= lo:
            vx = work.vx[other] - v[other] * oy
            vy = work.vy[other] + v[other] * ox
    if box < n:
        if box >= lo:
            w = v[box]
            vx -= work.vx[box]
            vy -= work.vy[box]
        else:
            vx -= v[n]
            vy -= v[n + 1]
    return vx, vy, w


@kernel
def time_to_edge(lo: int, model: Model, work: Work, v: Array) -> float:
    """Time until a corner that slides along a face, or around an edge, is at its end [s].

    There the normal begins or ceases to turn. At the present velocities; infinite if nothing
    slides. Needs `place_boxes` and centre velocities.
    """
    soonest = math.inf
    for r in range(work.row_count[0], work.row_count[1]):
        box, other, k = int(work.row_id[r, 0]), int(work.row_id[r, 1]), int(work.row_id[r, 2])
        ox, oy = corner(work, other, k)
        x = work.box_x[other] + ox - work.box_x[box]
        y = work.box_y[other] + oy - work.box_y[box]
        vx, vy, w = corner_velocity(lo, model, work, box, other, ox, oy, v)
        vx += w * y
        vy -= w * x
        c, s = work.box_c[box], work.box_s[box]
        along, across = c * x + s * y, c * y - s * x
        slide, rise = c * vx + s * vy, c * vy - s * vx
        a, b = work.box_a[box], work.box_b[box]
        beside, above = abs(along) > a, abs(across) > b
        if beside == above or above:
            soonest = min(soonest, time_to_end(along, a, slide))
        if beside == above or beside:
            soonest = min(soonest, time_to_end(across, b, rise))
    return soonest


@inlined
def time_to_end(x: float, end: float, rate: float) -> float:
    """Time until a point at x is at one of the ends −end and end of a face [s]."""
    goal = math.copysign(end, x if abs(x) > end else rate)
    time = (goal - x) / rate if rate != 0.0 else math.inf
    return time if time > 0.0 else math.inf


@kernel
def contact_row(lo: int, model: Model, pose: Pose, work: Work, r: int, v: Array) -> None:
    """Fill Jacobian and bias of contact row r.

    The bias is what of the gap's second derivative is left when all accelerations are zero. Needs
    `place_boxes`, and `centripetal` accelerations in ``work.ax``, ``work.ay``.
    """
    n = model.n
    box, other = int(work.row_id[r, 0]), int(work.row_id[r, 1])
    k = int(work.row_id[r, 2])
    dx, dy, round_corner = corner_offset(work, box, other, k)
    distance = max(math.sqrt(dx * dx + dy * dy), 1e-300)
    c, s = work.box_c[box], work.box_s[box]
    nx = (c * dx - s * dy) / distance
    ny = (s * dx + c * dy) / distance
    ox, oy = corner(work, other, k)
    px, py = work.box_x[other] + ox, work.box_y[other] + oy
    row = work.jacobian[r]
    row[:] = 0.0
    add_point(lo, model, pose, row, other, px, py, nx, ny)
    # The same point taken as part of the box: the gap's rate is the point's, seen from the box.
    add_point(lo, model, pose, row, box, px, py, -nx, -ny)
    # n·ẍ seen from the box, x = p − c, with ω̇ = 0: n·(p̈ − c̈) + 2 ω n⊥·ẋ − ω² n·x.
    x, y = px - work.box_x[box], py - work.box_y[box]
    vx, vy, w = corner_velocity(lo, model, work, box, other, ox, oy, v)
    ax, ay = 0.0, 0.0
    if lo <= other < n:
        u = v[other]
        ax = work.ax[other] - u * u * ox
        ay = work.ay[other] - u * u * oy
    if lo <= box < n:
        ax -= work.ax[box]
        ay -= work.ay[box]
    bias = nx * ax + ny * ay + 2.0 * w * (nx * vy - ny * vx) - w * w * (nx * x + ny * y)
    if round_corner:
        # Around a corner the normal turns with the point.
        slip = nx * (vy - w * x) - ny * (vx + w * y)
        bias += slip * slip / distance
    work.bias[r] = bias


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
