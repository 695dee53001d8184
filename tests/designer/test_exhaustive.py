"""All sequences at once against one at a time."""

import numpy as np
import pytest

import magfold_env as mf
from magfold_env.designer import gap_designs
from magfold_env.designer.evidence import Rivals
from magfold_env.designer.exhaustive import Exhaustive
from tests.words import words

SCENE = mf.load_scene("design").replace(sequence=("NNNN",) * 4)
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
    best = found.best(tolerances)
    rivals = Rivals(SCENE, target, words(4))
    designable = np.flatnonzero(gaps > 1e-12)
    expected = [rivals.tolerances(signs_of(number)).min() for number in designable.tolist()]
    assert best is not None
    assert tolerances[best] == pytest.approx(max(expected), rel=1e-9)
    assert np.isneginf(np.delete(tolerances, designable)).all()


def test_the_best_gap_is_the_gap_design(every: tuple[str, Exhaustive]) -> None:
    target, found = every
    design = gap_designs(SCENE, [target])[target]
    number = found.best(found.gaps)
    assert design is not None
    assert number is not None
    assert mf.sequence_of(number, 4) == design.sequence


def test_good_ones_that_differ(every: tuple[str, Exhaustive]) -> None:
    _, found = every
    gaps = found.gaps
    numbers = found.spread_out(gaps, 5, apart=3)
    assert numbers[0] == np.argmax(gaps)
    assert len(numbers) == 5
    assert (np.diff(gaps[numbers]) <= 0).all()
    for k, one in enumerate(numbers):
        assert all((one ^ other).bit_count() >= 3 for other in numbers[:k])


def test_nothing_will_do() -> None:
    found = Exhaustive(SCENE, "LRL")
    assert found.best(np.zeros(2**15)) is None
    assert found.spread_out(np.zeros(2**15), 3, 1) == []
