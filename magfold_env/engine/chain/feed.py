"""The tube: which components it holds, where they are, and what happens when one is released.

The mouth is at the origin and the feed along +x. Components before ``lo`` are held: they keep
their headings, with which every casing is within the bore, and move with the base. The outermost
of them is ``lo − 1``, and its outer hinge is the base. It is released when its inner hinge passes
the mouth on the way out. A feed that turns back draws free components in: each is held again where
its inner hinge is a whole number of diagonals inside, if it lies straight enough; else it stays
free, between the walls. Once all are out there is nothing left that could draw them in.
"""

import math

from magfold_env.engine import entries as at
from magfold_env.engine.chain import articulated
from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.contact.boxes import first_box
from magfold_env.engine.elementary import direction, sincos
from magfold_env.engine.state import Array, Model, Pose, State, Work

STRAIGHT = 0.2  # [rad] of the heading of a component that may be held again
NOWHERE = 1e-9  # of the side: a feed that has gone no farther is where it was at first


@inlined
def is_free(lo: int, model: Model) -> bool:
    """Whether the base moves by itself."""
    return not model.pinned and not (model.tube and lo > 0)


@inlined
def coordinates(model: Model) -> int:
    """Return how many coordinates may change: a pinned base, the last two, stays where it is."""
    return model.n if model.pinned else model.n + 2


@inlined
def charged(model: Model, i: int) -> bool:
    """Whether component i has any magnet."""
    return (
        model.charge[i, 0] != 0.0
        or model.charge[i, 1] != 0.0
        or model.charge[i, 2] != 0.0
        or model.charge[i, 3] != 0.0
    )


@kernel
def lie_in_tube(offsets: Array, length: Array, headings: Array, depth: Array) -> None:
    """Find how held chains lie whose hinges are so far from the tube's axis [m].

    Parameters
    ----------
    offsets
        Of the hinges, the inner end first [m], shape (m, n + 1).
    length
        From hinge to hinge [m], shape (n,).
    headings
        Filled in [rad], shape (m, n).
    depth
        Filled in with how long the chains are along the tube [m], shape (m,).
    """
    for row in range(offsets.shape[0]):
        depth[row] = 0.0
        for i in range(length.size):
            rise = offsets[row, i + 1] - offsets[row, i]
            along = math.sqrt(length[i] * length[i] - rise * rise)
            headings[row, i] = direction(along, rise)
            depth[row] += along


@kernel
def place_all(lo: int, model: Model, q: Array, pose: Pose) -> int:
    """Fill ``pose`` for the free components and the held ones that matter.

    Those are the outermost two, which others may touch, and the charged ones next to them. Returns
    the first component whose magnets act.
    """
    articulated.place(lo, model.bodies, q, pose)
    n = model.n
    first = lo
    x, y = q[n], q[n + 1]
    for i in range(lo - 1, -1, -1):
        acts = first == i + 1 and charged(model, i)
        if not acts and i < first_box(lo):
            break
        s, c = sincos(q[i])
        x -= model.bodies.length[i] * c
        y -= model.bodies.length[i] * s
        pose.cos[i] = c
        pose.sin[i] = s
        pose.x[i] = x + model.bodies.reach[i] * c
        pose.y[i] = y + model.bodies.reach[i] * s
        if acts:
            first = i
    return first


@inlined
def advance(model: Model, state: State) -> float:
    """How far the feed has gone [m]: where the innermost hinge is, from where it was at first."""
    x = state.q[model.n] + state.place[at.DEPTH]
    for i in range(state.counter[at.LO]):
        _, c = sincos(float(state.q[i]))
        x -= model.bodies.length[i] * c
    return x


@kernel
def begin(model: Model, state: State, work: Work) -> None:
    """Give the feed the speed that is asked of it, and find its next mark."""
    n, lo = model.n, state.counter[at.LO]
    speed = float(state.speed[lo - 1])
    if speed < 0.0 and advance(model, state) <= NOWHERE * model.side:
        speed = 0.0
    change_speed(model, state, work, speed)
    load(model, state)
    state.place[at.NEXT] = next_mark(model, state)
    state.clock[at.MARK] = math.inf
    if speed != 0.0:
        time = (state.place[at.NEXT] - state.q[n]) / state.v[n]
        state.clock[at.MARK] = state.clock[at.TIME] + max(time, 0.0)
    state.counter[at.FEEDING] = 1


