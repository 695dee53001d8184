"""Single faces of two components on the lattice, as the engine's kernels take them.

What two components do to each other is bilinear in their pole charges, so that the pairs of single
faces tell all of it.
"""

from __future__ import annotations

import numpy as np

from magfold_env.engine.state import Array, Pose
from magfold_env.minimiser.lattice import HEADINGS, Ints

FACES = 4


def pair_places(poses: Ints, side: float) -> Pose:
    """Return where two components are, the first at the origin with heading 0.

    Parameters
    ----------
    poses : (m, 3) int array
        The second component seen from the first, see `Lattice.poses`.
    side
        Edge length of a casing [m].

    Returns
    -------
    Pose
        Its arrays have shape (m, 2), a row a pose.
    """
    cos, sin, x, y = np.zeros((4, len(poses), 2))
    cos[:, 0] = 1.0
    cos[:, 1], sin[:, 1] = HEADINGS[poses[:, 2]].T
    x[:, 1], y[:, 1] = poses[:, :2].T * (side / np.sqrt(2.0))
    return Pose(cos, sin, x, y)


def pair_charges(unit: float) -> Array:
    """Return the charges of two components with a single face of charge ``unit`` [A·m] each.

    Returns
    -------
    (4, 4, 2, 4) array
        By the first component's face and the second's: charges of the two components [A·m].
    """
    charge = np.zeros((FACES, FACES, 2, FACES))
    for face in range(FACES):
        charge[face, :, 0, face] = unit
        charge[:, face, 1, face] = unit
    return charge
