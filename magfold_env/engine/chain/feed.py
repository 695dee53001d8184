"""The tube: which components it holds, where they are, and what happens when one is released.

The mouth is at the origin and the feed along +x. Components before ``lo`` are held: they keep
their headings, with which every casing is within the bore, and move with the base. The outermost
of them, ``lo − 1``, has its outer hinge outside, and that hinge is the base. It is released when
its inner hinge passes the mouth.
"""

import math

from magfold_env.engine import entries as at
from magfold_env.engine.chain import articulated
from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.contact.boxes import first_box
from magfold_env.engine.elementary import direction, sincos
from magfold_env.engine.state import Array, Model, Pose, State, Work


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
def headings_of(offsets: Array, length: Array, headings: Array) -> None:
    """Fill in the headings of held chains, (m, n), for their hinges' distances from the axis [m].

    Distances (m, n + 1) begin at the inner end; ``length`` (n,) is from hinge to hinge.
    """
    for row in range(offsets.shape[0]):
        for i in range(length.size):
            rise = offsets[row, i + 1] - offsets[row, i]
            along = math.sqrt(length[i] * length[i] - rise * rise)
            headings[row, i] = direction(along, rise)


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
def time_to_release(model: Model, state: State) -> float:
    """Time until the outermost held component is released at the present feed speed [s]."""
    n, i = model.n, state.counter[at.LO] - 1
    _, c = sincos(float(state.q[i]))
    return (model.bodies.length[i] * c - state.q[n]) / state.v[n]


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
def change_speed(model: Model, state: State, work: Work, speed: float) -> None:
    """Give the base another feed speed [m/s]; the chain outside feels an impulse.

    Its velocity becomes the nearest one, in the metric of its mass matrix. Constraints that it
    violates are met by the impact at the beginning of the next step.
    """
    lo, n = state.counter[at.LO], model.n
    jump = speed - state.v[n]
    state.counter[at.FRESH] = 1
    state.v[n] = speed
    if lo == n or jump == 0.0:
        return
    place_all(lo, model, state.q, work.pose)
    for i in range(lo, n):
        work.loads.fx[i] = -model.bodies.mass[i] * jump
        work.loads.fy[i] = 0.0
        work.loads.torque[i] = 0.0
    bodies, pose, chain, force = model.bodies, work.pose, work.chain, work.chain.force
    articulated.generalise(lo, bodies, pose, work.loads, force)
    articulated.factor(lo, bodies, pose, chain.unlocked, chain)
    articulated.solve(lo, bodies, pose, chain.unlocked, False, force, force, chain)
    for i in range(lo, n):
        state.v[i] += force[i]
