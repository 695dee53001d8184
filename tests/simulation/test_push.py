"""What the feed pushes with: against drag alone, at its largest, and at its limit."""

from typing import Any

import numpy as np
import pytest

import magfold_env as mf
from magfold_env.simulation.session import Session

OWN = mf.Scene(
    sequence=("SNNS", "NNSN", "SSSN", "NNNS", "SSSS", "NNSN"),
    casing=mf.Casing(side=0.010, mass=0.0021),
    magnets=mf.Magnets(remanence=1.30, width=0.005, height=0.005, thickness=0.002, inset=0.0005),
    mount="tube",
    feed=mf.Feed(direction="backward", speed=0.03),
    friction=0.2,
)


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
    fold = mf.simulate(scene, frame_rate=1000.0)
    assert fold.trajectory is not None
    # The first frame holds the start, the last one ends within a millisecond.
    push = fold.trajectory.push[1:-1]
    assert push[np.abs(push).argmax()] == pytest.approx(fold.push_peak, rel=1e-6)


def there_and_back(seed: int, limit: float | None) -> mf.Scene:
    """A chain that is pulled back from far outside, where it often wedges in the mouth."""
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


def straight(**changes: Any) -> mf.Scene:
    sequence = ("NNNS", "NSSS", "NNNS", "SSNN", "SNNN", "SSSN")
    scene = mf.load_scene("tube-built").replace(sequence=sequence, start_angles=(0.0,) * 5)
    return scene.replace(**changes)


@pytest.mark.parametrize("direction", ["forward", "backward"])
def test_to_push_a_straight_chain_takes_the_drag_of_what_is_outside(direction: str) -> None:
    scene = straight(magnets=None, feed={"direction": direction})
    session = Session(scene)
    drag = scene.frictions[0] * scene.gravity.normal * scene.masses[0]
    assert session.push_force() == 0.0
    pushes = 0
    while session.released < session.n - 1:
        session.push(np.full(6, 0.1), 0.013)
        if session.released > 0 and session.push_force() != 0.0:
            assert session.push_force() == pytest.approx(drag * session.released)
            pushes += 1
    assert pushes > 10


def test_to_measure_a_force_changes_nothing() -> None:
    sessions = [Session(straight(start_angles=(0.01,) * 5)) for _ in range(2)]
    for _ in range(40):
        for session in sessions:
            session.push(np.full(6, 0.2), 0.02)
        sessions[0].push_force()
        np.testing.assert_array_equal(sessions[0].angles, sessions[1].angles)
        np.testing.assert_array_equal(sessions[0].rates, sessions[1].rates)
