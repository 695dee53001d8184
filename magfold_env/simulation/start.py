"""Where a chain is at first."""

import numpy as np

from magfold_env.engine import entries as at
from magfold_env.engine.chain.feed import lie_in_tube
from magfold_env.engine.elementary import sincos
from magfold_env.engine.state import Array, Model, State
from magfold_env.engine.workspace import new_state
from magfold_env.scene import Scene, strip
from magfold_env.simulation.pack import reversed_inside
from magfold_env.simulation.view import Orientation


def start(scene: Scene, model: Model, view: Orientation) -> State:
    """Return the state in which a concrete scene begins."""
    n = scene.n
    if scene.mount != "tube":
        return new_state(model, _headings(view.joints(np.array(scene.start_angles))))
    state = new_state(model, np.zeros(n))
    offsets = hinge_offsets(scene)
    offsets = np.ascontiguousarray(offsets[::-1] if view.flip else offsets)
    depth = state.feed[at.DEPTH : at.DEPTH + 1]
    lie_in_tube(offsets[None], view.length, state.q[None, :n], depth)
    state.q[n + 1] = offsets[n]
    return state


def hinge_offsets(scene: Scene) -> Array:
    """Return how far left of the tube's axis hinges lie at first [m], (n + 1,).

    The scene must have a tube and leave nothing to draw. Component 1's outer hinge comes first.
    """
    if scene.start_offsets is not None:
        return np.array(scene.start_offsets)
    joints = np.array(scene.start_angles)
    # Counted from the inner end: a chain seen from either end gets the same bits.
    turn = reversed_inside(scene)
    headings = _headings(-joints[::-1] if turn else joints)
    sines, cosines = zip(*map(sincos, headings), strict=True)
    _, across = strip.narrowest(np.array(cosines), np.array(sines))
    offsets = scene.casing.diagonal * across
    return offsets[::-1] if turn else offsets


def _headings(joints: Array) -> Array:
    return np.concatenate([[0.0], np.cumsum(joints)])
