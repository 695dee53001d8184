"""Tests of the feed's push: against drag, at its peak, and at its limit."""

from typing import Any

import numpy as np
import pytest

import magfold_env as mf

OWN = mf.Scene(
    sequence=("SNNS", "NNSN", "SSSN", "NNNS", "SSSS", "NNSN"),
    casing=mf.Casing(side=0.010, mass=0.0021),
    magnets=mf.Magnets(remanence=1.30, width=0.005, height=0.005, thickness=0.002, inset=0.0005),
    mount="tube", feed=mf.Feed(direction="backward", speed=0.03), friction=0.2,
)  # fmt: skip


def drawn(scene: mf.Scene, seed: int) -> mf.Scene:
    return scene.draw(np.random.default_rng(seed))


@pytest.mark.parametrize("seed", range(4))
def test_the_peak_does_not_depend_on_limits_that_are_not_met(seed: int) -> None:
    scene = drawn(OWN, seed)
    folds = [mf.simulate(scene.replace(feed={"force_limit": limit})) for limit in (20.0, 500.0)]
    assert abs(folds[0].push_peak) < 19.0
    assert folds[1].push_peak == pytest.approx(folds[0].push_peak, rel=0.05)


@pytest.mark.parametrize("direction", ["forward", "backward"])
@pytest.mark.parametrize("seed", range(3))
def test_the_peak_is_the_largest_mean_over_whole_milliseconds(seed: int, direction: str) -> None:
    scene = drawn(OWN.replace(feed={"direction": direction}), seed)
    fold: Any = mf.simulate(scene, frame_rate=1000.0)
    # The first frame holds the start, the last one ends within a millisecond.
    push = fold.trajectory.push[1:-1]
    assert push[np.abs(push).argmax()] == pytest.approx(fold.push_peak, rel=1e-6)


def there_and_back(seed: int, limit: float | None) -> mf.Scene:
    """Return a scene that pulls a chain back from far outside; it often jams in the mouth."""
    legs = {"advance": ((4.2, 0.05), (1.0, 0.05))}
    feed = {"force_limit": limit, "speed": 0.05, "schedule": legs}
    scene = mf.load_scene("paper/sequence-3").replace(mount="tube", friction=0.3, feed=feed)
    return drawn(scene, seed)


@pytest.mark.parametrize("seed", range(6))
def test_a_drive_without_a_limit_never_breaks_numbers_down(seed: int) -> None:
    fold = mf.simulate(there_and_back(seed, None))
    assert fold.status in {mf.FoldStatus.HELD, mf.FoldStatus.JAMMED}
    if fold.status is mf.FoldStatus.JAMMED:
        assert " touches the tube's " in fold.message
    assert abs(fold.push_peak) < 1e4


@pytest.mark.parametrize("direction", ["forward", "backward"])
def test_to_push_a_straight_chain_takes_the_drag_of_what_is_outside(direction: str) -> None:
    scene = mf.load_scene("tube-built").replace(
        sequence=("NNNS",) * 6, magnets=None, start_angles=(0.0,) * 5, feed={"direction": direction}
    )
    motion: Any = mf.simulate(scene, frame_rate=1000.0).trajectory
    drag = scene.frictions[0] * scene.gravity.normal * scene.masses[0]
    for count in range(1, 6):
        push = motion.push[motion.released == count]
        assert np.median(push) == pytest.approx(drag * count)
