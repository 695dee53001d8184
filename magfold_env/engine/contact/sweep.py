"""Check whether squares and joint stops stay clear between two samples of a motion.

A motion is a polynomial of degree four in each coordinate, over a time of 1. Relative to a box, a
corner of another one moves along a curve with bounded second derivative, so it departs from the
chord between two samples by at most an eighth of the bound times the squared interval. If a side of
one box separates two boxes at both samples by more than that, they do not touch in between.
Intervals that pass no such test are halved until nothing can overlap in them by more than the
permitted amount.
"""

import math

from magfold_env.engine import indices as ix
from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.contact import boxes
from magfold_env.engine.contact.boxes import seen_from
from magfold_env.engine.contact.jacobian import HALF_PI
from magfold_env.engine.elementary import sincos, square
from magfold_env.engine.state import Array, Model, State, Work
from magfold_env.engine.stepping.stages import DENSE, STAGES

# Overlaps permitted between two samples: for squares, shares of the side and of a solid's
# thickness; for a joint beyond its stop, in tolerances.
SUNK, THIN, PAST = 3e-4, 3e-3, 0.5
FLOOR = 0.5  # share of these: smaller motions are not followed if no test shows that they are clear
CLEAR, GRAZES, UNSURE = range(3)
POWERS = 4


@kernel
def follow_step(lo: int, model: Model, step: float, fraction: float, work: Work) -> None:
    """Use the dense output of a ``fraction`` of the step as the motion."""
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
    find_bounds(model, work)


@kernel
def follow_line(lo: int, model: Model, begin: Array, end: Array, work: Work) -> None:
    """Use a straight line between two states as the motion."""
    path = work.sweep.path
    hold_still(model.n + 2, path)
    for k in range(lo, model.n + 2):
        path[0, k] = end[k] - begin[k]
    find_bounds(model, work)


@inlined
def hold_still(end: int, path: Array) -> None:
    """Keep the coordinates before ``end`` constant."""
    for k in range(end):
        for j in range(POWERS):
            path[j, k] = 0.0


@inlined
def bounds(a: float, b: float, c: float, d: float) -> tuple[float, float]:
    """Return bounds on a polynomial's first and second derivatives, from its coefficients."""
    b, c, d = abs(b), abs(c), abs(d)
    return abs(a) + 2.0 * b + 3.0 * c + 4.0 * d, 2.0 * b + 6.0 * c + 12.0 * d


@kernel
def find_bounds(model: Model, work: Work) -> None:
    """Bound the components' speeds, rates and accelerations during the motion.

    The bounds cover headings, centres, and the sums of joint rates up to each component.
    """
    sweep, n, bodies = work.sweep, model.n, model.bodies
    path = sweep.path
    x, bend_x = bounds(path[0, n], path[1, n], path[2, n], path[3, n])
    y, bend_y = bounds(path[0, n + 1], path[1, n + 1], path[2, n + 1], path[3, n + 1])
    way, bend, turns = x + y, bend_x + bend_y, 0.0
    for i in range(n):
        turn, twist = bounds(path[0, i], path[1, i], path[2, i], path[3, i])
        turns += relative(path, i, i - 1)[0] if i > 0 else turn
        sweep.turns[i] = turns
        swing, curl = turn * bodies.length[i], (twist + turn * turn) * bodies.length[i]
        sweep.turn[i], sweep.twist[i] = turn, twist
        # The centre is midway between the hinges.
        sweep.way[i], sweep.bend[i] = way + 0.5 * swing, bend + 0.5 * curl
        way, bend = way + swing, bend + curl


@inlined
def relative(path: Array, i: int, j: int) -> tuple[float, float]:
    """Return bounds on component i's rate relative to component j, and on the rate's derivative."""
    return bounds(
        path[0, i] - path[0, j], path[1, i] - path[1, j],
        path[2, i] - path[2, j], path[3, i] - path[3, j],
    )  # fmt: skip


@inlined
def between(model: Model, work: Work, i: int, j: int) -> tuple[float, float]:
    """Return bounds on component j's speed in component i's frame, and on its acceleration.

    The bounds hold for all points of j, which turns about the hinges of all components up to it.
    """
    way, bend, step = 0.0, 0.0, 1 if j > i else -1
    for m in range(i + step, j + step, step):
        turn, twist = relative(work.sweep.path, m, i)
        way, bend = way + turn, bend + twist + turn * turn
    return way * model.bodies.length[0], bend * model.bodies.length[0]


