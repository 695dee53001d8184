"""Tests that each law detects a fold that violates it."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from magfold_bench.laws.along_folds import Motion, follow
from magfold_bench.laws.dense import Judge, States
from magfold_bench.stress import laws, symmetries
from magfold_bench.stress.verdict import Verdict
from magfold_env.fold import Fold, FoldStatus
from magfold_env.scene import Rectangle, Scene
from magfold_env.shapes import headings

START = (0.03, -0.02, 0.01)
SCENE = Scene(sequence=("NSNS", "SNSN", "NSSN", "SSNN"), start_angles=START)
SLIDING = SCENE.replace(friction=0.0, duration=0.1)


@pytest.fixture(scope="module")
def ended() -> tuple[Motion, Fold]:
    motion, session = follow(SCENE)
    return motion, session.fold()


def broken(verdict: Verdict) -> set[str]:
    return {each.law for each in verdict.broken}


def limits(motion: Motion) -> set[str]:
    verdict = Verdict()
    laws.check_energies(motion, verdict)
    return broken(verdict)


def inside(motion: Motion) -> set[str]:
    """Return the laws that the states of a motion violate."""
    judge, verdict = Judge(motion.scene), Verdict()
    moving = motion.rates, motion.base, motion.base_velocity
    judge.look(States(motion.angles, *moving, motion.released))
    laws.check_inside(motion.scene, judge.worst, verdict)
    return broken(verdict)


def status(fold: Fold, motion: Motion) -> set[str]:
    verdict = Verdict()
    laws.check_status(fold, motion, verdict)
    return broken(verdict)


def test_sound_folds_keep_every_law() -> None:
    sound, sliding = laws.check(SCENE), laws.check(SLIDING)
    assert sound.broken == sliding.broken == []
    assert {"no penetration", "passivity", "rest again", "mirror", "other end"} < set(sound.worst)
    assert {"momentum", "angular momentum"} < set(sliding.worst)


def test_overlaps_and_joints_past_their_stops_are_found(ended: tuple[Motion, Fold]) -> None:
    motion, _ = ended
    angles = motion.angles.copy()
    angles[-1] = [0.0, 1.6, 3.2, 4.8]
    assert inside(motion) == set()
    assert {"no penetration", "joint stops"} <= inside(replace(motion, angles=angles))


def test_what_passes_a_thin_plate_between_looks_is_found(ended: tuple[Motion, Fold]) -> None:
    motion, _ = ended
    plate = Rectangle(position=(0.0, 0.05), size=(0.1, 2e-4))
    scene = SCENE.replace(obstacles=(plate,))
    base = motion.base.copy()
    base[-1] += [0.0, 0.1]
    assert inside(replace(motion, scene=scene)) == set()
    assert inside(replace(motion, scene=scene, base=base)) == {"no crossing"}
    base[-1] = motion.base[-1] + [0.0, 0.05]
    assert "no penetration" in inside(replace(motion, scene=scene, base=base))


def test_what_a_tube_holds_through_its_wall_is_found() -> None:
    feed: dict[str, Any] = {"speed": 0.3, "bore": 1.001 * SCENE.casing.diagonal}
    tube = SCENE.replace(mount="tube", feed=feed, start_angles=None).draw(np.random.default_rng(0))
    motion, _ = follow(tube)
    assert inside(motion) == set()
    # Component 4 is the last one inside.
    angles = motion.angles + np.array([0.0, 0.0, 0.0, 0.1])
    assert "held within the bore" in inside(replace(motion, angles=angles))


def test_energy_and_momentum_from_nowhere_are_found() -> None:
    motion, _ = follow(SLIDING)
    assert limits(motion) == set()
    potential = motion.potential.copy()
    potential[-1] += 0.02 * np.ptp(potential)
    assert "passivity" in limits(replace(motion, potential=potential))
    drift = motion.base_velocity + np.array([0.1, 0.0])
    assert "momentum" in limits(replace(motion, base_velocity=drift))
    assert "angular momentum" in limits(replace(motion, rates=motion.rates + 5.0))


def test_an_error_of_energy_must_shrink_with_the_tolerance(monkeypatch: Any) -> None:
    motion, session = follow(SLIDING)
    potential = motion.potential.copy()
    potential[-1] += 0.005 * np.ptp(potential)
    wrong = replace(motion, potential=potential)
    assert limits(wrong) == set()  # the finer run has none of it
    monkeypatch.setattr(laws, "follow", lambda _: (wrong, session))
    assert limits(wrong) == {"passivity", "energy account"}


def test_untrue_statuses_are_found(ended: tuple[Motion, Fold]) -> None:
    motion, fold = ended
    other = {FoldStatus.FOLDED: FoldStatus.MISFOLDED, FoldStatus.MISFOLDED: FoldStatus.FOLDED}
    assert status(fold, motion) == set()
    assert status(replace(fold, status=other[fold.status]), motion) == {"status"}
    assert status(replace(fold, word="SSS"), motion) == {"status"}
    assert status(replace(fold, steps=10**7), motion) == {"work cap"}
    early: dict[str, Any] = {"status": FoldStatus.UNSETTLED, "message": "still moving after 0.01 s"}
    assert status(replace(fold, **early), motion) == {"status"}
    capped = early | {"message": "stopped: 200000 steps are the limit"}
    assert status(replace(fold, **capped), motion) == {"status"}


@pytest.mark.parametrize("obstacles", [(), (Rectangle(position=(1, 1), size=(0.01, 0.01)),)])
def test_motion_that_is_told_to_be_rest_is_found(obstacles, ended):
    motion, fold = ended
    fold = replace(fold, scene=fold.scene.replace(obstacles=obstacles))
    rates = motion.rates.copy()
    rates[-1] = [0.0, 0.1, 0.0, 0.0]
    at_the_start = replace(fold, angles=headings(START))
    verdict = Verdict()
    laws.check_rest(at_the_start, replace(motion, rates=rates), verdict)
    assert broken(verdict) == {"rest", "energy", "rest again"}


def test_wrong_refusals_and_breakdowns_are_found(ended: tuple[Motion, Fold]) -> None:
    _, fold = ended
    closed = SCENE.replace(sequence=("NNNN",) * 5, start_angles=[math.pi / 2] * 4)
    failed = FoldStatus.FAILED
    for scene, message, how, law in (
        (closed, "folded at t = 1 s", FoldStatus.FOLDED, "refusal"),
        (SCENE, "components 1 and 4 overlap at the start", failed, "refusal"),
        (SCENE, "step size underflow", failed, "no breakdown"),
    ):
        verdict = Verdict()
        laws.check_refusal(scene, replace(fold, message=message, status=how), verdict)
        assert broken(verdict) == {law}


def test_a_fold_that_is_not_symmetric_or_changes_from_run_to_run_is_found(monkeypatch):
    # The mirror image of another chain.
    monkeypatch.setattr(symmetries, "mirrored", lambda scene: scene)
    verdict = laws.check(SCENE)
    assert broken(verdict) == {"mirror"}
    simulate = laws.simulate

    def another(scene: Scene) -> Fold:
        fold = simulate(scene)
        return replace(fold, angles=np.nextafter(fold.angles, 9.0))

    monkeypatch.setattr(laws, "simulate", another)
    assert "determinism" in broken(laws.check(SCENE))


def test_what_is_no_number_breaks_a_law() -> None:
    verdict = Verdict()
    verdict.bound("law", math.nan, 1.0)
    assert broken(verdict) == {"law"}
