"""Trains of bumps: what each does, when they come, and how long they go on."""

import math
from typing import Any

import numpy as np
import pytest

import magfold_env as mf
from magfold_bench.laws.along_folds import follow
from magfold_bench.laws.dense import look_inside
from magfold_env.simulation.session import Session

SEQUENCE = mf.load_scene("paper/sequence-3").sequence


def train(rate: float, seed: int, count: int) -> tuple[list[float], list[float]]:
    """Times [s] and directions [rad] of the first bumps, by Park and Miller's numbers."""
    number, unit = seed, []
    for _ in range(2 * count):
        number = 48271 * number % (2**31 - 1)
        unit.append(number / (2**31 - 1))
    times = np.cumsum(2.0 / rate * np.array(unit[::2]))
    return times.tolist(), (2.0 * math.pi * np.array(unit[1::2])).tolist()


def still(n: int = 1, **changes: Any) -> mf.Scene:
    scene = mf.Scene(sequence=("----",) * n, magnets=None, friction=0.0, contact=False)
    return scene.replace(duration=2.0, start_angle_spread=0.0, **changes)


def test_numbers_are_those_of_park_and_miller() -> None:
    # Their check: from 1 the 10,000th number of the generator of 48271 is 399268537.
    number = 1
    for _ in range(10_000):
        number = 48271 * number % (2**31 - 1)
    assert number == 399268537


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


def test_bumps_left_to_chance_move_no_other_draw() -> None:
    scene = mf.Scene(sequence=SEQUENCE, spreads={"friction": 0.1, "magnet": 0.1})  # type: ignore[arg-type]
    rngs = np.random.default_rng(4), np.random.default_rng(4)
    plain = scene.draw(rngs[0])
    bumped = scene.replace(bumps={"rate": 1.0, "speed": 0.1}).draw(rngs[1])
    assert bumped.replace(bumps=None) == plain


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


@pytest.mark.parametrize("mount", ["free", "pinned", "tube"])
def test_laws_hold_under_bumps(mount: str) -> None:
    scene = mf.Scene(sequence=SEQUENCE, mount=mount, friction=0.2)  # type: ignore[arg-type]
    scene = scene.replace(
        bumps={"rate": 100.0, "speed": 0.3, "seed": 2}, feed={"speed": 0.3}, duration=0.3
    )
    scene = scene.draw(np.random.default_rng(0))
    motion, _ = follow(scene)
    assert motion.finite
    assert motion.rise < 1e-3
    inside, _ = look_inside(scene)
    assert inside.casings < 1e-3
    assert inside.past_stop < scene.solver.tolerance