@inlined
def reach(model: Model, work: Work, i: int, j: int, width: float) -> float:
    """Return the distance of centres [m] beyond which components cannot touch in a time ``width``.

    The bound is coarser than that of `between`, but sums of joint rates make it much cheaper.
    """
    turn = work.sweep.turns[j] - work.sweep.turns[i]
    return (1.0 + width * (j - i) * turn) * model.bodies.length[0]


@kernel
def may_meet(model: Model, state: State, work: Work) -> bool:
    """Whether any squares may touch in the motion; boxes may be placed at any time in it."""
    lo = state.counter[ix.N_HELD]
    for i in range(boxes.first_box(lo), model.n):
        for j in range(*boxes.partners(model, lo, i)):
            if j < model.n:
                near = reach(model, work, i, j, 1.0)
            else:
                near = 0.5 * model.bodies.length[0] + work.sweep.way[i]
                near += boxes.clearance(model, i, j)
            if boxes.is_near(model, work, i, j, near):
                return True
    return False


@inlined
def value(path: Array, k: int, t: float) -> float:
    """Return the change of coordinate k up to the time ``t`` of the motion."""
    return (((path[3, k] * t + path[2, k]) * t + path[1, k]) * t + path[0, k]) * t


@kernel
def coordinates_at(model: Model, state: State, t: float, out: Array, work: Work) -> None:
    """Fill ``out`` (n + 2,) with the coordinates at the time ``t`` of the motion."""
    for k in range(model.n + 2):
        out[k] = state.q[k] + value(work.sweep.path, k, t)


@kernel
def place_at(model: Model, state: State, work: Work, t: float, slot: int) -> None:
    """Store in ``slot`` the centres and first axes at time ``t`` of squares that may touch."""
    lo, n, sweep, bodies = state.counter[ix.N_HELD], model.n, work.sweep, model.bodies
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
    """Store in ``slot`` the centre of component i and the first axis of its square."""
    sweep = work.sweep
    sweep.x[slot, i], sweep.y[slot, i] = x, y
    sweep.c[slot, i], sweep.s[slot, i] = boxes.FACE_C * (c - s), boxes.FACE_C * (s + c)


@kernel
def joints_clear(
    model: Model, state: State, work: Work, begin: float, end: float, past: float
) -> int:
    """Whether open joints stay within ``past`` [rad] beyond their stops between two samples.

    A polynomial lies between its smallest and largest Bernstein coefficients.
    """
    lo, path = state.counter[ix.N_HELD], work.sweep.path
    most = HALF_PI + past
    width, found = end - begin, CLEAR
    for k in range(max(lo, 1), model.n):
        if state.lock[k] != 0:
            continue
        a, b = path[0, k] - path[0, k - 1], path[1, k] - path[1, k - 1]
        c, d = path[2, k] - path[2, k - 1], path[3, k] - path[3, k - 1]
        # Taylor coefficients about the first sample, scaled to the interval.
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
    """Whether squares stay clear of each other and of solids between two samples.

    Slots ``slot`` and ``last`` hold the samples, slot 0 the beginning of the motion.
    """
    lo, found = state.counter[ix.N_HELD], CLEAR
    for i in range(boxes.first_box(lo), model.n):
        for j in range(*boxes.partners(model, lo, i)):
            clear = stays_clear(model, work, i, j, end - begin, slot, last)
            if clear == UNSURE:
                return UNSURE
            found = max(found, clear)
    return found


@kernel
def stays_clear(
    model: Model, work: Work, i: int, j: int, width: float, slot: int, last: int
) -> int:
    """Whether a square stays clear of another square or of a solid."""
    sweep, clearance, sunk = work.sweep, boxes.clearance(model, i, j), SUNK * model.side
    way = 0.0
    x, y = sweep.x[last, i], sweep.y[last, i]
    if j < model.n:
        near = reach(model, work, i, j, width)
        if square(sweep.x[last, j] - x) + square(sweep.y[last, j] - y) >= near * near:
            return CLEAR
    else:
        solid, radius = model.obstacles[j - model.n], 0.5 * model.bodies.length[0]
        way = width * (sweep.way[i] + radius * sweep.turn[i])
        near = radius + clearance + way
        u, v = from_solid(solid, x, y)
        if abs(u) >= near + solid[ix.A] or abs(v) >= near + solid[ix.B]:
            return CLEAR
        sunk = min(sunk, 2.0 * THIN * (solid[ix.B] + solid[ix.RADIUS]))
    needed, left = clearance - sunk, apart(model, work, i, j, width, slot, last)
    # A pair that overlaps at the beginning must not overlap more deeply.
    if left >= needed or left >= needed - max(clearance - apart(model, work, i, j, 0.0, 0, 0), 0.0):
        return CLEAR
    if j < model.n:
        way = width * max(between(model, work, i, j)[0], between(model, work, j, i)[0])
    return UNSURE if way > FLOOR * sunk else GRAZES


