"""The paper's three sequences in its own model: Table 1, the states and their energies."""

from functools import cache

import numpy as np
import pytest

import magfold_env as mf
from magfold_env.minimiser import Minimum, State, minimise
from magfold_env.shapes import outline
from tests.words import reverse

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


@pytest.mark.parametrize(
    ("k", "forward", "backward"),
    [(1, "LRLLL", "LRLLR"), (2, "LRLRL", "LRLRL"), (3, "LRLLL", "LRLLL")],
)
@pytest.mark.parametrize("suffix", ["", "-literal"])
def test_table_1(k: int, forward: str, backward: str, suffix: str) -> None:
    scene = mf.load_scene(f"paper/sequence-{k}{suffix}")
    for mode, word in (("forward", forward), ("backward", backward)):
        found = minimise(scene, mode)  # pyright: ignore[reportArgumentType]
        assert found.best.word == word
        assert found.best.stable


@pytest.mark.medium
def test_sequence_1_global_minimum_and_what_lies_below_s1c() -> None:
    s1c = states(1)["LRLLR"]
    assert search(1).best.word == search(1, "forward").best.word == "LRLLL"
    below = {w: s for w, s in states(1, "folded").items() if s.energy < s1c.energy}
    assert [w for w, state in below.items() if state.stable] == ["LRLLL", "RRLLL"]
    assert [w for w, state in below.items() if not state.stable] == ["LRRRL"]
    assert below["LRRRL"].conflicts == ((4, 5),)
    assert s1c.outline != below["LRLLL"].outline


def test_sequence_2_global_minimum_is_not_where_the_feeds_go() -> None:
    folded = states(2, "folded")
    s2a, s2b = folded["LRLLL"], folded["LRLRL"]
    assert search(2).best.word == s2a.word
    others = [len(s.contacts) for w, s in folded.items() if s.stable and w != s2a.word]
    assert len(s2a.contacts) == max(others) + 1
    assert (3, 6) in s2a.contacts
    assert (3, 6) not in s2b.contacts
    cells = np.array(s2b.outline)
    assert np.linalg.matrix_rank(cells - cells[0]) == 1, "S2B is a straight line"
    assert all(state.coulomb_score > 0 for state in folded.values())


def test_sequence_3_supports_one_stable_state() -> None:
    stable = search(3, among="stable").states
    assert [state.word for state in stable] == ["LRLLL"]
    assert search(3).best.word == stable[0].word
    assert stable[0].outline == states(1)["LRLLL"].outline
    assert {(4, 5), (3, 6)} <= set(stable[0].contacts)


def test_thirteen_outlines_each_covered_by_two_words() -> None:
    folded = states(1, "folded")
    words_of: dict[object, list[str]] = {}
    for word, state in folded.items():
        assert state.outline == outline(word)
        words_of.setdefault(state.outline, []).append(word)
    assert len(words_of) == 13
    assert all(reverse(first) == second for first, second in words_of.values())
