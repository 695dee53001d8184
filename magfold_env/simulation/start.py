"""Where a chain is at first."""

import numpy as np

from magfold_env.engine.chain.feed import headings_of
from magfold_env.engine.elementary import sincos
from magfold_env.engine.state import Array
from magfold_env.scene import Scene, strip
from magfold_env.simulation.pack import reversed_inside
from magfold_env.simulation.view import Orientation


def start(scene: Scene, view: Orientation) -> tuple[Array, float]:
    """Return a concrete scene's headings (n,) in the engine's order [rad], and the base's y [m]."""
    if scene.mount != "tube":
        return _headings(view.joints(np.array(scene.start_angles))), 0.0
    offsets = hinge_offsets(scene)
    offsets = offsets[::-1] if view.flip else offsets
    headings = np.empty((1, scene.n))
    headings_of(np.ascontiguousarray(offsets)[None], view.length, headings)
    return headings[0], float(offsets[-1])


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
