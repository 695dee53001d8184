"""The magnetic energy of words: a quadratic form in the signs of the faces."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from magfold_env.energy.couplings import FACES, couplings
from magfold_env.energy.lattice import Lattice
from magfold_env.scene import Scene

Floats = NDArray[np.float64]

TIE = 1e-9
"""Energies this close, relative to `energy_unit`, are equal: symmetries differ by rounding."""


def signs(sequence: Sequence[str]) -> Floats:
    """Return +1 for N and -1 for S, shape (n, 4)."""
    return np.array([[1.0 if face == "N" else -1.0 for face in faces] for faces in sequence])


def energy_unit(scene: Scene) -> float:
    """Return a scene's natural scale of energy [J]: two pole charges one side apart."""
    charge = 0.0 if scene.magnets is None else scene.magnets.charge
    return 1e-7 * charge**2 / scene.casing.side


def word_energies(scene: Scene, lattice: Lattice) -> Floats:
    """Return the energy of each word with the scene's sequence [J], shape (m,).

    Each pair of components counts once, pairs inside a component are left out: `mf.energy`.
    """
    table = couplings(scene)
    sign = signs(scene.sequence)
    total = np.zeros(len(lattice))
    for i, j, poses in lattice.pairs():
        total += np.einsum("a,mab,b->m", sign[i], table.at(poses), sign[j])
    return total


def quadratic_forms(scene: Scene, lattice: Lattice) -> Floats:
    """Return J of each word: its energy is sᵀ J s for signs s of all 4n faces.

    Returns
    -------
    (m, 4n, 4n) array
        Symmetric [J]; zero where both faces belong to one component.
    """
    table = couplings(scene)
    n = lattice.n
    form = np.zeros((len(lattice), n, FACES, n, FACES))
    for i, j, poses in lattice.pairs():
        half = 0.5 * table.at(poses)
        form[:, i, :, j] = half
        form[:, j, :, i] = half.transpose(0, 2, 1)
    return form.reshape(len(lattice), n * FACES, n * FACES)
