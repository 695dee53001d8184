"""Whether squares and joints stay clear of each other between two looks at a motion.

A motion is a polynomial of the coordinates, of degree four, over a time that counts as 1. Seen from
a box, a corner of another one then moves along a curve whose second derivative has a bound, so it
strays from the line between two looks by no more than an eighth of that bound times the square of
their distance. Where one side of a box separates two boxes at both looks by more than that, they
do not meet in between. Intervals that pass no such test are halved, down to where what moves can
no longer sink in by more than may go unseen.
"""

import math

from magfold_env.engine import entries as at
from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.contact import boxes
from magfold_env.engine.elementary import sincos, square
from magfold_env.engine.state import Array, Model, State, Work
from magfold_env.engine.stepping.stages import DENSE, STAGES

HALF_PI = math.pi / 2.0
# What may go unseen between two looks: shares of the side and of a solid's thickness that squares
# sink in, and tolerances that a joint turns beyond its stop.
SUNK, THIN, PAST = 3e-4, 3e-3, 0.5
FLOOR = 0.5  # of that, which something may move by where no test tells that it is clear
CLEAR, GRAZES, UNSURE = range(3)
POWERS = 4
DIAGONAL = math.sqrt(0.5)


@kernel
def follow_step(lo: int, model: Model, step: float, fraction: float, work: Work) -> None:
    """Take the dense output of a ``fraction`` of the step for the motion."""
    path, slopes = work.sweep.path, work.stages.slope_q
    hold_still(lo, path)
    for k in range(lo, model.n + 2):
        scale = step
        for j in range(POWERS):
            total = 0.0
            for s in range(STAGES):
                total += DENSE[s, j] * slopes[s, k]
            scale *= fraction
            path[j, k] = scale * total
    find_bounds(lo, model, work)


@kernel
def follow_line(lo: int, model: Model, begin: Array, end: Array, work: Work) -> None:
    """Take a straight line between two states for the motion."""
    path = work.sweep.path
    hold_still(lo, path)
    for k in range(lo, model.n + 2):
        path[0, k] = end[k] - begin[k]
        for j in range(1, POWERS):
            path[j, k] = 0.0
    find_bounds(lo, model, work)


@inlined
def hold_still(lo: int, path: Array) -> None:
    """Let those components in the tube that others may meet keep their headings."""
    for k in range(boxes.first_box(lo), lo):
        for j in range(POWERS):
            path[j, k] = 0.0


@inlined
def bounds(a: float, b: float, c: float, d: float) -> tuple[float, float]:
    """Bounds of the first and the second derivative of a polynomial with these coefficients."""
    b, c, d = abs(b), abs(c), abs(d)
    return abs(a) + 2.0 * b + 3.0 * c + 4.0 * d, 2.0 * b + 6.0 * c + 12.0 * d


@kernel
def find_bounds(lo: int, model: Model, work: Work) -> None:
    """Bound how far things move and turn in all, and how far their ways bend.

    Of the components' headings and centres, and of the sums of the joints' angles up to each.
    """
    sweep, n, bodies = work.sweep, model.n, model.bodies
    path = sweep.path
    x, bend_x = bounds(path[0, n], path[1, n], path[2, n], path[3, n])
    y, bend_y = bounds(path[0, n + 1], path[1, n + 1], path[2, n + 1], path[3, n + 1])
    way, bend, turns = x + y, bend_x + bend_y, 0.0
    for i in range(lo):
        sweep.turn[i], sweep.twist[i] = 0.0, 0.0
        sweep.way[i], sweep.bend[i] = way, bend
        sweep.turns[i] = 0.0
    for i in range(lo, n):
        a, b, c, d = path[0, i], path[1, i], path[2, i], path[3, i]
        turn, twist = bounds(a, b, c, d)
        turns += relative(path, i, i - 1)[0] if i > lo else turn
        sweep.turns[i] = turns
        swing, curl = turn * bodies.length[i], (twist + turn * turn) * bodies.length[i]
        sweep.turn[i], sweep.twist[i] = turn, twist
        # The centre is half as far from the inner hinge as the outer one.
        sweep.way[i], sweep.bend[i] = way + 0.5 * swing, bend + 0.5 * curl
        way, bend = way + swing, bend + curl


@inlined
def relative(path: Array, i: int, j: int) -> tuple[float, float]:
    """Bounds of the rate at which component i turns for component j, and of its change."""
    return bounds(
        path[0, i] - path[0, j], path[1, i] - path[1, j],
        path[2, i] - path[2, j], path[3, i] - path[3, j],
    )  # fmt: skip


