"""Tests of races and the cross-entropy method on known probabilities, and of short releases."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import magfold_env as mf
from magfold_env.designer.task import Choice
from magfold_env.designer.trials import (
    ELITE,
    FINAL,
    POPULATION,
    RELEASES,
    cross_entropy,
    hurried,
    successive_halving,
)
from magfold_env.ensembles.releases import release


class Known:
    """Trials of choices with known probabilities; each release has its own threshold."""

    def __init__(self, probability: Callable[[Choice], float], seed: int = 0) -> None:
        self.probability = probability
        self.threshold = np.random.default_rng(seed).random(1000)
        self.asked: set[tuple[Choice, int]] = set()

    @property
    def count(self) -> int:
        return len(self.asked)

    def scores(self, choices: Sequence[Choice], draws: int) -> npt.NDArray[np.float64]:
        self.asked |= {(choice, draw) for choice in choices for draw in range(draws)}
        rates = np.array([self.probability(choice) for choice in choices])
        success = self.threshold[:draws] < rates[:, None]
        return np.where(success, 1.0, 0.4 * rates[:, None])


def named(k: int) -> Choice:
    return Choice((f"{k:04b}".replace("0", "N").replace("1", "S"),), None)


def test_the_best_goes_furthest() -> None:
    rates = {named(k): k / 16 for k in range(16)}
    trials = Known(rates.__getitem__)
    ranks = successive_halving([named(k) for k in range(16)], trials, enough=0.5)
    assert ranks[0].choice in {named(k) for k in (13, 14, 15)}
    assert [evaluation.releases for evaluation in ranks] == [40, 12, 12, 12, *[4] * 8, *[1] * 4]
    assert trials.count == 16 + 12 * 3 + 4 * 8 + 28
    assert sorted(evaluation.choice for evaluation in ranks) == sorted(rates)
    order = [(-each.releases, -each.successes, -each.mean) for each in ranks]
    assert order == sorted(order)


def test_finalists_follow_each_other_until_one_does() -> None:
    later = 12  # releases that none fails before

    class Late(Known):
        def scores(self, choices: Sequence[Choice], draws: int) -> npt.NDArray[np.float64]:
            scores = super().scores(choices, draws)
            fails = [choice != named(2) for choice in choices]
            scores[fails, later:] = 0.0
            return scores

    trials = Late(lambda _: 1.0)
    ranks = successive_halving([named(k) for k in range(4)], trials, enough=0.9)
    assert [evaluation.choice for evaluation in ranks[:2]] == [named(2), named(0)]
    assert [evaluation.rate for evaluation in ranks] == [1.0, 0.3, 0.3, 1.0]
    assert [evaluation.releases for evaluation in ranks] == [FINAL] * 3 + [later]


@pytest.mark.parametrize(("failures", "releases"), [(4, FINAL), (5, 12)])
def test_a_finalist_goes_on_while_it_may_do_well_enough(failures: int, releases: int) -> None:
    trials = Known(lambda _: 0.5)
    trials.threshold = np.where(np.arange(FINAL) < failures, 0.9, 0.1)
    (evaluation,) = successive_halving([named(3)], trials, enough=0.9)
    assert evaluation.releases == releases


GOOD = ("NSSN", "SSNN", "NSNS")


def likeness(choice: Choice) -> float:
    """Return the share of faces that agree with GOOD, reduced for speeds far from 0.1 m/s."""
    pairs = zip("".join(choice.sequence), "".join(GOOD), strict=True)
    alike = np.mean([a == b for a, b in pairs])
    if choice.speed is None:
        return float(alike)
    return float(alike * np.exp(-0.5 * np.log(choice.speed / 0.1) ** 2))


@pytest.mark.parametrize("speeds", [(), (0.01, 0.5)])
def test_cross_entropy_finds_what_nothing_points_to(speeds: tuple[float, ...]) -> None:
    rng = np.random.default_rng(0)
    found = cross_entropy(Known(likeness), 12, speeds, rng, budget=6000)
    assert found[0].choice.sequence == GOOD
    if speeds:
        speed: Any = found[0].choice.speed
        assert 0.05 < speed < 0.2


def test_cross_entropy_keeps_to_its_budget_and_its_speeds() -> None:
    trials = Known(lambda _: 0.5)
    found = cross_entropy(trials, 8, (0.02, 0.3), np.random.default_rng(1), budget=600)
    one = POPULATION * RELEASES + (ELITE + 2) * 40
    assert 600 - POPULATION * RELEASES < trials.count < 600 + one
    few = Known(lambda _: 0.5)
    assert cross_entropy(few, 8, (0.02, 0.3), np.random.default_rng(1), budget=1)
    assert few.count < one
    assert all(0.02 <= (evaluation.choice.speed or 0.0) <= 0.3 for evaluation in found)


SCENE = release(mf.load_scene("design"), "forward")


def test_haste_changes_no_fold_and_knows_length_tolerance_and_cap() -> None:
    design: Any = mf.design("LRR", runs=0)
    patient, hasty = mf.simulate(design.scene, 3), mf.simulate(hurried(design.scene), 3)
    assert patient.status is hasty.status is mf.FoldStatus.FOLDED
    np.testing.assert_array_equal(hasty.angles, patient.angles)
    assert hasty.steps == patient.steps

    def pace(**changes: object) -> int:
        return hurried(SCENE.replace(**changes)).solver.max_steps_per_second

    usual = pace()
    assert usual < SCENE.solver.max_steps_per_second
    assert abs(pace(sequence=SCENE.sequence * 2) - 2 * usual) <= 1
    assert abs(pace(solver={"tolerance": 1e-9}) - 10 * usual) <= 5
    assert pace(solver={"max_steps_per_second": 7}) == 7
