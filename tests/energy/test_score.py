"""The energy inside components, against sums over pairs and numerical integrals."""

import pytest

from magfold_env.energy import minimise
from magfold_env.energy.score import internal_energy
from magfold_env.scene import Scene
from tests.energy import reference
from tests.energy.scenes import MODELS

SEQUENCE = ("NSNN", "SSSS", "NNSS")


@pytest.mark.parametrize("model", [*MODELS])
def test_internal_energy_counts_every_pair_of_charges_once(model: str) -> None:
    magnets = MODELS[model]
    scene = Scene(sequence=SEQUENCE, magnets=magnets)
    expected = reference.own_energy(SEQUENCE, magnets)
    expected += reference.internal_energy(SEQUENCE, scene.casing.side, magnets)
    assert internal_energy(scene) == pytest.approx(expected, rel=1e-10)


def test_the_score_differs_from_the_energy_by_a_constant_of_the_sequence() -> None:
    scene = Scene(sequence=SEQUENCE, magnets=MODELS["points"])
    internal = internal_energy(scene)
    for state in minimise(scene, top=9).states:
        assert state.coulomb_score - state.energy == pytest.approx(internal)


def test_no_magnets_no_energy() -> None:
    assert internal_energy(Scene(sequence=SEQUENCE, magnets=None)) == 0.0
