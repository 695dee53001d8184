"""Jacobian rows for joint stops, and for squares that touch other squares or solids.

A contact row describes a corner of one box that touches another box; see `boxes`. Its normal turns
continuously when the corner slides off the end of a face or over another corner.
"""

import math

from magfold_env.engine import indices as ix
from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.contact import boxes
from magfold_env.engine.state import Array, Model, Pose, Work

HALF_PI = math.pi / 2.0
TOUCH = 1e-5  # share of the side within which contacts act


@kernel
def collect_contacts(lo: int, model: Model, work: Work, row: int, near: float) -> int:
    """Append a row [box, other box, corner of the other] for each corner nearer than ``near`` [m].

    Stores the gaps in ``work.rows.gap``. Returns the number of rows, or −1 if there are too many.
    `place_boxes` must have placed all boxes.
    """
    for i in range(boxes.first_box(lo), model.n):
        for j in range(*boxes.partners(model, lo, i)):
            if not boxes.may_touch(model, work, i, j):
                continue
            for c in range(8):
                box, other = (i, j) if c < 4 else (j, i)
                gap = boxes.corner_gap(model, work, box, other, c % 4)
                if gap < near and not boxes.is_beside_face(work, box, other, c % 4):
                    if row >= work.rows.bias.size:
                        return -1
                    work.rows.id[row, 0] = box
                    work.rows.id[row, 1] = other
                    work.rows.id[row, 2] = c % 4
                    work.rows.gap[row] = gap
                    row += 1
    return row


@inlined
def gap_of(model: Model, work: Work, r: int) -> float:
    """Return the gap of contact row r [m]; `place_boxes` must have placed all boxes."""
    return boxes.corner_gap(model, work, work.rows.id[r, 0], work.rows.id[r, 1], work.rows.id[r, 2])


@inlined
def is_row(work: Work, box: int, other: int, corner: int) -> bool:
    """Whether this corner is one of the step's contacts."""
    for r in range(work.rows.counts[ix.JOINT_STOPS], work.rows.counts[ix.CONTACTS]):
        if (
            work.rows.id[r, 0] == box
            and work.rows.id[r, 1] == other
            and work.rows.id[r, 2] == corner
        ):
            return True
    return False


@inlined
def add_point(
    lo: int, model: Model, pose: Pose, row: Array, i: int, px: float, py: float,
    nx: float, ny: float,
) -> None:  # fmt: skip
    """Add to a Jacobian row the velocity along n of the point (px, py) of component i."""
    n = model.n
    # Bodies in the tube move with the base; obstacles (i >= n) do not move.
    if i >= n:
        return
    row[n] += nx
    row[n + 1] += ny
    if i < lo:
        return
    # Component k < i moves the point by ω_k × its own hinge-to-hinge vector.
    for k in range(lo, i):
        row[k] += model.bodies.length[k] * (pose.cos[k] * ny - pose.sin[k] * nx)
    hx = px - (pose.x[i] - model.bodies.reach[i] * pose.cos[i])
    hy = py - (pose.y[i] - model.bodies.reach[i] * pose.sin[i])
    row[i] += hx * ny - hy * nx


@inlined
def motion_of(lo: int, model: Model, work: Work, box: int, v: Array) -> tuple[float, float, float]:
    """Return the velocity of a box's centre [m/s] and the box's angular velocity [rad/s].

    Bodies before ``lo`` move with the base; obstacles do not move.
    """
    if box >= model.n:
        return 0.0, 0.0, 0.0
    if box < lo:
        return v[model.n], v[model.n + 1], 0.0
    return work.centres.vx[box], work.centres.vy[box], v[box]


@inlined
def corner_velocity(
    lo: int, model: Model, work: Work, box: int, other: int, ox: float, oy: float, v: Array
) -> tuple[float, float, float]:
    """Return the velocity of a point of ``other`` [m/s] and ``box``'s angular velocity [rad/s].

    The point is (ox, oy) from ``other``'s centre; its velocity is relative to ``box``'s centre.
    """
    x, y, w = motion_of(lo, model, work, box, v)
    vx, vy, turn = motion_of(lo, model, work, other, v)
    return vx - turn * oy - x, vy + turn * ox - y, w


@kernel
def contact_row(lo: int, model: Model, pose: Pose, work: Work, r: int, v: Array) -> None:
    """Fill in the Jacobian and bias of contact row r.

    The bias is the gap's second derivative at zero accelerations of the coordinates. All boxes
    must be placed, and ``work.centres`` must hold the results of `centripetal` (``ax``, ``ay``).
    """
    n = model.n
    box, other = int(work.rows.id[r, 0]), int(work.rows.id[r, 1])
    k = int(work.rows.id[r, 2])
    ux, uy, distance, round_corner = boxes.corner_offset(work, box, other, k)
    c, s = work.boxes.c[box], work.boxes.s[box]
    nx, ny = c * ux - s * uy, s * ux + c * uy
    ox, oy = boxes.corner(work, other, k)
    px, py = work.boxes.x[other] + ox, work.boxes.y[other] + oy
    row = work.rows.jacobian[r]
    row[:] = 0.0
    add_point(lo, model, pose, row, other, px, py, nx, ny)
    # The same point as part of the box: the gap's rate is that point's rate relative to the box.
    add_point(lo, model, pose, row, box, px, py, -nx, -ny)
    # n·ẍ relative to the box, with x = p − c and ω̇ = 0: n·(p̈ − c̈) + 2 ω n⊥·ẋ − ω² n·x.
    x, y = px - work.boxes.x[box], py - work.boxes.y[box]
    vx, vy, w = corner_velocity(lo, model, work, box, other, ox, oy, v)
    ax, ay = 0.0, 0.0
    if lo <= other < n:
        u = v[other]
        ax = work.centres.ax[other] - u * u * ox
        ay = work.centres.ay[other] - u * u * oy
    if lo <= box < n:
        ax -= work.centres.ax[box]
        ay -= work.centres.ay[box]
    bias = nx * ax + ny * ay + 2.0 * w * (nx * vy - ny * vx) - w * w * (nx * x + ny * y)
    if round_corner:
        # Around a corner the normal turns with the point.
        slip = nx * (vy - w * x) - ny * (vx + w * y)
        bias += slip * slip / distance
    work.rows.bias[r] = bias


@kernel
def stop_row(lo: int, model: Model, work: Work, r: int, joint: int, sign: int) -> None:
    """Fill in row r for joint ``joint`` (between components joint − 1 and joint) at its stop.

    The gap is π/2 − sign·(φ_joint − φ_{joint−1}).
    """
    row = work.rows.jacobian[r]
    row[:] = 0.0
    row[joint] = -sign
    if joint > lo:
        row[joint - 1] = sign
    work.rows.bias[r] = 0.0
    work.rows.id[r, 0] = joint
    work.rows.id[r, 1] = sign
