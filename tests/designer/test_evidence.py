"""Tests of rivals of a target, exhaustive search, annealing, and sequences that hold a target."""

from collections import Counter
from itertools import product
from typing import Any

import numpy as np
import pytest

import magfold_env as mf
from magfold_env.designer import gap_designs
from magfold_env.designer.annealing import anneal, anneal_sequence, sequence_of_signs, stable_groups
from magfold_env.designer.evidence import Rivals, one_letter_off
from magfold_env.designer.exhaustive import Exhaustive
from magfold_env.shapes import folded_words, overlaps
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


NUMBERS = np.random.default_rng(0).integers(2**15, size=12).tolist()


@pytest.fixture(scope="module", params=["LRL", "LSR", pytest.param("LLR", marks=pytest.mark.slow)])
def every(request: pytest.FixtureRequest) -> tuple[str, Exhaustive]:
    return request.param, Exhaustive(SCENE, request.param)


def scene_of(number: int) -> mf.Scene:
    return SCENE.replace(sequence=mf.sequence_of(number, 4))


def signs_of(number: int) -> np.ndarray:
    letters = "".join(mf.sequence_of(number, 4))
    return np.array([1.0 if letter == "N" else -1.0 for letter in letters])


@pytest.mark.medium
def test_gaps(every: tuple[str, Exhaustive]) -> None:
    target, found = every
    gaps = found.gaps
    assert gaps.shape == (2**15,)
    for number in NUMBERS:
        states = mf.minimise(scene_of(number), top=100).states
        own = next(state.energy for state in states if state.word == target)
        others = min(state.energy for state in states if state.word != target)
        assert gaps[number] == pytest.approx(others - own, rel=1e-9, abs=1e-12)


def test_only_stable_words(every: tuple[str, Exhaustive]) -> None:
    target, found = every
    only = found.only_stable()
    likely = np.flatnonzero(only)[:5].tolist()
    for number in [*NUMBERS, *likely]:
        stable = mf.minimise(scene_of(number), among="stable", top=100).states
        assert only[number] == ([state.word for state in stable] == [target])
    assert ("S" in target) == (not likely)


def test_the_largest_tolerance(every: tuple[str, Exhaustive]) -> None:
    target, found = every
    gaps, tolerances = found.gaps, found.tolerances()
    best: Any = found.best(tolerances)
    rivals = Rivals(SCENE, target, words(4))
    designable = np.flatnonzero(gaps > 1e-12)
    expected = [rivals.tolerances(signs_of(number)).min() for number in designable.tolist()]
    assert tolerances[best] == pytest.approx(max(expected), rel=1e-9)
    assert np.isneginf(np.delete(tolerances, designable)).all()


THREE = mf.load_scene("design").replace(sequence=("NNNN",) * 3)
SHORT = "LR"
ALL = Rivals(THREE, SHORT, words(3))


def run(tolerant: bool, groups: list[list[int]], steps: int, hot: float, seed: int):
    rng = np.random.default_rng(seed)
    signs = rng.choice([-1.0, 1.0], 12)
    started = signs.copy()
    score = anneal(
        ALL.excess, np.concatenate([np.array(group, dtype=np.int64) for group in groups]),
        np.cumsum([0, *map(len, groups)]), rng.integers(len(groups), size=steps), rng.random(steps),
        np.geomspace(hot, hot / 100, steps), tolerant, signs,
    )  # fmt: skip
    return started, signs, score


SINGLE = [[face] for face in range(12)]
BLOCKS = [[0, 5], [1, 2, 3], [4], [6, 7, 8, 11], [9, 10]]


@pytest.mark.parametrize("tolerant", [False, True])
@pytest.mark.parametrize("groups", [SINGLE, BLOCKS])
def test_the_score_is_that_of_the_signs(tolerant: bool, groups: list[list[int]]) -> None:
    score_all = ALL.tolerances if tolerant else ALL.energies
    for seed in range(10):
        started, signs, score = run(tolerant, groups, 50, 1e-3 if not tolerant else 0.3, seed)
        assert score == pytest.approx(score_all(signs).min(), rel=1e-9, abs=1e-15)
        assert score >= score_all(started).min() - 1e-15
        for group in groups:
            assert len(set((started * signs)[group])) == 1  # they flip as one


@pytest.mark.parametrize("tolerant", [False, True])
def test_the_best_of_all_is_found(tolerant: bool) -> None:
    score_all = ALL.tolerances if tolerant else ALL.energies
    every = [np.array([1.0, *rest]) for rest in product([-1.0, 1.0], repeat=11)]
    best = max(score_all(signs).min() for signs in every)
    found = max(run(tolerant, SINGLE, 5000, 1e-2 if not tolerant else 1.0, s)[2] for s in range(3))
    assert found == pytest.approx(best, rel=1e-9)


@pytest.mark.parametrize("target", ["LLRL", "LRLR", "SLRL"])
def test_a_gap_is_exact_and_near_the_largest(target: str) -> None:
    scene = THREE.replace(sequence=("NNNN",) * 5)
    deepest: Any = gap_designs(scene, [target])[target]
    best, next_best = mf.minimise(scene.replace(sequence=deepest), top=2).states
    assert best.word == target
    gap = next_best.energy - best.energy
    calls: Counter[str] = Counter()
    rng = np.random.default_rng(0)
    found = max((anneal_sequence(scene, target, rng, calls) for _ in range(3)), key=lambda a: a[1])
    lowest, second = mf.minimise(scene.replace(sequence=found.sequence), top=2).states
    assert lowest.word == target
    assert found.score == pytest.approx(second.energy - lowest.energy, rel=1e-9)
    assert 0.9 * gap <= found.score <= gap * (1 + 1e-9)
    assert calls["ground states"] >= 3


SIX = mf.load_scene("design")


def stable_words(sequence: tuple[str, ...]) -> list[str]:
    scene = SIX.replace(sequence=sequence)
    return [state.word for state in mf.minimise(scene, among="stable", top=100).states]


@pytest.mark.parametrize("n", [2, 3, 4, 5, 6])
def test_the_target_is_the_only_stable_word_whatever_is_flipped(n: int) -> None:
    rng = np.random.default_rng(n)
    for target in folded_words(n):
        signs, groups = stable_groups(target)
        assert sorted(np.concatenate(groups).tolist()) == list(range(4 * n))
        for group in groups:
            signs[group] *= rng.choice([-1.0, 1.0])
        assert stable_words(sequence_of_signs(signs)) == [target]


@pytest.mark.parametrize("n", [8, *(pytest.param(n, marks=pytest.mark.slow) for n in (12, 16))])
def test_every_word_can_be_held(n: int) -> None:
    for target in folded_words(n):
        stable_groups(target)
