"""The annealing kernel against scores that are computed afresh, and its optimum by brute force."""

from collections import Counter
from itertools import product

import numpy as np
import pytest

import magfold_env as mf
from magfold_env.designer import gap_designs
from magfold_env.designer.annealing import anneal, anneal_sequence, sequence_of_signs
from magfold_env.designer.evidence import Rivals
from magfold_env.designer.exhaustive import Exhaustive
from tests.words import words

SCENE = mf.load_scene("design").replace(sequence=("NNNN",) * 3)
TARGET = "LR"
ALL = Rivals(SCENE, TARGET, words(3))


def run(tolerant: bool, groups: list[list[int]], steps: int, hot: float, seed: int):
    rng = np.random.default_rng(seed)
    signs = rng.choice([-1.0, 1.0], 12)
    started = signs.copy()
    score = anneal(
        ALL.excess,
        np.concatenate([np.array(group, dtype=np.int64) for group in groups]),
        np.cumsum([0, *map(len, groups)]),
        rng.integers(len(groups), size=steps),
        rng.random(steps),
        np.geomspace(hot, hot / 100, steps),
        tolerant,
        signs,
    )
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
    scene = SCENE.replace(sequence=("NNNN",) * 5)
    design = gap_designs(scene, [target])[target]
    assert design is not None
    calls: Counter[str] = Counter()
    rng = np.random.default_rng(0)
    found = max((anneal_sequence(scene, target, rng, calls) for _ in range(3)), key=lambda a: a[1])
    lowest, second = mf.minimise(scene.replace(sequence=found.sequence), top=2).states
    assert lowest.word == target
    assert found.score == pytest.approx(second.energy - lowest.energy, rel=1e-9)
    assert 0.9 * design.gap <= found.score <= design.gap * (1 + 1e-9)
    assert calls["ground states"] >= 3


def test_tolerances_are_near_the_largest() -> None:
    scene = SCENE.replace(sequence=("NNNN",) * 4)
    every = Exhaustive(scene, "LLR").tolerances()
    rng = np.random.default_rng(0)
    found = anneal_sequence(scene, "LLR", rng, Counter(), tolerant=True, stable=True)
    assert 0.9 * every.max() <= found.score <= every.max() * (1 + 1e-6)


def test_good_enough_ends_the_search() -> None:
    scene = SCENE.replace(sequence=("NNNN",) * 6)
    first, best = Counter[str](), Counter[str]()
    rng = np.random.default_rng(3)
    found = anneal_sequence(scene, "LLRRL", rng, first, good_enough=0.0)
    assert found.score > 0.0
    anneal_sequence(scene, "LLRRL", np.random.default_rng(3), best)
    assert first["ground states"] <= best["ground states"]


def test_the_first_face_is_north() -> None:
    assert sequence_of_signs(np.array([-1.0, 1.0, 1.0, -1.0])) == ("NSSN",)
    assert sequence_of_signs(np.array([1.0, 1.0, -1.0, 1.0] * 2)) == ("NNSN", "NNSN")
