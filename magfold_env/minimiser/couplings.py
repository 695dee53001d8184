"""Couplings of the faces of two components on the lattice, from the engine's own energy.

The energy of two components is bilinear in their pole charges: sᵀ K t, where s and t hold them in
units of the strongest, and the 4×4 matrix K depends on nothing but their relative pose. On the
lattice few poses exist.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from magfold_env.engine.compile.jit import allocating_kernel
from magfold_env.engine.magnets.pairs import energy
from magfold_env.engine.state import Array, Magnets, Nodes, Pose
from magfold_env.engine.workspace import new_nodes
from magfold_env.minimiser.face_pairs import FACES, pair_charges, pair_places
from magfold_env.minimiser.lattice import Ints
from magfold_env.scene import Casing, Scene
from magfold_env.scene import Magnets as MagnetsPart
from magfold_env.simulation.pack import pack_magnets


class Couplings:
    """The matrices K of one kind of component, computed when a pose is first asked for.

    Parameters
    ----------
    magnets
        The four magnets of a component; their couplings are those of faces with the charge of the
        strongest, `Magnets.charge`. None makes every coupling zero.
    side
        Edge length of a casing [m].
    """

    def __init__(self, magnets: MagnetsPart | None, side: float) -> None:
        scene = Scene(sequence=("NNNN",), casing=Casing(side=side), magnets=magnets)
        self._charge = magnets.charge if magnets is not None else 0.0
        self._magnets = pack_magnets(scene)
        self._side = side
        self._known: dict[tuple[int, int, int], Array] = {}

    def at(self, poses: Ints) -> NDArray[np.float64]:
        """Return K [J] of each relative pose.

        Parameters
        ----------
        poses : (m, 3) int array
            The second component seen from the first, see `Lattice.poses`.

        Returns
        -------
        (m, 4, 4) array
            First index: face of the first component, in the usual order of faces.
        """
        # Packed into one integer each: np.unique is far slower on rows.
        span = int(np.abs(poses[:, :2]).max(initial=0)) + 1
        width = 2 * span + 1
        codes = ((poses[:, 0] + span) * width + poses[:, 1] + span) * 4 + poses[:, 2]
        unique, inverse = np.unique(codes, return_inverse=True)
        cells, quarters = np.divmod(unique, 4)
        keys = [
            (int(x) - span, int(y) - span, int(q))
            for x, y, q in zip(*np.divmod(cells, width), quarters, strict=True)
        ]
        missing = [key for key in keys if key not in self._known]
        self._known.update(zip(missing, self._compute(missing), strict=True))
        found = np.array([self._known[key] for key in keys])
        return found.reshape(-1, FACES, FACES)[inverse]

    def _compute(self, keys: list[tuple[int, int, int]]) -> NDArray[np.float64]:
        out = np.zeros((len(keys), FACES, FACES))
        if keys and self._charge:
            places = pair_places(np.array(keys), self._side)
            nodes = new_nodes(self._magnets, 2)
            _energies(self._magnets, places, pair_charges(self._charge), nodes, out)
        return out


def couplings(scene: Scene) -> Couplings:
    """Return the couplings of a scene's magnets, shared by all scenes that have the same."""
    if scene.magnets is None:
        return _shared(None, scene.casing.side)
    # How components differ in strength enters where the couplings are used.
    strongest = tuple(scene.magnets.charges(scene.n).max(axis=0).tolist())
    alike = {**dict(scene.magnets), "remanence": None, "pole_charge": strongest}
    return _shared(tuple(alike.items()), scene.casing.side)


@lru_cache(maxsize=16)
def _shared(fields: tuple[tuple[str, Any], ...] | None, side: float) -> Couplings:
    return Couplings(MagnetsPart(**dict(fields)) if fields else None, side)


@allocating_kernel
def _energies(magnets: Magnets, places: Pose, charge: Array, nodes: Nodes, out: Array) -> None:
    """Fill ``out`` (m, 4, 4) [J]; see `pair_places` and `pair_charges`."""
    for p in range(out.shape[0]):
        pose = Pose(places.cos[p], places.sin[p], places.x[p], places.y[p])
        for a in range(4):
            for b in range(4):
                out[p, a, b] = energy(0, magnets, charge[a, b], pose, nodes)
