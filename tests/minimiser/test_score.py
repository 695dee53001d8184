"""The energy inside components, against sums over pairs and numerical integrals."""

from typing import Any

import pytest

from magfold_env.minimiser import minimise
from magfold_env.minimiser.energies import internal_energy
from magfold_env.scene import Magnets, Scene
from tests.minimiser import reference
from tests.minimiser.scenes import MODELS

SEQUENCE = ("NSNN", "S-SS", "NN-S")


UNEQUAL: dict[str, Any] = {
    "width": (0.005, 0.003, 0.006, 0.004),
    "height": (0.004, 0.009, 0.001, 0.006),
    "thickness": (0.001, 0.002, 0.0025, 0.001),
    "inset": (0.0005, 0.0001, 0.0004, 0.001),
    "remanence": tuple((1.0 + k, 0.6, 0.5, 0.9 + k) for k in range(3)),
}
KINDS = MODELS | {
    "unequal strips": Magnets(nodes=4, **UNEQUAL),
    "unequal points": Magnets(model="points", nodes=4, **UNEQUAL),
}


@pytest.mark.parametrize("model", [*KINDS])
def test_internal_energy_counts_every_pair_of_charges_once(model: str) -> None:
    magnets = KINDS[model]
    scene = Scene(sequence=SEQUENCE, magnets=magnets)
    expected = reference.own_energy(SEQUENCE, magnets)
    expected += reference.internal_energy(SEQUENCE, scene.casing.side, magnets)
    assert internal_energy(scene) == pytest.approx(expected, rel=1e-10)


def test_without_a_number_of_nodes_it_is_as_good_as_exact() -> None:
    scene = Scene(sequence=SEQUENCE)
    fine = internal_energy(scene.replace(magnets={"nodes": 64}))
    assert internal_energy(scene) == pytest.approx(fine, rel=1e-4)
    assert internal_energy(scene.replace(magnets={"nodes": 32})) == internal_energy(scene)


def test_components_without_magnets_have_no_energy() -> None:
    assert internal_energy(Scene(sequence=("----",) * 2)) == 0.0


def test_the_score_differs_from_the_energy_by_a_constant_of_the_sequence() -> None:
    scene = Scene(sequence=SEQUENCE, magnets=MODELS["points"])
    internal = internal_energy(scene)
    for state in minimise(scene, top=9).states:
        assert state.coulomb_score - state.energy == pytest.approx(internal)


def test_no_magnets_no_energy() -> None:
    assert internal_energy(Scene(sequence=SEQUENCE, magnets=None)) == 0.0
