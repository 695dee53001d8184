"""When a corner that slides along a face, or around an edge, comes to its end."""

from __future__ import annotations

import math

from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.contact.boxes import corner
from magfold_env.engine.contact.jacobian import corner_velocity
from magfold_env.engine.state import Array, Model, Work


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
