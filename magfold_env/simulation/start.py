"""The initial state of a chain."""

import numpy as np

from magfold_env.engine.elementary import sincos
from magfold_env.engine.state import Array
from magfold_env.scene import Scene, strip
from magfold_env.simulation.pack import reversed_inside


def headings(joints: Array) -> Array:
    """Return headings [rad] for joint angles, the first along +x."""
    return np.concatenate([[0.0], np.cumsum(joints)])


def hinge_offsets(scene: Scene) -> Array:
    """Return the initial offsets of hinges to the left of the tube's axis [m], (n + 1,).

    The scene must have a tube and be concrete. Component 1's outer hinge comes first.
    """
    offsets = inner_offsets(scene)
    return offsets[::-1] if reversed_inside(scene) else offsets


def inner_offsets(scene: Scene) -> Array:
    """Return the same offsets from the inner end."""
    turn = reversed_inside(scene)
    if scene.start_offsets is not None:
        offsets = np.array(scene.start_offsets)
        return offsets[::-1].copy() if turn else offsets
    # Counted from the inner end, so that a chain seen from either end gets the same bits.
    joints = np.array(scene.start_angles)
    sines, cosines = zip(*map(sincos, headings(-joints[::-1] if turn else joints)), strict=True)
    _, across = strip.narrowest(np.array(cosines), np.array(sines))
    return scene.casing.diagonal * across
