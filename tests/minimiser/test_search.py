"""The minimiser against brute force over positions in plain NumPy."""

from typing import Literal

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import magfold_env as mf
from magfold_env.minimiser import ground_state, minimise
from magfold_env.minimiser.energies import quadratic_forms, signs, word_energies
from magfold_env.minimiser.lattice import all_words, from_words
from magfold_env.scene import Magnets, Scene
from magfold_env.shapes import headings, word_to_angles
from tests.minimiser import reference
from tests.minimiser.scenes import MODELS, scene_of, sequences

Feed = Literal["forward", "backward"]


@given(sequence=sequences(2, 4), model=st.sampled_from(sorted(MODELS)))
@settings(max_examples=15)
def test_full_search_is_brute_force(sequence: tuple[str, ...], model: str) -> None:
    scene = scene_of(sequence, model)
    side, magnets = scene.casing.side, MODELS[model]
    expected = {
        word: reference.energy(sequence, word, side, magnets)
        for word in reference.words(len(sequence))
    }
    found = minimise(scene, top=1000)
    assert {state.word for state in found.states} == set(expected)
    assert found.examined == len(expected)
    scale = max(abs(e) for e in expected.values())
    for state in found.states:
        assert state.energy == pytest.approx(expected[state.word], abs=1e-11 * scale)
        assert state.conflicts == reference.conflicts(sequence, state.word, side)
        assert state.fully_folded == ("S" not in state.word)
    energies = [state.energy for state in found.states]
    assert np.all(np.diff(energies) >= -1e-9 * scale)


@pytest.mark.medium
@pytest.mark.parametrize("model", ["points", "strips"])
def test_full_search_of_six_components(model: str) -> None:
    rng = np.random.default_rng(6)
    words = reference.words(6)
    for _ in range(3):
        sequence = tuple("".join(rng.choice(["N", "S"], 4)) for _ in range(6))
        scene = scene_of(sequence, model)
        found = minimise(scene, top=3)
        expected = [reference.energy(sequence, w, 0.0125, MODELS[model]) for w in words]
        order = np.argsort(expected)[:3]
        assert [state.word for state in found.states] == [words[k] for k in order]
        assert [s.energy for s in found.states] == pytest.approx([expected[k] for k in order])


@given(sequence=sequences(2, 6), mode=st.sampled_from(["forward", "backward"]))
@settings(max_examples=15)
def test_one_joint_at_a_time_with_all_components_acting(
    sequence: tuple[str, ...], mode: Feed
) -> None:
    scene = scene_of(sequence, "points")
    found = minimise(scene, mode)
    letters = ["S"] * (len(sequence) - 1)
    joints = list(range(len(letters)))
    assert [d.joint - 1 for d in found.decisions] == (joints if mode == "forward" else joints[::-1])
    for decision in found.decisions:
        energies: dict[str, float] = {}
        for letter in "SLR":
            letters[decision.joint - 1] = letter
            if not reference.overlaps("".join(letters), 1.0):
                word = "".join(letters)
                energies[letter] = reference.energy(sequence, word, 0.0125, MODELS["points"])
        assert [option.letter for option in decision.options] == list(energies)
        assert [o.energy for o in decision.options] == pytest.approx(
            list(energies.values()), rel=1e-9, abs=1e-14
        )
        least = min(energies.values())
        equal = [x for x, e in energies.items() if e <= least + 1e-12]
        assert [decision.letter, *decision.tied] == equal
        letters[decision.joint - 1] = decision.letter
    assert found.best.word == "".join(letters)


def test_the_energy_is_a_quadratic_form_in_the_signs() -> None:
    sequence = mf.load_scene("paper/sequence-2").sequence
    scene = scene_of(sequence, "strips")
    lattice = all_words(6)
    form = quadratic_forms(scene, lattice)
    s = signs(sequence).ravel()
    np.testing.assert_allclose(
        np.einsum("a,wab,b->w", s, form, s), word_energies(scene, lattice), rtol=1e-11
    )
    np.testing.assert_array_equal(form, form.transpose(0, 2, 1))
    for k in range(0, 24, 4):
        assert not form[:, k : k + 4, k : k + 4].any(), "faces of one component do not couple"


@pytest.mark.parametrize("name", ["paper/sequence-1", "paper/sequence-3-literal"])
def test_a_state_has_the_energy_of_its_headings(name: str) -> None:
    scene = mf.load_scene(name)
    for state in minimise(scene, top=20).states:
        angles = headings(word_to_angles(state.word), first=0.7)
        assert state.energy == pytest.approx(mf.energy(scene, angles), rel=1e-12)


def test_ties_are_reported_and_broken_in_the_order_slr() -> None:
    # Its own mirror image: mirrored words have equal energies.
    scene = scene_of(("NSSN",) * 3, "strips")
    states = {state.word: state for state in minimise(scene, top=9).states}
    assert states["LL"].tied == ("RR",)
    assert states["RR"].tied == ("LL",)
    words = list(states)
    assert words.index("LL") + 1 == words.index("RR")
    first = minimise(scene, "forward").decisions[0]
    assert (first.letter, first.tied) == ("L", "R")


def test_without_magnets_everything_ties() -> None:
    found = minimise(Scene(sequence=("NNNN",) * 3, magnets=None), top=2)
    assert [state.word for state in found.states] == ["SS", "SL"]
    assert len(found.states[0].tied) == 8
    assert found.best.energy == 0.0


def test_a_single_component_has_one_state() -> None:
    for mode in ("free", "forward", "backward"):
        found = minimise(scene_of(("NSNS",), "strips"), mode)
        assert found.best.word == ""
        assert found.best.energy == 0.0


def test_no_stable_state_is_no_error_until_it_is_asked_for() -> None:
    found = minimise(scene_of(("NNNN",) * 3, "points"), among="stable")
    assert found.states == ()
    with pytest.raises(ValueError, match="no state"):
        _ = found.best


def test_long_chains_are_searched_by_branch_and_bound() -> None:
    scene = Scene(sequence=("NSNS", "SNNN") * 7, magnets=Magnets(nodes=2))
    found = minimise(scene, top=3)
    proved = ground_state(scene, top=3)
    assert proved.proved
    assert found.states == proved.states
    assert len(found.states) == 3
    for mode in ("forward", "backward"):
        decided = minimise(scene, mode).best
        assert not from_words([decided.word]).overlapping()[0]
        assert decided.energy >= found.best.energy


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"mode": "sideways"}, "mode: 'sideways' is not allowed; must be one of free, forward"),
        ({"among": "some"}, "among: 'some' is not allowed; must be one of all, folded, stable"),
        ({"top": 0}, "top: 0 is not allowed; must be from 1 to 10000000"),
    ],
)
def test_wrong_arguments_are_named(changes: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        minimise(scene_of(("NSNS",) * 2, "points"), **changes)  # pyright: ignore[reportArgumentType]
