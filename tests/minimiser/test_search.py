"""Tests of words and the minimiser against brute force, for the paper's sequences as well."""

from functools import cache
from typing import Literal

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import magfold_env as mf
from magfold_env.minimiser import Minimum, State, ground_state, minimise
from magfold_env.minimiser.lattice import all_words, from_words
from magfold_env.shapes import overlaps
from tests.minimiser import reference
from tests.minimiser.scenes import MODELS, scene_of, sequences


@pytest.mark.parametrize("n", [1, 2, 3, 5, 6, 7])
def test_all_words_without_overlap_in_the_order_slr(n: int) -> None:
    lattice = all_words(n)
    assert [lattice.word(row) for row in range(len(lattice))] == reference.words(n)


def test_cells_and_poses_are_centres_and_headings() -> None:
    words = ["LRSLR", "LLLLL", "SSSSS", "RSLSR"]
    lattice = from_words(words)
    for row, word in enumerate(words):
        centres, headings = reference.centres_and_headings(word, side=np.sqrt(2.0))
        np.testing.assert_allclose(lattice.cells[row], centres - centres[0], atol=1e-12)
        for i, j, poses in lattice.pairs():
            cos, sin = np.cos(headings[i]), np.sin(headings[i])
            seen = np.array([[cos, sin], [-sin, cos]]) @ (centres[j] - centres[i])
            np.testing.assert_allclose(poses[row, :2], seen, atol=1e-12)
            turned = (headings[j] - headings[i]) / (np.pi / 2) - poses[row, 2]
            assert turned / 4 == pytest.approx(round(turned / 4))


Feed = Literal["forward", "backward"]


@given(sequence=sequences(2, 4), model=st.sampled_from(sorted(MODELS)))
@settings(max_examples=15)
def test_full_search_is_brute_force(sequence: tuple[str, ...], model: str) -> None:
    scene = scene_of(sequence, model)
    expected = {word: reference.energy(scene, word) for word in reference.words(len(sequence))}
    found = minimise(scene, top=1000)
    assert {state.word for state in found.states} == set(expected)
    assert found.examined == len(expected)
    scale = max(abs(e) for e in expected.values())
    for state in found.states:
        assert state.energy == pytest.approx(expected[state.word], abs=1e-11 * scale)
        assert state.conflicts == reference.conflicts(sequence, state.word, scene.casing.side)
        assert state.fully_folded == ("S" not in state.word)
    energies = [state.energy for state in found.states]
    assert np.all(np.diff(energies) >= -1e-9 * scale)


@given(sequence=sequences(2, 6), mode=st.sampled_from(["forward", "backward"]))
@settings(max_examples=15)
def test_one_joint_at_a_time_with_all_components_acting(sequence, mode):
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
                energies[letter] = reference.energy(scene, word)
        assert [option.letter for option in decision.options] == list(energies)
        assert [o.energy for o in decision.options] == pytest.approx(
            list(energies.values()), rel=1e-9, abs=1e-14
        )
        least = min(energies.values())
        equal = [x for x, e in energies.items() if e <= least + 1e-12]
        assert [decision.letter, *decision.tied] == equal
        letters[decision.joint - 1] = decision.letter
    assert found.best.word == "".join(letters)


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


def test_long_chains_are_searched_by_branch_and_bound() -> None:
    scene = mf.Scene(sequence=("NSNS", "SNNN") * 7, magnets=mf.Magnets(nodes=2))
    found = minimise(scene, top=3)
    proved = ground_state(scene, top=3)
    assert found.states == proved.states
    assert len(found.states) == 3
    for mode in ("forward", "backward"):
        decided = minimise(scene, mode).best
        assert not overlaps(decided.word)
        assert decided.energy >= found.best.energy


STATES = {
    1: "LRLLL -26.6765; LRRRL -25.0128 4-5; RRLLL -26.5601; LRLLR -24.6627; RRLLR -24.5481",
    2: "LRLLL 0.9183; LRLRL 1.9552; LRRLL 2.0832; RRLLL 3.5892 1-2; LLRRL 4.5784 2-3",
    3: "LRLLL -16.8109; RRLLL -13.3066 1-2; LRLRL -12.9388 4-5; LRLLR -12.8806 5-6; "
    "LRRLL -12.2854 3-4",
}


@cache
def search(k: int, mode: str = "free", among: str = "all", top: int = 300) -> Minimum:
    scene = mf.load_scene(f"paper/sequence-{k}-literal")
    return minimise(scene, mode, top=top, among=among)  # pyright: ignore[reportArgumentType]


def states(k: int, among: str = "all") -> dict[str, State]:
    return {state.word: state for state in search(k, among=among).states}


@pytest.mark.parametrize("k", [1, 2, 3])
def test_the_five_lowest_folded_states_and_their_scores(k: int) -> None:
    expected = sorted((row.split() for row in STATES[k].split(";")), key=lambda row: float(row[1]))
    found = search(k, among="folded", top=5).states
    assert [state.word for state in found] == [row[0] for row in expected]
    for state, (_, score, *conflicts) in zip(found, expected, strict=True):
        assert round(state.coulomb_score * 1e3, 4) == float(score)
        assert ["{}-{}".format(*pair) for pair in state.conflicts] == conflicts
        assert state.fully_folded
        assert state.stable == (not conflicts)


def test_sequence_3_supports_one_stable_state() -> None:
    stable = search(3, among="stable").states
    assert [state.word for state in stable] == ["LRLLL"]
    assert search(3).best.word == stable[0].word
    assert stable[0].outline == states(1)["LRLLL"].outline
    assert {(4, 5), (3, 6)} <= set(stable[0].contacts)
