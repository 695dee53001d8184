"""The tube: which components it holds, and where they lie.

The mouth is at the origin, and the feed moves along +x. Components before ``lo`` are held: they
move with the base and keep their headings, which leave every casing within the bore. The outermost
held component is ``lo − 1``, and its outer hinge is the base.
"""

import math

from magfold_env.engine import indices as ix
from magfold_env.engine.chain import articulated
from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.contact.boxes import first_box
from magfold_env.engine.elementary import direction, sincos
from magfold_env.engine.state import Array, Model, Pose, State, Work


@inlined
def is_free(lo: int, model: Model) -> bool:
    """Whether the base moves freely."""
    return not model.pinned and not (model.tube and lo > 0)


@inlined
def is_partly_out(model: Model, state: State) -> bool:
    """Whether the tube holds one part of the chain while another part is outside."""
    return 0 < state.counter[ix.N_HELD] < model.n


@inlined
def base_mass(lo: int, model: Model, work: Work) -> float:
    """Return the mass of the base [kg], or FREE or DRIVEN, for `articulated.solve`."""
    if is_free(lo, model):
        return articulated.FREE
    carried = work.chain.base[ix.CARRIED]
    return carried if carried > 0.0 else articulated.DRIVEN


@inlined
def coordinates(model: Model) -> int:
    """Return the number of coordinates that may change; a pinned base (the last two) is fixed."""
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
def whole_mass(model: Model) -> float:
    """Return the mass of the chain [kg]."""
    total = 0.0
    for i in range(model.n):
        total += model.bodies.mass[i]
    return total


@kernel
def lie_in_tube(offsets: Array, length: Array, headings: Array, depth: Array) -> None:
    """Place chains in the tube, given the offsets of their hinges from its axis (m, n + 1) [m].

    ``length`` (n,) is each component's length from hinge to hinge [m]. Fills in the headings (m, n)
    [rad] and, in ``depth`` (m,), the chains' lengths along the tube [m].
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
    """Fill in ``pose`` for the free components and for the held ones that matter.

    Those are the outermost two, which others may touch, and all whose magnets act. If magnets act
    only outside, these lie nearest to the mouth. Returns the first component whose magnets act.
    """
    articulated.place(lo, model.bodies, q, pose)
    n = model.n
    first = lo
    x, y = q[n], q[n + 1]
    for i in range(lo - 1, -1, -1):
        acts = first == i + 1 and model.magnetic and (not model.at_mouth or charged(model, i))
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
    """Return the feed's travel [m]: the displacement of the innermost hinge from its start."""
    x = float(state.q[model.n] + state.feed[ix.DEPTH])
    for i in range(state.counter[ix.N_HELD]):
        _, c = sincos(float(state.q[i]))
        x -= model.bodies.length[i] * c
    return x
