"""Landscapes against brute force from positions and against the engine's forces."""

import numpy as np
import pytest

import magfold_env as mf
from magfold_env.minimiser import Landscape, sequence_of
from magfold_env.minimiser.energies import internal_energy, signs
from magfold_env.shapes import folded_words
from tests.minimiser import reference
from tests.minimiser.scenes import MODELS, scene_of

SIDE = 0.0125


def random_sequences(seed: int, count: int, n: int) -> list[tuple[str, ...]]:
    faces = np.random.default_rng(seed).choice(["N", "S"], (count, n, 4))
    return [tuple("".join(component) for component in each) for each in faces]


@pytest.fixture(scope="module")
def by_position() -> tuple[list[str], np.ndarray]:
    words = reference.words(6)
    return words, reference.forms(words, SIDE, MODELS["points"])


@pytest.mark.medium
def test_a_thousand_sequences_are_brute_force(by_position: tuple[list[str], np.ndarray]) -> None:
    words, forms = by_position
    sequences = random_sequences(1, 1000, 6)
    landscape = Landscape(scene_of(sequences[0], "points"))
    assert list(landscape.words) == words
    s = np.array([signs(each).ravel() for each in sequences])
    expected = np.einsum("ka,wab,kb->kw", s, forms, s, optimize=True)
    found = landscape.energies(sequences)
    np.testing.assert_allclose(found, expected, atol=1e-12 * np.abs(expected).max())
    np.testing.assert_array_equal(landscape.energies(signs_of(sequences)), found)
    np.testing.assert_array_equal(landscape.energies(), found[0])


def signs_of(sequences: list[tuple[str, ...]]) -> np.ndarray:
    return np.array([signs(each) for each in sequences])


def test_only_folded_words_on_request_and_scores_have_the_pairs_inside_components_in() -> None:
    scene = mf.load_scene("paper/sequence-1-literal")
    landscape = Landscape(scene, "folded")
    assert sorted(landscape.words) == folded_words(6)
    inside = landscape.coulomb_scores() - landscape.energies()
    assert inside == pytest.approx(np.full(26, internal_energy(scene)))


def test_sequences_are_numbered_in_alphabetical_order() -> None:
    names = [sequence_of(number, 2) for number in range(256)]
    assert names == sorted(names)
    assert len(set(names)) == 256
    assert names[5] == ("NNNN", "NSNS")


@pytest.mark.parametrize("n", [2, 3])
def test_every_sequence_is_each_one(n: int) -> None:
    landscape = Landscape(scene_of(("NNNN",) * n, "points"))
    numbers = range(1 << (4 * n - 1))
    expected = landscape.energies([sequence_of(number, n) for number in numbers])
    found = landscape.every_sequence()
    lowest = np.sort(expected, axis=1)
    scale = 1e-12 * np.abs(expected).max()
    np.testing.assert_allclose(found.energy, lowest[:, 0], atol=scale)
    np.testing.assert_allclose(found.gap, lowest[:, 1] - lowest[:, 0], atol=scale)
    unique = found.gap > found.tie
    np.testing.assert_array_equal(found.word[unique], expected.argmin(axis=1)[unique])
    assert sum(found.counts().values()) == unique.sum()
    for row, word in enumerate(landscape.words):
        np.testing.assert_allclose(landscape.every_energy(word), expected[:, row], atol=scale)


def test_a_chain_that_is_too_long_is_refused() -> None:
    scene = mf.load_scene("paper/sequence-1").replace(sequence=("NSNS",) * 13)
    with pytest.raises(ValueError, match=r"13 components are not allowed; .* at most 12"):
        Landscape(scene)
