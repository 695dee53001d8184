"""Forces and torques between the faces of two components on the lattice, from the engine."""

from __future__ import annotations

import numpy as np

from magfold_env.energy.couplings import FACES
from magfold_env.energy.lattice import HEADINGS, Ints
from magfold_env.engine.jit import allocating_kernel
from magfold_env.engine.magnets import add_forces
from magfold_env.engine.pack import pack_magnets
from magfold_env.engine.state import Array, Magnets, Nodes, Pose
from magfold_env.engine.workspace import new_nodes
from magfold_env.scene import Scene


def wrenches(scene: Scene, poses: Ints) -> Array:
    """Return what every face of a component does to every face of another at some poses.

    Parameters
    ----------
    scene
        Its magnets and casing count.
    poses : (m, 3) int array
        The second component seen from the first, see `Lattice.poses`.

    Returns
    -------
    (m, 3, 4, 4) array
        Force on the second component along x and y of the first [N] and torque about the second's
        centre [N·m], by face of the first and face of the second; both N.
    """
    out = np.zeros((len(poses), 3, FACES, FACES))
    if scene.magnets is not None and len(poses):
        centres = poses[:, :2] * (scene.casing.side / np.sqrt(2.0))
        headings = HEADINGS[poses[:, 2]].astype(np.float64)
        # Faces in their own order, whichever way a tube would be fed.
        magnets = pack_magnets(scene.replace(mount="pinned"))
        nodes = new_nodes(magnets, 2)
        _face_pairs(magnets, scene.magnets.charge, centres, headings, nodes, out)
    return out


@allocating_kernel
def _face_pairs(
    magnets: Magnets, unit: float, centres: Array, headings: Array, nodes: Nodes, out: Array
) -> None:
    """Fill ``out`` (m, 3, 4, 4) for single faces of charge ``unit`` [A·m].

    ``centres`` (m, 2) [m] and ``headings`` (m, 2), as unit vectors, place the second component.
    """
    cos, sin, x, y = np.ones(2), np.zeros(2), np.zeros(2), np.zeros(2)
    pose = Pose(cos, sin, x, y)
    charge = np.zeros((2, 4))
    force_x, force_y, torque = np.empty(2), np.empty(2), np.empty(2)
    for p in range(out.shape[0]):
        x[1], y[1] = centres[p, 0], centres[p, 1]
        cos[1], sin[1] = headings[p, 0], headings[p, 1]
        for a in range(4):
            for b in range(4):
                charge[:] = 0.0
                charge[0, a] = unit
                charge[1, b] = unit
                force_x[:] = 0.0
                force_y[:] = 0.0
                torque[:] = 0.0
                add_forces(0, magnets, charge, pose, nodes, force_x, force_y, torque)
                out[p, 0, a, b] = force_x[1]
                out[p, 1, a, b] = force_y[1]
                out[p, 2, a, b] = torque[1]