@inlined
def between(model: Model, work: Work, i: int, j: int) -> tuple[float, float]:
    """Bounds of how far component j moves as component i sees it, and of how far its way bends.

    Of any of its points: the components between swing it about their hinges, as they turn for i.
    """
    way, bend, step = 0.0, 0.0, 1 if j > i else -1
    for m in range(i + step, j + step, step):
        turn, twist = relative(work.sweep.path, m, i)
        way, bend = way + turn, bend + twist + turn * turn
    return way * model.bodies.length[0], bend * model.bodies.length[0]


@inlined
def reach(model: Model, work: Work, i: int, j: int, width: float) -> float:
    """Distance of two centres from which components cannot come to touch in a ``width`` [m].

    As `between`, from the sums of how far joints turn: coarser, and found at once.
    """
    turn = work.sweep.turns[j] - work.sweep.turns[i]
    return (1.0 + width * (j - i) * turn) * model.bodies.length[0]


@kernel
def may_meet(model: Model, state: State, work: Work) -> bool:
    """Whether any squares may come to touch; the boxes are placed anywhere on the way."""
    lo, n, sweep = state.counter[at.LO], model.n, work.sweep
    for i in range(boxes.first_box(lo), n):
        j = boxes.next_partner(model, lo, i, i)
        while j < boxes.count(model):
            dx, dy = work.boxes.x[i] - work.boxes.x[j], work.boxes.y[i] - work.boxes.y[j]
            if j < n:
                near = reach(model, work, i, j, 1.0)
                if dx * dx + dy * dy < near * near:
                    return True
            else:
                near = 0.5 * model.bodies.length[0] + sweep.way[i]
                near += boxes.clearance(model, i, j)
                c, s = work.boxes.c[j], work.boxes.s[j]
                along, across = abs(c * dx + s * dy), abs(c * dy - s * dx)
                if along < near + work.boxes.a[j] and across < near + work.boxes.b[j]:
                    return True
            j = boxes.next_partner(model, lo, i, j)
    return False


@inlined
def value(path: Array, k: int, t: float) -> float:
    """By how much coordinate k has changed at a share ``t`` of the motion."""
    return (((path[3, k] * t + path[2, k]) * t + path[1, k]) * t + path[0, k]) * t


@kernel
def coordinates_at(model: Model, state: State, t: float, out: Array, work: Work) -> None:
    """Find the coordinates (n + 2,) at a share ``t`` of the motion."""
    for k in range(model.n + 2):
        moved = value(work.sweep.path, k, t) if k >= state.counter[at.LO] else 0.0
        out[k] = state.q[k] + moved


@kernel
def place_at(model: Model, state: State, work: Work, t: float, slot: int) -> None:
    """Find centres and first axes of all squares that may touch, at a share ``t`` of the motion."""
    lo, n, sweep, bodies = state.counter[at.LO], model.n, work.sweep, model.bodies
    x, y = state.q[n] + value(sweep.path, n, t), state.q[n + 1] + value(sweep.path, n + 1, t)
    hinge_x, hinge_y = x, y
    for i in range(lo, n):
        s, c = sincos(state.q[i] + value(sweep.path, i, t))
        put(work, slot, i, x + bodies.reach[i] * c, y + bodies.reach[i] * s, c, s)
        x += bodies.length[i] * c
        y += bodies.length[i] * s
    for i in range(lo - 1, boxes.first_box(lo) - 1, -1):
        s, c = sincos(state.q[i])
        hinge_x -= bodies.length[i] * c
        hinge_y -= bodies.length[i] * s
        put(work, slot, i, hinge_x + bodies.reach[i] * c, hinge_y + bodies.reach[i] * s, c, s)


@inlined
def put(work: Work, slot: int, i: int, x: float, y: float, c: float, s: float) -> None:
    """Keep where component i is, and the axis of its square."""
    sweep = work.sweep
    sweep.x[slot, i], sweep.y[slot, i] = x, y
    sweep.c[slot, i], sweep.s[slot, i] = DIAGONAL * (c - s), DIAGONAL * (s + c)


