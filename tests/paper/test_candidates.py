"""Candidates for the paper's sequences: the minimiser says of each what the text does."""

from functools import cache

import pytest

from magfold_bench.paper.candidates import LINE, Candidate, Candidates
from magfold_bench.paper.quoted import TABLE_1
from magfold_bench.paper.search import today
from magfold_env.minimiser import minimise
from magfold_env.scene import load_scene

SCENE = load_scene("paper/sequence-1-literal")
NUMBERS = [
    2,
    pytest.param(1, marks=pytest.mark.slow),
    pytest.param(3, marks=pytest.mark.slow),
]


@cache
def candidates(number: int) -> list[Candidate]:
    return Candidates(SCENE)(number)


@pytest.mark.medium
@pytest.mark.parametrize("number", NUMBERS)
def test_todays_sequences_are_among_them(number: int) -> None:
    (mine,) = [each for each in candidates(number) if each.sequence == today(number)]
    assert all(mine.energies.values())


@pytest.mark.medium
@pytest.mark.parametrize("number", NUMBERS)
def test_the_minimiser_agrees(number: int) -> None:
    found = candidates(number)
    assert len({each.sequence for each in found}) == len(found)
    for each in found[:: max(1, len(found) // 7)]:
        scene = SCENE.replace(sequence=each.sequence)
        states = minimise(scene, top=26, among="folded").states
        stable = [state for state in states if state.stable]
        assert states[0].stable
        assert frozenset(state.word for state in stable) == each.stable
        for state, letter in zip(stable, "ABC", strict=False):
            assert each.names[f"S{number}{letter}"] == state.word
        for direction, name in TABLE_1[number].items():
            assert minimise(scene, direction).best.word == each.names[name]
        if number == 1:
            words = [state.word for state in states]
            assert words[3] == each.names["S1C"]
            conflict = states[words.index(each.names["S1E"])].conflicts
            assert bool(conflict)
            assert each.energies["1 conflict"] == (conflict == ((4, 5),))
        if number == 2:
            assert each.names["S2B"] == LINE
            scores = [state.coulomb_score for state in stable[:3]]
            assert each.energies["2 positive"] == (min(scores) > 0.0)
