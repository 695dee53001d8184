"""Squares and obstacles as boxes with rounded corners, and the gaps between them.

A box is a *core* with sharp corners, widened by a radius. The gap between two boxes is the distance
between their cores less both radii; this distance is always that from a corner of one core to the
other.

Neighbours meet only at their stops. Components two or three apart cannot overlap while the stops
between them hold (``tests/engine/contact/test_boxes.py`` searches for a counterexample), so only
components at least four apart are tested. On the lattice of folded shapes many squares touch
exactly where joint stops already hold them. Squares therefore collide only when they overlap by
`SHRINK` of their side, so that contacts that merely repeat the stops never act.
"""

import math

from magfold_env.engine import indices as ix
from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.state import Model, Pose, Work

APART = 4
SHRINK = 1e-4
OVERLAP = 1e-3  # share of the side: squares overlap only if they are deeper
FACE_C = math.sqrt(0.5)  # a square's first face is 45° to the left of its heading


@inlined
def first_box(lo: int) -> int:
    """Return the first component that others may touch.

    The component in the mouth leaves space beside it, so others may touch the one behind it too.
    """
    return max(lo - 2, 0)


@kernel
def place_boxes(first: int, model: Model, pose: Pose, work: Work) -> None:
    """Fill in the cores of the squares from component ``first`` on, then those of the obstacles.

    A box has a centre, an axis (c, s) along its longer side, and half sizes along and across it.
    """
    n = model.n
    half = 0.5 * (1.0 - SHRINK) * model.side - model.rounding
    for i in range(first, n):
        work.boxes.x[i] = pose.x[i]
        work.boxes.y[i] = pose.y[i]
        work.boxes.c[i] = FACE_C * (pose.cos[i] - pose.sin[i])
        work.boxes.s[i] = FACE_C * (pose.sin[i] + pose.cos[i])
        work.boxes.a[i] = half
        work.boxes.b[i] = half
    for k in range(model.obstacles.shape[0]):
        work.boxes.x[n + k] = model.obstacles[k, ix.X]
        work.boxes.y[n + k] = model.obstacles[k, ix.Y]
        work.boxes.c[n + k] = model.obstacles[k, ix.C]
        work.boxes.s[n + k] = model.obstacles[k, ix.S]
        work.boxes.a[n + k] = model.obstacles[k, ix.A]
        work.boxes.b[n + k] = model.obstacles[k, ix.B]


@inlined
def seen_from(c: float, s: float, x: float, y: float) -> tuple[float, float]:
    """Return the parts of the vector (x, y) along and across the axis (c, s) of a box."""
    return c * x + s * y, c * y - s * x


@inlined
def clearance(model: Model, box: int, other: int) -> float:
    """Return the sum of two boxes' radii [m]; at most one of the boxes is an obstacle."""
    last = max(box, other)
    if last < model.n:
        return 2.0 * model.rounding
    return model.rounding + float(model.obstacles[last - model.n, ix.RADIUS])


@inlined
def corner(work: Work, box: int, k: int) -> tuple[float, float]:
    """Return the position of corner k of a box's core relative to its centre [m]."""
    a = work.boxes.a[box] if k in (0, 3) else -work.boxes.a[box]
    b = work.boxes.b[box] if k in (0, 1) else -work.boxes.b[box]
    c, s = work.boxes.c[box], work.boxes.s[box]
    return c * a - s * b, s * a + c * b


@inlined
def corner_offset(work: Work, box: int, other: int, k: int) -> tuple[float, float, float, bool]:
    """Return the direction to corner k of ``other`` from the nearest point on ``box``'s core.

    The direction is in the box's frame. Also returns the distance [m] and whether the nearest point
    is a corner. If corner k is inside the core, the distance is minus that to the nearest side.
    """
    px, py = corner(work, other, k)
    x = work.boxes.x[other] + px - work.boxes.x[box]
    y = work.boxes.y[other] + py - work.boxes.y[box]
    along, across = seen_from(work.boxes.c[box], work.boxes.s[box], x, y)
    a, b = work.boxes.a[box], work.boxes.b[box]
    dx = along - min(max(along, -a), a)
    dy = across - min(max(across, -b), b)
    if dx == 0.0 and dy == 0.0:
        beyond, above = abs(along) - a, abs(across) - b
        if beyond > above:
            return math.copysign(1.0, along), 0.0, beyond, False
        return 0.0, math.copysign(1.0, across), above, False
    distance = math.sqrt(dx * dx + dy * dy)
    return dx / distance, dy / distance, distance, dx != 0.0 and dy != 0.0