@kernel
def joints_clear(
    model: Model, state: State, work: Work, begin: float, end: float, past: float
) -> int:
    """Whether open joints come at most ``past`` their stops [rad] between two looks.

    A polynomial lies between the least and the largest of its Bernstein coefficients.
    """
    lo, path = state.counter[at.LO], work.sweep.path
    most = HALF_PI + past
    width, found = end - begin, CLEAR
    for k in range(max(lo, 1), model.n):
        if state.lock[k] != 0:
            continue
        a, b, c, d = path[0, k], path[1, k], path[2, k], path[3, k]
        if k > lo:
            a, b = a - path[0, k - 1], b - path[1, k - 1]
            c, d = c - path[2, k - 1], d - path[3, k - 1]
        # Taylor's coefficients about the first look, in shares of the interval.
        t = begin
        p0 = state.q[k] - state.q[k - 1] + (((d * t + c) * t + b) * t + a) * t
        p1 = width * (((4.0 * d * t + 3.0 * c) * t + 2.0 * b) * t + a)
        p2 = width * width * ((6.0 * d * t + 3.0 * c) * t + b)
        p3 = width * width * width * (4.0 * d * t + c)
        p4 = width * width * width * width * d
        b1, b2 = p0 + 0.25 * p1, p0 + 0.5 * p1 + p2 / 6.0
        b3, b4 = p0 + 0.75 * p1 + 0.5 * p2 + 0.25 * p3, p0 + p1 + p2 + p3 + p4
        high = max(p0, b1, b2, b3, b4)
        low = min(p0, b1, b2, b3, b4)
        if high <= most and low >= -most:
            continue
        if high - low > FLOOR * past:
            return UNSURE
        found = GRAZES
    return found


@kernel
def squares_clear(
    model: Model, state: State, work: Work, begin: float, end: float, slot: int, last: int
) -> int:
    """Whether squares stay clear of each other and of solids between two looks.

    Their places at the looks are in ``slot`` and ``last``, those at the beginning in slot 0.
    """
    lo, n = state.counter[at.LO], model.n
    width, found = end - begin, CLEAR
    for i in range(boxes.first_box(lo), n):
        j = boxes.next_partner(model, lo, i, i)
        while j < boxes.count(model):
            clear = CLEAR
            if j < n:
                clear = pair_clear(model, work, i, j, width, slot, last)
            else:
                clear = solid_clear(model, work, i, j, width, slot, last)
            if clear == UNSURE:
                return UNSURE
            found = max(found, clear)
            j = boxes.next_partner(model, lo, i, j)
    return found


@kernel
def pair_clear(model: Model, work: Work, i: int, j: int, width: float, slot: int, last: int) -> int:
    """Whether two squares stay clear of each other."""
    sweep = work.sweep
    dx, dy = sweep.x[last, j] - sweep.x[last, i], sweep.y[last, j] - sweep.y[last, i]
    near = reach(model, work, i, j, width)
    if dx * dx + dy * dy >= near * near:
        return CLEAR
    seen_from_i, seen_from_j = between(model, work, i, j), between(model, work, j, i)
    way, bend = width * max(seen_from_i[0], seen_from_j[0]), max(seen_from_i[1], seen_from_j[1])
    sunk = SUNK * model.side
    needed = 2.0 * model.rounding - sunk + 0.125 * bend * width * width
    if apart(model, work, i, j, slot, last) >= needed:
        return CLEAR
    # What lies deeper from the beginning may not sink in farther.
    needed -= max(2.0 * model.rounding - apart(model, work, i, j, 0, 0), 0.0)
    if apart(model, work, i, j, slot, last) >= needed:
        return CLEAR
    return UNSURE if way > FLOOR * sunk else GRAZES


@kernel
def apart(model: Model, work: Work, i: int, j: int, slot: int, last: int) -> float:
    """By how much one side at least separates two squares' cores at both looks [m]."""
    sweep = work.sweep
    half = 0.5 * (1.0 - boxes.SHRINK) * model.side - model.rounding
    least = -math.inf
    for k in range(2):
        box, other = (i, j) if k == 0 else (j, i)
        r, u, v = seen(sweep.x, sweep.y, sweep.c, sweep.s, slot, box, other)
        r2, u2, v2 = seen(sweep.x, sweep.y, sweep.c, sweep.s, last, box, other)
        reach, reach2 = half + half * r, half + half * r2
        least = max(least, min(u - reach, u2 - reach2))
        least = max(least, min(-u - reach, -u2 - reach2))
        least = max(least, min(v - reach, v2 - reach2))
        least = max(least, min(-v - reach, -v2 - reach2))
    return least


@inlined
def seen(
    x: Array, y: Array, c: Array, s: Array, slot: int, box: int, other: int
) -> tuple[float, float, float]:
    """How wide a square with sides of 2 is that another sees, and where its centre is for it."""
    cos = c[slot, box] * c[slot, other] + s[slot, box] * s[slot, other]
    sin = c[slot, box] * s[slot, other] - s[slot, box] * c[slot, other]
    dx, dy = x[slot, other] - x[slot, box], y[slot, other] - y[slot, box]
    along, across = c[slot, box] * dx + s[slot, box] * dy, c[slot, box] * dy - s[slot, box] * dx
    return abs(cos) + abs(sin), along, across


