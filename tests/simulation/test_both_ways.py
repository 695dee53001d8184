"""Tests of a feed that reverses and draws in, holds and releases components again."""

from typing import Any

import numpy as np
import pytest

import magfold_env as mf
from magfold_bench.laws.overlap import beyond_bore
from magfold_bench.laws.random_scenes import designed_sequence
from magfold_env.simulation.session import Session

DIAGONAL = mf.Casing().diagonal


def tube(n: int, seed: int = 0, **changes: Any) -> mf.Scene:
    """Return a scene of a drawn chain without magnets in a tube."""
    scene = mf.Scene(sequence=("NSNS",) * n, magnets=None, start_angle_spread=0.1)
    return scene.replace(mount="tube", **changes).draw(np.random.default_rng(seed))


def there_and_back(n: int, rng: np.random.Generator) -> mf.Scene:
    """Return a scene that pushes all components except the last out and pulls them in again."""
    speed = float(np.exp(rng.uniform(np.log(0.01), np.log(0.3))))
    return tube(
        n,
        int(rng.integers(2**32)),
        friction=rng.uniform(0.3, 1.0),
        feed={
            "direction": str(rng.choice(["forward", "backward"])),
            "bore": rng.uniform(1.02, 1.2) * DIAGONAL,
            "schedule": {"advance": [[n - 0.8, speed], [0.0, speed]]},
        },
    )


def comes_back_in_line(seed: int) -> bool:
    """Check that such a chain returns into the bore; return whether it is straight."""
    rng = np.random.default_rng(seed)
    scene = there_and_back(int(rng.integers(2, 13)), rng)
    session = Session(scene)
    session.settle()
    fold = session.fold()
    assert fold.status is mf.FoldStatus.HELD, fold.message
    far = beyond_bore(scene, fold.angles[None], fold.base[None], np.zeros(1, dtype=np.int64))
    assert far[0] <= 1e-3 * scene.casing.side
    heading = np.pi if scene.feed.direction == "forward" else 0.0
    askew = np.abs(fold.angles - heading)
    held = askew[1:] if scene.feed.direction == "forward" else askew[:-1]
    return session.released <= 1 and held.max() <= 0.2 and askew.max() <= 0.5


def test_what_is_pushed_out_comes_back_in_line() -> None:
    assert sum(comes_back_in_line(seed) for seed in range(8)) >= 7


def test_components_are_held_a_diagonal_inside_and_released_again() -> None:
    scene = tube(4)
    session = Session(scene)
    while session.released < 3:
        session.feed_one()
    counts = []
    for speed in (-0.1, 0.1):
        for _ in range(60):
            session.push(speed, 0.01)
            base = float(session._state.q[4]) / DIAGONAL
            counts.append(session.released)
            # In line, the base is within a diagonal of the mouth.
            assert -1.0 - 1e-9 <= base <= 1.0
            assert session.advance >= -1e-12
    assert counts[:60] == sorted(counts[:60], reverse=True)
    assert counts[60:] == sorted(counts[60:])
    assert min(counts) == 1
    assert max(counts[60:]) == 3


def test_the_feed_stops_where_it_began_and_is_without_effect_once_all_are_out() -> None:
    session = Session(tube(3))
    session.push(0.1, 0.1)
    assert session.advance == pytest.approx(0.01)
    session.push(-0.1, 0.5)
    assert session.advance == pytest.approx(0.0, abs=1e-12)
    assert session.base_velocity == pytest.approx([0.0, 0.0], abs=1e-12)
    free, pulled = Session(tube(3, friction=0.35)), Session(tube(3, friction=0.35))
    for session in (free, pulled):
        while session.released < 3:
            session.feed_one()
    free.push(0.1, 0.2)
    pulled.push(-0.1, 0.2)
    np.testing.assert_array_equal(free.base, pulled.base)
    np.testing.assert_array_equal(free.angles, pulled.angles)


def test_magnets_set_at_the_mouth_go_inside_and_may_be_chosen_anew() -> None:
    rng = np.random.default_rng(3)
    scene = mf.Scene(sequence=designed_sequence(rng, 4), mount="tube")
    scene = scene.replace(feed={"loading": "at_mouth", "bore": 1.3 * DIAGONAL}).draw(rng)
    session = Session(scene)
    charge, waiting = session._model.charge, session._state.waiting

    def charged() -> list[bool]:
        return [bool(each.any()) for each in charge]

    session.feed_one()
    session.push(0.1, 0.05)
    assert charged() == [False, False, True, True]
    session.push(-0.1, 0.1)
    assert float(session._state.q[4]) < 0.0
    assert charged() == [False, False, False, True]
    waiting[2] *= -1.0
    session.push(0.1, 0.15)
    assert charged() == [False, False, True, True]
    np.testing.assert_array_equal(charge[2], waiting[2])


def test_a_drive_slips_where_it_takes_too_much_and_jams() -> None:
    scene = tube(6, friction=0.5)
    force = 4.0 * 0.5 * scene.gravity.normal * scene.masses[0]  # the drag of four in line
    for share, status in ((1.5, None), (0.5, mf.FoldStatus.JAMMED)):
        session = Session(scene.replace(feed={"force_limit": share * force}))
        while session.status is None and session.released < 5:
            session.feed_one()
        assert session.status is status
    assert "the drive slipped for 0.1 s" in session.message


def test_the_stop_bears_what_the_drive_cannot() -> None:
    """If gravity pulls inward more strongly than the drive, the feed returns to its stop."""
    scene = tube(5, friction=0.0, feed={"force_limit": 0.05}, gravity={"in_plane": [-20.0, 0.0]})
    session = Session(scene)
    session.feed_one()
    session.push(0.1, 0.5)
    assert session.status is mf.FoldStatus.JAMMED
    assert session.advance == pytest.approx(0.0, abs=1e-9)
    assert session.base_velocity[0] == 0.0
    # One that is asked for nothing is not jammed by it.
    session = Session(scene)
    session.feed_one()
    session.push(-0.1, 0.05)
    session.push(0.0, 0.5)
    assert session.status is not mf.FoldStatus.JAMMED
    assert session.advance == pytest.approx(0.0, abs=1e-9)


def test_a_schedule_that_pushes_all_out_ends_as_a_feed_does() -> None:
    scene = mf.load_scene("tube-built").draw(np.random.default_rng(0))
    speed = float(scene.speeds[0])
    plain = mf.simulate(scene.replace(feed={"speed": speed}))
    scheduled = mf.simulate(scene.replace(feed={"schedule": {"advance": [[scene.n, speed]]}}))
    assert (plain.status, plain.word, plain.time) == (
        scheduled.status, scheduled.word, scheduled.time,
    )  # fmt: skip
    np.testing.assert_array_equal(plain.angles, scheduled.angles)
