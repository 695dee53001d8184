"""Tests of obstacles, which chains do not enter, and of bumps, which move chains."""

import math
from typing import Any

import numpy as np
import pytest

import magfold_env as mf
from magfold_bench.laws.along_folds import follow
from magfold_bench.laws.dense import look_inside
from magfold_bench.laws.random_scenes import designed_sequence
from magfold_env.simulation.session import Session

DIAGONAL = mf.Casing().diagonal
SEQUENCE = mf.load_scene("paper/sequence-3").sequence


def drawn(scene: mf.Scene, seed: int = 0) -> mf.Scene:
    return scene.draw(np.random.default_rng(seed))


def test_obstacles_far_away_change_no_bit() -> None:
    scene = drawn(mf.load_scene("paper/sequence-3"))
    far = mf.Rectangle(position=(3.0, 3.0), size=(0.1, 0.1), heading=0.3)
    one, other = mf.simulate(scene), mf.simulate(scene.replace(obstacles=(far,)))
    np.testing.assert_array_equal(one.angles, other.angles)
    assert (one.time, one.steps, one.status) == (other.time, other.steps, other.status)


def test_more_obstacles_need_more_room_than_the_run_before_had() -> None:
    # Scratch space is used again: that of a chain among fewer obstacles would be too small.
    rocks = tuple(mf.Rectangle(position=(3.0, 3.0 + k), size=(0.1, 0.1)) for k in range(64))
    scene = drawn(mf.Scene(sequence=SEQUENCE, duration=0.05))
    folds = [mf.simulate(scene.replace(obstacles=rocks[:k])) for k in (0, 1, 64, 0, 64)]
    for fold in folds[1:]:
        np.testing.assert_array_equal(fold.angles, folds[0].angles)


def test_a_feed_against_a_wall_jams_whether_its_drive_has_a_limit_or_none() -> None:
    guide = mf.channel((1.1 * DIAGONAL, 0.0), (3.0 * DIAGONAL, 0.0), 1.04 * DIAGONAL)
    wall = mf.Rectangle(position=(3.0 * DIAGONAL, 0.0), size=(0.004, 0.1))
    scene = mf.Scene(sequence=("NSNS",) * 5, magnets=None, mount="tube", friction=0.1)
    scene = drawn(
        scene.replace(
            obstacles=(*guide, wall),
            feed={"speed": 0.05, "force_limit": 1.0},
            start_angle_spread=0.0,
        )
    )  # fmt: skip
    session = Session(scene, 1000.0)
    session.settle()
    fold: Any = session.fold()
    assert fold.status is mf.FoldStatus.JAMMED
    assert fold.push_peak == pytest.approx(1.0)
    assert fold.trajectory.push.max() <= 1.0 + 1e-9
    # In line with the wall the chain cannot give way, only the drive can.
    assert fold.base[0] == pytest.approx(3.0 * DIAGONAL - 0.002, abs=2e-5)
    assert np.abs(fold.joint_angles).max() < 1e-9
    wall = mf.Rectangle(position=(3.0 * DIAGONAL, 0.0), size=(0.004, 0.1))
    scene = mf.Scene(
        sequence=("----",) * 4, magnets=None, mount="tube", obstacles=(wall,),
        start_angle_spread=0.0,
    )  # fmt: skip
    fold = mf.simulate(scene.replace(feed={"force_limit": None}))
    assert fold.status is mf.FoldStatus.JAMMED
    assert "drive without limit; component 1 touches obstacles[0]" in fold.message
    assert fold.base[0] == pytest.approx(3.0 * DIAGONAL - 0.002, abs=2e-5)
    # It ends within the second millisecond of the jam.
    assert fold.time < 3.0 * DIAGONAL / 0.05 + 2e-3


