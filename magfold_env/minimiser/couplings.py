"""Couplings of the faces of two components on the lattice, computed by the engine.

The interaction of two components is bilinear in their pole charges. Their energy is sᵀ K t. The
vectors s and t contain the charges in units of the largest one, and the 4×4 matrix K depends only
on the relative pose. The lattice has few poses. K contains the energies of pairs of single faces.
"""

import math
from collections.abc import Hashable
from functools import lru_cache
from typing import cast

import numpy as np
from numpy.typing import NDArray

from magfold_env import scene as scenes
from magfold_env.engine.compile.jit import allocating_kernel, inlined
from magfold_env.engine.magnets import pairs
from magfold_env.engine.state import Array, Magnets, Nodes, Pose
from magfold_env.engine.workspace import new_nodes
from magfold_env.minimiser.lattice import HEADINGS, Ints
from magfold_env.simulation.pack import pack_magnets

FACES = 4


class Couplings:
    """The matrices K of one kind of component, each computed when its pose is first used.

    K is the energy of faces with the largest charge, `Magnets.charge`. Without magnets, it is zero.
    ``side`` is the edge length of a casing [m].
    """

    def __init__(self, magnets: scenes.Magnets | None, side: float) -> None:
        casing = scenes.Casing(side=side)
        self._charge = magnets.charge if magnets is not None else 0.0
        one = scenes.Scene(sequence=("NNNN",), casing=casing, magnets=magnets)
        self._magnets = pack_magnets(one)
        self._side = side
        self._known: dict[tuple[int, ...], Array] = {}

    def at(self, poses: Ints) -> Array:
        """Return K [J] at relative poses (m, 3), see `Lattice.poses`.

        The shape is (m, 4, 4): poses, faces of the first component, faces of the second component.
        """
        rows, inverse = _distinct(poses)
        keys = [tuple(pose) for pose in poses[rows].tolist()]
        missing = [key for key in keys if key not in self._known]
        self._known.update(zip(missing, self._compute(missing), strict=True))
        found = np.array([self._known[key] for key in keys])
        return found.reshape(-1, FACES, FACES)[inverse]

    def _compute(self, keys: list[tuple[int, ...]]) -> Array:
        out = np.zeros((len(keys), FACES, FACES))
        if keys and self._charge:
            half = self._side / math.sqrt(2.0)
            nodes = new_nodes(self._magnets, 2)
            _fill_energies(self._magnets, self._charge, half, np.array(keys), nodes, out)
        return out


def couplings(scene: scenes.Scene) -> Couplings:
    """Return the couplings of a scene's magnets, shared by all scenes with equal magnets."""
    magnets = scene.magnets
    if magnets is not None:
        # Callers multiply the couplings by the strengths of the faces.
        strongest = tuple(magnets.charges(scene.n).max(axis=0).tolist())
        magnets = magnets.model_copy(update={"remanence": None, "pole_charge": strongest})
    return _shared(cast("Hashable", magnets), scene.casing.side)  # hashable like all frozen models


_shared = lru_cache(maxsize=16)(Couplings)


@allocating_kernel
def _fill_energies(
    magnets: Magnets, charge: float, half: float, poses: Ints, nodes: Nodes, out: Array
) -> None:
    """Fill ``out`` (m, 4, 4) [J] with energies of two components that have one charged face each.

    The charged faces have ``charge`` [A·m]. The unit of cells is ``half`` [m].
    """
    pose = Pose(np.zeros(2), np.zeros(2), np.zeros(2), np.zeros(2))
    pose.cos[0] = 1.0
    for p in range(out.shape[0]):
        pose.cos[1], pose.sin[1] = HEADINGS[poses[p, 2], 0], HEADINGS[poses[p, 2], 1]
        pose.x[1], pose.y[1] = poses[p, 0] * half, poses[p, 1] * half
        for a in range(FACES):
            for b in range(FACES):
                charges = np.zeros((2, FACES))
                charges[0, a], charges[1, b] = charge, charge
                out[p, a, b] = pairs.energy(0, magnets, charges, pose, nodes)


def _distinct(poses: Ints) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the distinct poses, and the index of every pose among them."""
    # Each pose becomes one integer, because np.unique is far slower on rows.
    span = int(np.abs(poses[:, :2]).max(initial=0)) + 1
    codes = ((poses[:, 0] + span) * (2 * span + 1) + poses[:, 1] + span) * 4 + poses[:, 2]
    _, rows, inverse = np.unique(codes, return_index=True, return_inverse=True)
    return rows, inverse


@inlined
def bilinear(matrix: Array, s: Array, t: Array) -> float:
    """Return sᵀ K t, the energy of two components with pole charges s and t."""
    total = 0.0
    for a in range(FACES):
        field = 0.0
        for b in range(FACES):
            field += matrix[a, b] * t[b]
        total += s[a] * field
    return total
