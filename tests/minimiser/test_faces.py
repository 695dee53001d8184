"""Energies with faces left empty and strengths that differ by face and component."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from magfold_env.minimiser import minimise
from magfold_env.minimiser.energies import quadratic_forms, signs, strengths, word_energies
from magfold_env.minimiser.lattice import all_words, from_words
from magfold_env.scene import Magnets, Scene
from magfold_env.shapes import mirror
from tests.minimiser import reference
from tests.minimiser.scenes import STRENGTHS, scene_of, sequences
from tests.words import reverse

SIDE = 0.0125


@st.composite
def scenes(draw: st.DrawFn) -> Scene:
    """Draw scenes with a strength for every single face, and empty faces."""
    sequence = draw(sequences(2, 5))
    kind: dict[str, Any] = draw(st.sampled_from([{"nodes": 4}, {"model": "points"}]))
    row = st.tuples(*[st.floats(0.1, 1.4)] * 4)
    rows = draw(st.tuples(*[row] * len(sequence)))
    return Scene(sequence=sequence, magnets=Magnets(**kind, remanence=rows))


@pytest.mark.medium
@given(scenes())
@settings(max_examples=20)
def test_word_energies_are_sums_over_charges(scene: Scene) -> None:
    assert scene.magnets is not None
    lattice = all_words(scene.n)
    expected = [
        reference.energy(scene.sequence, lattice.word(row), SIDE, scene.magnets)
        for row in range(len(lattice))
    ]
    scale = np.abs(expected).max()
    np.testing.assert_allclose(word_energies(scene, lattice), expected, rtol=0, atol=1e-11 * scale)


@given(scenes())
@settings(max_examples=20)
def test_the_energy_is_a_quadratic_form_in_signs_with_zeros(scene: Scene) -> None:
    lattice = all_words(scene.n)
    form = quadratic_forms(scene, lattice)
    np.testing.assert_array_equal(form, form.transpose(0, 2, 1))
    s = signs(scene.sequence).ravel()
    found = np.einsum("a,wab,b->w", s, form, s)
    energies = word_energies(scene, lattice)
    # Single couplings may cancel: they are the scale of rounding.
    np.testing.assert_allclose(found, energies, rtol=0, atol=1e-12 * np.abs(form).max())
    # The form holds how strong magnets are, the signs which there are.
    other = scene.replace(sequence=("NNNN",) * scene.n)
    np.testing.assert_array_equal(quadratic_forms(other, lattice), form)


@given(sequence=sequences(2, 4), model=st.sampled_from(sorted(STRENGTHS)))
@settings(max_examples=15)
def test_full_search_is_brute_force(sequence: tuple[str, ...], model: str) -> None:
    scene = scene_of(sequence, model)
    states = minimise(scene, top=1000).states
    expected = {
        w: reference.energy(sequence, w, SIDE, STRENGTHS[model])
        for w in reference.words(len(sequence))
    }
    assert {state.word for state in states} == set(expected)
    scale = max(map(abs, expected.values()))
    for state in states:
        assert state.energy == pytest.approx(expected[state.word], abs=1e-11 * scale)
        assert state.conflicts == reference.conflicts(sequence, state.word, SIDE)


def test_an_empty_face_is_at_odds_with_none() -> None:
    whole = minimise(Scene(sequence=("NNNN",) * 3), top=50, among="folded").states
    assert all(state.conflicts for state in whole)
    none = minimise(Scene(sequence=("----", "NNNN", "----")), top=50, among="folded").states
    assert not any(state.conflicts for state in none)
    assert {state.word for state in none} == {state.word for state in whole}
    assert all(state.stable and state.energy == 0.0 for state in none)


def test_signs_and_strengths() -> None:
    scene = scene_of(("NS-N", "----"), "points by face")
    np.testing.assert_array_equal(signs(scene.sequence), [[1, -1, 0, 1], [0, 0, 0, 0]])
    np.testing.assert_allclose(strengths(scene), [[8.6 / 12, 4 / 12, 1, 0.5]] * 2)
    assert not strengths(scene.replace(magnets=None)).any()
    assert (strengths(Scene(sequence=("NNNN",))) == 1.0).all()


@pytest.mark.laws
@given(scenes())
@settings(max_examples=20)
def test_the_mirror_and_the_other_end(scene: Scene) -> None:
    assert scene.magnets is not None
    rows = np.array(scene.magnets.remanence)
    lattice = all_words(scene.n)
    words = [lattice.word(row) for row in range(len(lattice))]
    here = word_energies(scene, lattice)
    images = {
        mirror: scene.replace(
            sequence=[faces[::-1] for faces in scene.sequence],
            magnets={"remanence": rows[:, ::-1]},
        ),
        reverse: scene.replace(
            sequence=[faces[2:] + faces[:2] for faces in reversed(scene.sequence)],
            magnets={"remanence": np.roll(rows[::-1], 2, axis=1)},
        ),
    }
    for image, other in images.items():
        there = word_energies(other, from_words([image(word) for word in words]))
        np.testing.assert_allclose(there, here, rtol=0, atol=1e-12 * np.abs(here).max())


@pytest.mark.laws
def test_the_energy_is_linear_in_the_strengths_of_one_component() -> None:
    rng = np.random.default_rng(2)
    scene = Scene(sequence=("NS-N", "SSNN", "N-SN"))
    lattice = all_words(3)
    rows = rng.uniform(0.2, 1.0, (3, 4))

    def energies(factor: float) -> np.ndarray:
        changed = rows * np.array([1.0, factor, 1.0])[:, None]
        return word_energies(scene.replace(magnets={"remanence": changed}), lattice)

    one, two, three = (energies(factor) for factor in (1.0, 2.0, 3.0))
    np.testing.assert_allclose(three - two, two - one, rtol=0, atol=1e-12 * np.abs(one).max())


@pytest.mark.parametrize("mode", ["free", "forward", "backward"])
def test_a_field_is_refused(mode: Any) -> None:
    scene = Scene(sequence=("NSNS",) * 3)
    acting = scene.replace(field={"uniform": (0.0, 1e-3)})
    with pytest.raises(ValueError, match=r"^field: .* is not allowed; energy minimisation does"):
        minimise(acting, mode)
    still = scene.replace(field={"uniform": (0.0, 0.0)})
    assert minimise(still, mode) == minimise(scene, mode)