@inlined
def corner_gap(model: Model, work: Work, box: int, other: int, k: int) -> float:
    """Return the gap between corner k of ``other`` and ``box`` [m].

    If two corners face each other, the gap is the same seen from either box, so that one box's row
    replaces the other's without a jump.
    """
    return corner_offset(work, box, other, k)[2] - clearance(model, box, other)


@kernel
def is_beside_face(work: Work, box: int, other: int, k: int) -> bool:
    """Whether the corner of ``box`` next to corner k of ``other`` faces a side of ``other``.

    Then that side is nearer, and the two corners do not touch. Their distance shrinks while the
    corner slides along the side towards its end, which would look like an impact.
    """
    ux, uy, _, round_corner = corner_offset(work, box, other, k)
    if not round_corner:
        return False
    facing = int(ux < 0.0) if uy > 0.0 else 3 - int(ux < 0.0)
    return not corner_offset(work, other, box, facing)[3]


@inlined
def behind_face(model: Model, work: Work, wall: int, other: int, k: int) -> float:
    """Return the depth of ``other``'s corner k behind a long face of a wall [m], or −1.

    The face is the one that ``other``'s centre is in front of. A fast corner may have passed
    through a thin wall to its far side, where the gap is meaningless.
    """
    px, py = corner(work, other, k)
    dx, dy = work.boxes.x[other] - work.boxes.x[wall], work.boxes.y[other] - work.boxes.y[wall]
    c, s = work.boxes.c[wall], work.boxes.s[wall]
    x, y = seen_from(c, s, dx, dy)
    along, across = seen_from(c, s, px, py)
    half = work.boxes.b[wall]
    side = 1.0 if y > 0.0 else -1.0
    before, behind = side * y - half, half - side * (y + across)
    if before <= 0.0 or behind <= 0.0:
        return -1.0
    where = x + along * before / (before + behind)
    return behind + clearance(model, wall, other) if abs(where) <= work.boxes.a[wall] else -1.0


@inlined
def is_near(model: Model, work: Work, i: int, j: int, reach: float) -> bool:
    """Whether a centre is less than ``reach`` [m] from another centre or an obstacle's sides."""
    dx, dy = work.boxes.x[i] - work.boxes.x[j], work.boxes.y[i] - work.boxes.y[j]
    if j < model.n:
        return dx * dx + dy * dy < reach * reach
    along, across = seen_from(work.boxes.c[j], work.boxes.s[j], dx, dy)
    return abs(along) < reach + work.boxes.a[j] and abs(across) < reach + work.boxes.b[j]


@inlined
def may_touch(model: Model, work: Work, i: int, j: int) -> bool:
    """Whether two boxes may touch, by a cheap test of distance; ``j >= n`` is an obstacle."""
    reach = model.bodies.length[0] * 1.01
    return is_near(model, work, i, j, reach if j < model.n else 0.6 * reach)


@inlined
def partners(model: Model, lo: int, i: int) -> tuple[int, int]:
    """Return the beginning and end of the range of later boxes that component ``i`` can touch.

    Components in the tube, all before ``lo``, do not touch each other or obstacles.
    """
    obstacles = int(model.obstacles.shape[0]) if i >= lo else 0
    return min(i + APART, model.n), model.n + obstacles


@kernel
def separation(work: Work, i: int, j: int) -> float:
    """Return two cores' largest gap along a side's normal [m]; negative if they overlap."""
    widest = -math.inf
    for k in range(2):
        box, other = (i, j) if k == 0 else (j, i)
        placed = work.boxes
        c, s = placed.c[box], placed.s[box]
        x, y = seen_from(c, s, placed.x[other] - placed.x[box], placed.y[other] - placed.y[box])
        cos, sin = seen_from(c, s, placed.c[other], placed.s[other])
        a, b = placed.a[other], placed.b[other]
        widest = max(widest, abs(x) - placed.a[box] - (a * abs(cos) + b * abs(sin)))
        widest = max(widest, abs(y) - placed.b[box] - (a * abs(sin) + b * abs(cos)))
    return widest


@kernel
def first_overlap(model: Model, work: Work) -> tuple[int, int]:
    """Return the first component that overlaps a later box, and that box; (−1, −1) if none do.

    `place_boxes` must have placed all boxes.
    """
    for i in range(model.n):
        for j in range(*partners(model, 0, i)):
            least = clearance(model, i, j) - OVERLAP * model.side
            if may_touch(model, work, i, j) and separation(work, i, j) < least:
                return i, j
    return -1, -1
