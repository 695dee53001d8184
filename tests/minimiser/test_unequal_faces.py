"""Energies of magnets whose sizes differ from face to face, against sums over charges."""

from typing import Any

import numpy as np
import pytest

import magfold_env as mf
from magfold_env.minimiser import minimise
from magfold_env.minimiser.energies import quadratic_forms, signs, word_energies
from magfold_env.minimiser.lattice import all_words
from magfold_env.scene import Magnets, Scene
from magfold_env.shapes import headings, word_to_angles
from tests.minimiser import reference

SIDE = 0.0125
SEQUENCE = ("NSNN", "S-SN", "NNSS", "SSNS")
SIZES: dict[str, Any] = {
    "width": (0.005, 0.003, 0.006, 0.004),
    "height": (0.004, 0.009, 0.002, 0.006),
    "thickness": (0.001, 0.002, 0.0025, 0.001),
    "inset": (0.0005, 0.0003, 0.0004, 0.001),
}
ROWS = tuple((1.0 + k, 0.6, 0.5, 0.9 + k) for k in range(4))
MODELS = {
    "strips": Magnets(nodes=5, **SIZES),
    "points": Magnets(model="points", nodes=4, **SIZES),
    "strips by component": Magnets(nodes=5, remanence=ROWS, **SIZES),
    "equal sizes": Magnets(nodes=5, remanence=ROWS),
}
for name, lengths in SIZES.items():
    # One length at a time, and flat enough to fit: which of them goes wrong shows in the name.
    alone: dict[str, Any] = {"thickness": 0.002, name: lengths}
    MODELS[f"{name} alone"] = Magnets(nodes=5, **alone)


@pytest.mark.parametrize("model", MODELS)
def test_word_energies_are_sums_over_charges(model: str) -> None:
    scene = Scene(sequence=SEQUENCE, magnets=MODELS[model])
    lattice = all_words(scene.n)
    expected = [
        reference.energy(SEQUENCE, lattice.word(row), SIDE, MODELS[model])
        for row in range(len(lattice))
    ]
    scale = np.abs(expected).max()
    found = word_energies(scene, lattice)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-11 * scale)
    form, s = quadratic_forms(scene, lattice), signs(SEQUENCE).ravel()
    summed = np.einsum("a,wab,b->w", s, form, s)
    np.testing.assert_allclose(summed, expected, rtol=0, atol=1e-11 * scale)


def test_chosen_nodes_keep_the_accuracy() -> None:
    fine = Magnets(nodes=48, **SIZES)
    lattice = all_words(len(SEQUENCE))
    exact = word_energies(Scene(sequence=SEQUENCE, magnets=fine), lattice)
    for accuracy in (1e-2, 1e-3, 1e-4):
        magnets = Magnets(accuracy=accuracy, **SIZES)
        found = word_energies(Scene(sequence=SEQUENCE, magnets=magnets), lattice)
        assert np.abs(found - exact).max() < accuracy * np.abs(exact).max()


@pytest.mark.parametrize("model", ["strips", "points", "strips by component", "equal sizes"])
def test_a_state_has_the_energy_of_its_headings(model: str) -> None:
    scene = Scene(sequence=SEQUENCE, magnets=MODELS[model])
    for state in minimise(scene, top=10).states:
        angles = headings(word_to_angles(state.word), first=0.7)
        assert state.energy == pytest.approx(mf.energy(scene, angles), rel=1e-11)
