"""Forces and torques between the faces of two components on the lattice, from the engine."""

from __future__ import annotations

import numpy as np

from magfold_env.engine.compile.jit import allocating_kernel
from magfold_env.engine.magnets.pairs import add_forces
from magfold_env.engine.state import Array, Magnets, Nodes, Pose
from magfold_env.engine.workspace import new_nodes
from magfold_env.minimiser.face_pairs import FACES, pair_charges, pair_places
from magfold_env.minimiser.lattice import Ints
from magfold_env.scene import Scene
from magfold_env.simulation.pack import pack_magnets


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
        places = pair_places(poses, scene.casing.side)
        # Faces in their own order, whichever way a tube would be fed.
        magnets = pack_magnets(scene.replace(mount="pinned"))
        nodes = new_nodes(magnets, 2)
        _wrenches(magnets, places, pair_charges(scene.magnets.charge), nodes, out)
    return out


@allocating_kernel
def _wrenches(magnets: Magnets, places: Pose, charge: Array, nodes: Nodes, out: Array) -> None:
    """Fill ``out`` (m, 3, 4, 4); see `pair_places` and `pair_charges`."""
    force_x, force_y, torque = np.empty(2), np.empty(2), np.empty(2)
    for p in range(out.shape[0]):
        pose = Pose(places.cos[p], places.sin[p], places.x[p], places.y[p])
        for a in range(4):
            for b in range(4):
                force_x[:] = 0.0
                force_y[:] = 0.0
                torque[:] = 0.0
                add_forces(0, magnets, charge[a, b], pose, nodes, force_x, force_y, torque)
                out[p, 0, a, b] = force_x[1]
                out[p, 1, a, b] = force_y[1]
                out[p, 2, a, b] = torque[1]
