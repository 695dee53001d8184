"""Rivals: energies above the target, and how much error of the magnets they bear."""

import numpy as np
import pytest

import magfold_env as mf
from magfold_env.designer.annealing import sequence_of_signs
from magfold_env.designer.evidence import Rivals, one_letter_off
from magfold_env.shapes import overlaps
from tests.words import words

SCENE = mf.load_scene("design").replace(sequence=("NNNN",) * 4)
TARGET = "LRL"


def test_energies_are_those_above_the_target() -> None:
    rng = np.random.default_rng(1)
    rivals = Rivals(SCENE, TARGET, ["LLR", "SSS"])
    for _ in range(5):
        signs = rng.choice([-1.0, 1.0], 16)
        states = mf.minimise(SCENE.replace(sequence=sequence_of_signs(signs)), top=1000).states
        energy = {state.word: state.energy for state in states}
        expected = [energy[word] - energy[TARGET] for word in ("LLR", "SSS")]
        np.testing.assert_allclose(rivals.energies(signs), expected, rtol=1e-9, atol=1e-15)


def test_words_are_added_once_and_the_target_never() -> None:
    rivals = Rivals(SCENE, TARGET, ["LLR"])
    assert not rivals.add(["LLR", TARGET])
    assert rivals.add(["SSS", "SSS"])
    assert rivals.words == ["LLR", "SSS"]
    assert rivals.excess.shape == (2, 16, 16)


def test_a_tolerance_is_the_error_at_which_the_energy_varies_as_much_as_it_is() -> None:
    # Strengths of single faces are drawn; energies are bilinear in them, so that the slopes of
    # small errors give the deviation.
    rng = np.random.default_rng(2)
    signs = rng.choice([-1.0, 1.0], 16)
    rivals = Rivals(SCENE, TARGET, words(4))
    error = 1e-3
    drawn = signs * (1.0 + error * rng.standard_normal((40_000, 16)))
    energies = np.einsum("ka,mab,kb->km", drawn, rivals.excess, drawn, optimize=True)
    deviation = energies.std(axis=0)
    np.testing.assert_allclose(
        rivals.tolerances(signs), rivals.energies(signs) / deviation * error, rtol=0.03
    )


def test_strengths_of_the_scene_count() -> None:
    strong = SCENE.replace(magnets={"remanence": (1.2, 0.6, 0.6, 0.6)})
    signs = np.ones(16)
    assert Rivals(strong, TARGET, ["LLR"]).energies(signs) != pytest.approx(
        Rivals(SCENE, TARGET, ["LLR"]).energies(signs), rel=1e-3
    )


@pytest.mark.parametrize("target", ["L", "LRL", "LLLRL"])
def test_words_one_letter_off(target: str) -> None:
    found = one_letter_off(target)
    expected = [
        word
        for word in words(len(target) + 1)
        if sum(a != b for a, b in zip(word, target, strict=True)) == 1
    ]
    assert sorted(found) == sorted(expected)
    assert not any(overlaps(word) for word in found)
