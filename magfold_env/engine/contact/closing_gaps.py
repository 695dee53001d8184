"""The gaps that may close within one of Moreau's steps, and how fast each may."""

from __future__ import annotations

import math

from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.contact import boxes, jacobian
from magfold_env.engine.contact.constraints import first_joint
from magfold_env.engine.state import Array, Model, Work

PUSH_OUT = 0.2  # share of an overlap that one step takes back
GENTLE = 30.0  # tolerances of a typical rate: overlaps are taken back no faster, since that heats
REACH = 1.0  # how much faster than the trial velocity a joint may turn after the projection


@inlined
def allowance(model: Model, gap: float, time: float, size: float) -> float:
    """Return the closing velocity that a gap allows; overlaps are taken back gently.

    ``size`` is that of what closes it: the side of a square [m], 1 for an angle.
    """
    if gap >= 0.0:
        return gap / time
    return max(PUSH_OUT * gap / time, -GENTLE * model.tolerance * model.rate_scale * size)


@kernel
def collect_within(lo: int, model: Model, q: Array, work: Work, v: Array, h: float) -> int:
    """Rows of all gaps that could close within the step, their allowances in ``work.bias``.

    Returns their number, −1 if there is no room.
    """
    row = 0
    for k in range(first_joint(lo), model.n):
        angle = q[k] - q[k - 1]
        rate = v[k] - (v[k - 1] if k > lo else 0.0)
        for sign in (-1, 1):
            gap = jacobian.HALF_PI - sign * angle
            if gap - sign * rate * h < REACH * abs(rate) * h + 1e-6:
                jacobian.stop_row(lo, model, work, row, k, sign)
                work.bias[row] = allowance(model, gap, h, 1.0)
                row += 1
    work.row_count[0] = row
    boxes.place_boxes(boxes.first_box(lo), model, work.pose, work)
    fastest = 0.0
    for i in range(lo, model.n):
        fastest = max(fastest, math.sqrt(work.vx[i] ** 2 + work.vy[i] ** 2))
        fastest = max(fastest, abs(v[i]) * model.side)
    near = 4.0 * fastest * h + jacobian.TOUCH * model.side
    for i in range(boxes.first_box(lo), model.n):
        j = boxes.next_partner(model, lo, i, i)
        while j < model.n + boxes.OBSTACLES:
            if boxes.may_touch(model, work, i, j):
                for c in range(8):
                    box, other = (i, j) if c < 4 else (j, i)
                    gap = boxes.corner_gap(model, work, box, other, c % 4)
                    if gap < near:
                        if row >= work.bias.size:
                            return -1
                        work.row_id[row, 0] = box
                        work.row_id[row, 1] = other
                        work.row_id[row, 2] = c % 4
                        jacobian.contact_row(lo, model, work.pose, work, row, v)
                        work.bias[row] = allowance(model, gap, h, model.side)
                        row += 1
            j = boxes.next_partner(model, lo, i, j)
    return row