@inlined
def apart(model: Model, work: Work, i: int, j: int, width: float, slot: int, last: int) -> float:
    """Return a lower bound on the separation of a square and a box in the interval [m]."""
    if j < model.n:
        return squares_apart(model, work, i, j, width, slot, last)
    return solid_apart(model, work, i, j, width, slot, last)


@kernel
def squares_apart(
    model: Model, work: Work, i: int, j: int, width: float, slot: int, last: int
) -> float:
    """Like `apart`, for two squares."""
    least = -math.inf
    half = 0.5 * (1.0 - boxes.SHRINK) * model.side - model.rounding
    for k in range(2):
        box, other = (i, j) if k == 0 else (j, i)
        r, u, v = seen(work, slot, box, other)
        r2, u2, v2 = seen(work, last, box, other)
        reach, reach2 = half + half * r, half + half * r2
        least = max(least, beside(u, reach, u2, reach2), beside(v, reach, v2, reach2))
    bend = max(between(model, work, i, j)[1], between(model, work, j, i)[1])
    return least - 0.125 * bend * width * width


@inlined
def beside(u: float, reach: float, u2: float, reach2: float) -> float:
    """Return how far both positions are beyond their reaches, on the same side of 0 [m]."""
    return max(min(u - reach, u2 - reach2), min(-u - reach, -u2 - reach2))


@inlined
def seen(work: Work, slot: int, box: int, other: int) -> tuple[float, float, float]:
    """Return ``other``'s width along ``box``'s axes, divided by its side, and its centre [m]."""
    x, y, c, s = work.sweep.x, work.sweep.y, work.sweep.c, work.sweep.s
    cos, sin = seen_from(c[slot, box], s[slot, box], c[slot, other], s[slot, other])
    dx, dy = x[slot, other] - x[slot, box], y[slot, other] - y[slot, box]
    along, across = seen_from(c[slot, box], s[slot, box], dx, dy)
    return abs(cos) + abs(sin), along, across


@inlined
def from_solid(solid: Array, x: float, y: float) -> tuple[float, float]:
    """Return a point's coordinates in a solid's frame [m], along and across its longer side."""
    return seen_from(solid[ix.C], solid[ix.S], x - solid[ix.X], y - solid[ix.Y])


@kernel
def solid_apart(
    model: Model, work: Work, i: int, j: int, width: float, slot: int, last: int
) -> float:
    """Like `apart`, for a square and a solid."""
    sweep, solid = work.sweep, model.obstacles[j - model.n]
    half = 0.5 * (1.0 - boxes.SHRINK) * model.side - model.rounding
    radius = 0.5 * model.bodies.length[0]
    u, v = from_solid(solid, sweep.x[slot, i], sweep.y[slot, i])
    u2, v2 = from_solid(solid, sweep.x[last, i], sweep.y[last, i])
    c, s = seen_from(solid[ix.C], solid[ix.S], sweep.c[slot, i], sweep.s[slot, i])
    c2, s2 = seen_from(solid[ix.C], solid[ix.S], sweep.c[last, i], sweep.s[last, i])
    # Separation by the solid's sides; the curvature is that of the paths of the square's corners.
    swing = sweep.twist[i] + square(sweep.turn[i])
    bend = 0.125 * width * width * (sweep.bend[i] + radius * swing)
    reach, reach2 = half * (abs(c) + abs(s)), half * (abs(c2) + abs(s2))
    a, b = solid[ix.A], solid[ix.B]
    least = max(beside(u, reach, u2, reach2) - a, beside(v, reach, v2, reach2) - b) - bend
    # Separation by the square's sides; only the part of the solid within reach counts.
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
        own = max(own, beside(p, r, p2, r2))
        c, s, c2, s2 = -s, c, -s2, c2
    return max(least, own - bend)