@kernel
def next_mark(model: Model, state: State) -> float:
    """Where something next happens to a base that moves [m].

    On its way out it comes to where the outermost held component is released. On its way in it
    comes to whole diagonals inside the mouth, where components may be held again, and to where the
    feed has gone back all its way. Magnets that act outside only are lost and won at whole
    diagonals, the mouth itself included.
    """
    n, i = model.n, state.counter[at.LO] - 1
    x, diagonal = state.q[n], model.bodies.length[i]
    whole = 0
    if state.v[n] > 0.0:
        if model.at_mouth and x < 0.0:
            while -(whole + 1) * diagonal > x:
                whole += 1
            return -whole * diagonal
        _, c = sincos(float(state.q[i]))
        return model.bodies.length[i] * c
    if not model.at_mouth:
        whole = 1
    while -whole * diagonal >= x:
        whole += 1
    return max(-whole * diagonal, x - advance(model, state))


@kernel
def pass_mark(model: Model, state: State, work: Work) -> None:
    """Do what happens where the base is now: at the feed's next mark."""
    n, mark = model.n, state.place[at.NEXT]
    if state.v[n] > 0.0 and mark > 0.0:
        release(model, state)
        return
    state.q[n] = mark
    state.counter[at.FRESH] = 1
    while state.v[n] < 0.0 and fits(model, state):
        hold(model, state, work)


@inlined
def fits(model: Model, state: State) -> bool:
    """Whether the innermost free component lies in the tube as it may be held."""
    i, n = state.counter[at.LO], model.n
    return 0 < i < n and state.q[n] <= -model.bodies.length[i] and abs(state.q[i]) <= STRAIGHT


@kernel
def load(model: Model, state: State) -> None:
    """Give components that come to be outside their magnets, if they have them only there.

    And take them from those that come to be inside. A component is inside while the base is so
    deep that its leading hinge would be if all behind it were in line.
    """
    if not model.at_mouth:
        return
    n, inner = model.n, state.counter[at.LO] - 1
    x, leaves = state.q[n], state.v[n] >= 0.0
    for i in range(n):
        mouth = (inner - i) * model.bodies.length[i]
        outside = i >= inner and (x > mouth or (x == mouth and leaves))
        if outside != charged(model, i):
            for face in range(4):
                model.charge[i, face] = state.waiting[i, face] if outside else 0.0
            state.counter[at.FRESH] = 1


@kernel
def release(model: Model, state: State) -> None:
    """Release the outermost held component; no velocity jumps.

    The base moves to its inner hinge, which is now at the mouth.
    """
    n, i = model.n, state.counter[at.LO] - 1
    state.q[n] = 0.0
    s, _ = sincos(float(state.q[i]))
    state.q[n + 1] -= model.bodies.length[i] * s
    state.v[i] = 0.0
    state.lock[i] = 0
    state.stuck[i] = 0
    state.counter[at.LO] = i
    state.counter[at.FRESH] = 1


@kernel
def hold(model: Model, state: State, work: Work) -> None:
    """Hold the innermost free component again, as it lies: an inelastic impact.

    It turns no more, and the base moves to its outer hinge.
    """
    n, i = model.n, state.counter[at.LO]
    s, c = sincos(float(state.q[i]))
    length, rate = model.bodies.length[i], state.v[i]
    state.q[n] += length * c
    state.q[n + 1] += length * s
    state.v[i] = 0.0
    state.lock[i] = 0
    state.stuck[i] = 0
    state.counter[at.LO] = i + 1
    jolt(model, state, work, length * s * rate, -length * c * rate)


@kernel
def change_speed(model: Model, state: State, work: Work, speed: float) -> None:
    """Give the base another feed speed [m/s]; the chain outside feels an impulse."""
    jump = speed - state.v[model.n]
    state.v[model.n] = speed
    jolt(model, state, work, jump, 0.0)


@kernel
def jolt(model: Model, state: State, work: Work, jump_x: float, jump_y: float) -> None:
    """Let the free components follow a base whose velocity has changed at once [m/s].

    Their velocity becomes the nearest one, in the metric of their mass matrix. Constraints that it
    violates are met by the impact at the beginning of the next step.
    """
    lo, n = state.counter[at.LO], model.n
    state.counter[at.FRESH] = 1
    if lo == n or (jump_x == 0.0 and jump_y == 0.0):
        return
    place_all(lo, model, state.q, work.pose)
    for i in range(lo, n):
        work.loads.fx[i] = -model.bodies.mass[i] * jump_x
        work.loads.fy[i] = -model.bodies.mass[i] * jump_y
        work.loads.torque[i] = 0.0
    bodies, pose, chain, force = model.bodies, work.pose, work.chain, work.chain.force
    articulated.generalise(lo, bodies, pose, work.loads, force)
    articulated.factor(lo, bodies, pose, chain.unlocked, chain)
    articulated.solve(lo, bodies, pose, chain.unlocked, False, force, force, chain)
    for i in range(lo, n):
        state.v[i] += force[i]
