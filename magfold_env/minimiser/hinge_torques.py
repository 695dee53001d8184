"""What the magnets do to the joints of words: which of them they press against their stops."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from magfold_env.engine.state import Array
from magfold_env.minimiser.lattice import HEADINGS, ORDER, Lattice
from magfold_env.minimiser.pair_poses import PairPoses, evaluate

PRESSING = 1e-9
"""Torques up to this part of the largest are none: symmetries cancel but for rounding."""


def hinge_torques(
    lattice: Lattice, poses: PairPoses, wrench: Array, strength: Array, half_length: float
) -> Array:
    """Return the magnets' torques on the joints, shape (words, n - 1) [N·m].

    They are -∂U/∂θ of the joint angles θ: the moment about a hinge of what the components before
    it do to those behind.

    Parameters
    ----------
    lattice
        The words.
    poses
        Their `pair_poses`.
    wrench : (poses, 3, 4, 4) array
        `wrenches` at these poses.
    strength : (n, 4) array
        The signs of the faces.
    half_length
        Unit of the cells [m].
    """
    value = np.empty((3, len(wrench)))
    for part in range(3):
        coupling = np.ascontiguousarray(wrench[:, part])
        evaluate(coupling, poses.first, poses.second, strength, value[part])
    heading = HEADINGS[lattice.quarters]
    hinge = half_length * (lattice.cells - heading)
    centre = half_length * lattice.cells
    out = np.zeros((len(lattice), lattice.n - 1))
    pair = 0
    for i in range(lattice.n):
        cos, sin = heading[:, i].T
        for j in range(i + 1, lattice.n):
            along, across, torque = value[:, poses.row[pair]]
            force_x, force_y = cos * along - sin * across, sin * along + cos * across
            for k in range(i + 1, j + 1):
                x, y = (centre[:, j] - hinge[:, k]).T
                out[:, k - 1] += torque + x * force_y - y * force_x
            pair += 1
    return out


def pressed(lattice: Lattice, torques: Array) -> NDArray[np.bool_]:
    """Whether torques (words, n - 1) press every joint of each word against its stop.

    A straight joint has no stop; a word with one is never pressed.
    """
    direction = np.zeros(len(ORDER))
    direction[ORDER.index("L")], direction[ORDER.index("R")] = 1.0, -1.0
    floor = PRESSING * np.abs(torques).max(initial=0.0)
    return (direction[lattice.letters] * torques > floor).all(axis=1)
