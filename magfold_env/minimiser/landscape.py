"""The magnetic energy of words: a quadratic form in the signs of the faces.

What magnets do to each other is all there is: scenes with an external field are refused, since
the energy in it depends on where a fold lies, which a word does not say.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from magfold_env.minimiser.couplings import couplings
from magfold_env.minimiser.face_pairs import FACES
from magfold_env.minimiser.lattice import Lattice
from magfold_env.scene import SIGNS, Scene

Floats = NDArray[np.float64]

TIE = 1e-9
"""Energies this close, relative to `energy_unit`, are equal: symmetries differ by rounding."""


def signs(sequence: Sequence[str]) -> Floats:
    """Return +1 for N, -1 for S and 0 for a face without magnet, shape (n, 4)."""
    return np.array([[SIGNS[face] for face in faces] for faces in sequence])


def strengths(scene: Scene) -> Floats:
    """Return what a face's pole charge would be, N or S, in `Magnets.charge`s, shape (n, 4)."""
    if scene.magnets is None:
        return np.zeros((scene.n, FACES))
    return scene.magnets.charges(scene.n) / scene.magnets.charge


def poles(scene: Scene) -> Floats:
    """Return the faces' pole charges in `Magnets.charge`s, N positive, shape (n, 4)."""
    return signs(scene.sequence) * strengths(scene)


def refuse_field(scene: Scene) -> None:
    """Refuse a scene in an external field.

    Raises
    ------
    ValueError
        If it has one.
    """
    if scene.field is not None and scene.field.any:
        raise ValueError(
            f"field: {scene.field!r} is not allowed; energy minimisation does not know of "
            "external fields, must be None"
        )


def energy_unit(scene: Scene) -> float:
    """Return a scene's natural scale of energy [J]: two pole charges one side apart."""
    charge = 0.0 if scene.magnets is None else scene.magnets.charge
    return 1e-7 * charge**2 / scene.casing.side


def word_energies(scene: Scene, lattice: Lattice) -> Floats:
    """Return the energy of each word with the scene's sequence [J], shape (m,).

    Each pair of components counts once, pairs inside a component are left out: `mf.energy`.

    Raises
    ------
    ValueError
        If the scene has an external field.
    """
    refuse_field(scene)
    table = couplings(scene)
    pole = poles(scene)
    total = np.zeros(len(lattice))
    for i, j, poses in lattice.pairs():
        total += np.einsum("a,mab,b->m", pole[i], table.at(poses), pole[j])
    return total


def quadratic_forms(scene: Scene, lattice: Lattice) -> Floats:
    """Return J of each word: its energy is sᵀ J s for signs s of all 4n faces, 0 for empty ones.

    Returns
    -------
    (m, 4n, 4n) array
        Symmetric [J]; zero where both faces belong to one component. How strong each face's
        magnet is counts, the scene's sequence does not.

    Raises
    ------
    ValueError
        If the scene has an external field.
    """
    refuse_field(scene)
    strength = strengths(scene)
    table = couplings(scene)
    n = lattice.n
    form = np.zeros((len(lattice), n, FACES, n, FACES))
    for i, j, poses in lattice.pairs():
        half = 0.5 * strength[i][:, None] * table.at(poses) * strength[j]
        form[:, i, :, j] = half
        form[:, j, :, i] = half.transpose(0, 2, 1)
    return form.reshape(len(lattice), n * FACES, n * FACES)