@pytest.mark.parametrize("seed", range(6))
def test_nothing_enters_a_chamber(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = int(rng.integers(4, 8))
    walls = mf.chamber((1.05 * DIAGONAL, -0.03), (0.06, 0.055), 0.024)
    scene = mf.Scene(sequence=designed_sequence(rng, n), mount="tube", obstacles=walls)
    scene = scene.replace(friction=float(rng.choice([0.0, 0.2])), duration=0.4)
    scene = drawn(scene.replace(feed={"speed": 0.2}), seed)
    motion, session = follow(scene)
    assert session.status is not mf.FoldStatus.FAILED
    assert motion.rise < 2e-3
    inside, _ = look_inside(scene)
    assert max(inside.casings, inside.solids) < 1e-3
    assert inside.past_stop < scene.solver.tolerance


@pytest.mark.parametrize("direction", ["forward", "backward"])
def test_a_funnel_leads_a_chain_back_into_its_tube(direction: str) -> None:
    scene = mf.Scene(sequence=("NSNS",) * 4, magnets=None, mount="tube", friction=0.3)
    feed = {
        "direction": direction, "bore": 1.1 * DIAGONAL,
        "schedule": {"advance": [[3.2, 0.1], [0.0, 0.05]]},
    }  # fmt: skip
    scene = scene.replace(feed=feed, start_angle_spread=0.1)
    scene = drawn(scene.replace(obstacles=mf.funnel(scene.bore, 0.03, 0.5)))
    inside, fold = look_inside(scene)
    assert fold.status is mf.FoldStatus.HELD
    assert fold.in_tube >= fold.scene.n - 1
    assert max(inside.casings, inside.solids) < 1e-3


def train(rate: float, seed: int, count: int) -> tuple[list[float], list[float]]:
    """Return times [s] and directions [rad] of the first bumps, by Park and Miller's generator."""
    number, unit = seed, []
    for _ in range(2 * count):
        number = 48271 * number % (2**31 - 1)
        unit.append(number / (2**31 - 1))
    times = np.cumsum(2.0 / rate * np.array(unit[::2]))
    return times.tolist(), (2.0 * math.pi * np.array(unit[1::2])).tolist()


def still(n: int = 1, **changes: Any) -> mf.Scene:
    scene = mf.Scene(sequence=("----",) * n, magnets=None, friction=0.0, contact=False)
    return scene.replace(duration=2.0, start_angle_spread=0.0, **changes)


def test_a_free_component_takes_up_every_bump() -> None:
    bumps = {"rate": 20.0, "speed": 0.1, "seed": 7, "duration": 0.5}
    session = Session(still(bumps=bumps).draw(np.random.default_rng(0)))
    times, directions = train(20.0, 7, 40)
    count = sum(time <= 0.5 for time in times)
    assert count > 3
    kicks = np.cumsum(0.1 * np.exp(1j * np.array(directions[:count])))
    for time, velocity in zip(times[:count], kicks, strict=True):
        session.push(0.0, time + 1e-6 - session.time)
        found = session.base_velocity @ [1.0, 1j]
        assert found == pytest.approx(velocity, abs=1e-12)
    session.settle()
    assert session.base_velocity @ [1.0, 1j] == pytest.approx(kicks[-1], abs=1e-12)


def test_a_pinned_chain_is_bumped_about_its_pin() -> None:
    scene = still(bumps={"rate": 1.0, "speed": 0.2, "seed": 3, "duration": 10.0}, mount="pinned")
    times, directions = train(1.0, 3, 1)
    session = Session(scene.draw(np.random.default_rng(0)))
    session.push(0.0, times[0] + 1e-6)
    # The moment of the bump about the pin turns a body of this moment of inertia.
    reach, side = scene.casing.diagonal / 2.0, scene.casing.side
    inertia = side**2 / 6.0 + reach**2
    expected = reach * 0.2 * math.sin(directions[0]) / inertia
    assert session.rates.tolist() == pytest.approx([expected], rel=1e-9)


def test_the_same_seed_bumps_alike_and_another_otherwise() -> None:
    base = mf.Scene(sequence=SEQUENCE, bumps=mf.Bumps(rate=30.0, speed=0.1))
    one, other, third = (mf.simulate(base, seed=seed) for seed in (0, 0, 1))
    assert one.scene.bumps is not None
    assert one.scene.bumps.seed is not None
    np.testing.assert_array_equal(one.angles, other.angles)
    assert third.scene.bumps is not None
    assert third.scene.bumps.seed != one.scene.bumps.seed
    again = mf.simulate(one.scene)
    np.testing.assert_array_equal(again.angles, one.angles)
    assert again.time == one.time


def test_a_chain_at_rest_waits_for_what_is_still_to_come() -> None:
    # A floor that holds it from the first, and a table that is knocked hard for half a second.
    scene = mf.Scene(sequence=SEQUENCE, friction=20.0)
    calm = mf.simulate(scene, seed=0)
    knocked = mf.simulate(
        scene.replace(bumps={"rate": 20.0, "speed": 1.0, "seed": 1, "duration": 0.5}), seed=0
    )
    assert calm.status is mf.FoldStatus.MISFOLDED
    assert calm.time < 0.1
    assert knocked.time > 0.4
    assert np.abs(knocked.joint_angles - calm.joint_angles).max() > 0.05
    assert knocked.status in {mf.FoldStatus.MISFOLDED, mf.FoldStatus.FOLDED}