@kernel
def solid_clear(
    model: Model, work: Work, i: int, j: int, width: float, slot: int, last: int
) -> int:
    """Whether a square stays clear of a solid."""
    sweep, solid = work.sweep, model.obstacles[j - model.n]
    radius = 0.5 * model.bodies.length[0]
    way = width * (sweep.way[i] + radius * sweep.turn[i])
    clearance = boxes.clearance(model, i, j)
    near = radius + clearance + way
    u, v = from_solid(solid, sweep.x[last, i], sweep.y[last, i])
    if abs(u) >= near + solid[at.A] or abs(v) >= near + solid[at.B]:
        return CLEAR
    sunk = min(SUNK * model.side, 2.0 * THIN * (solid[at.B] + solid[at.RADIUS]))
    needed = clearance - sunk
    if solid_apart(model, work, i, j, width, slot, last) >= needed:
        return CLEAR
    needed -= max(clearance - solid_apart(model, work, i, j, 0.0, 0, 0), 0.0)
    if solid_apart(model, work, i, j, width, slot, last) >= needed:
        return CLEAR
    return UNSURE if way > FLOOR * sunk else GRAZES


@inlined
def from_solid(solid: Array, x: float, y: float) -> tuple[float, float]:
    """Where a point is for a solid [m], along its longer side and across."""
    dx, dy = x - solid[at.X], y - solid[at.Y]
    return solid[at.C] * dx + solid[at.S] * dy, solid[at.C] * dy - solid[at.S] * dx


@kernel
def solid_apart(
    model: Model, work: Work, i: int, j: int, width: float, slot: int, last: int
) -> float:
    """By how much one side at least separates the cores of a square and a solid all the way [m]."""
    sweep, solid = work.sweep, model.obstacles[j - model.n]
    half = 0.5 * (1.0 - boxes.SHRINK) * model.side - model.rounding
    radius = 0.5 * model.bodies.length[0]
    u, v = from_solid(solid, sweep.x[slot, i], sweep.y[slot, i])
    u2, v2 = from_solid(solid, sweep.x[last, i], sweep.y[last, i])
    c, s, c2, s2 = axes_from_solid(solid, sweep.c, sweep.s, slot, last, i)
    # By the solid's sides, whose distance from the square's corners bends as these do.
    swing = sweep.twist[i] + square(sweep.turn[i])
    bend = 0.125 * width * width * (sweep.bend[i] + radius * swing)
    reach, reach2 = half * (abs(c) + abs(s)), half * (abs(c2) + abs(s2))
    a, b = solid[at.A], solid[at.B]
    least = min(u - reach, u2 - reach2) - a
    least = max(least, min(-u - reach, -u2 - reach2) - a)
    least = max(least, min(v - reach, v2 - reach2) - b)
    least = max(least, min(-v - reach, -v2 - reach2) - b) - bend
    # By the square's sides: of the solid, only the part within reach counts.
    near = radius + boxes.clearance(model, i, j) + 0.125 * width * width * sweep.bend[i]
    left, right = max(-a, min(u, u2) - near), min(a, max(u, u2) + near)
    low, high = max(-b, min(v, v2) - near), min(b, max(v, v2) + near)
    if left > right or low > high:
        return math.inf
    far = 1.5 * (near + max(abs(u2 - u), abs(v2 - v)))
    bend = sweep.bend[i] + 2.0 * sweep.turn[i] * sweep.way[i] + far * swing
    bend *= 0.125 * width * width
    mid_u, mid_v = 0.5 * (left + right), 0.5 * (low + high)
    half_u, half_v = 0.5 * (right - left), 0.5 * (high - low)
    own = -math.inf
    for _ in range(2):
        p, p2 = c * (mid_u - u) + s * (mid_v - v), c2 * (mid_u - u2) + s2 * (mid_v - v2)
        r = half + half_u * abs(c) + half_v * abs(s)
        r2 = half + half_u * abs(c2) + half_v * abs(s2)
        own = max(own, min(p - r, p2 - r2), min(-p - r, -p2 - r2))
        c, s, c2, s2 = -s, c, -s2, c2
    return max(least, own - bend)


@inlined
def axes_from_solid(
    solid: Array, c: Array, s: Array, slot: int, last: int, i: int
) -> tuple[float, float, float, float]:
    """Return the first axis of a square at both looks, as a solid sees it."""
    return (
        solid[at.C] * c[slot, i] + solid[at.S] * s[slot, i],
        solid[at.C] * s[slot, i] - solid[at.S] * c[slot, i],
        solid[at.C] * c[last, i] + solid[at.S] * s[last, i],
        solid[at.C] * s[last, i] - solid[at.S] * c[last, i],
    )
