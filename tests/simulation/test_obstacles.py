"""What stands in the way of a chain: it is not entered, and it stops what is fed."""

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


def test_a_pendulum_comes_to_lie_on_a_ledge() -> None:
    scene = mf.Scene(
        sequence=("----",), magnets=None, mount="pinned", friction=0.0, duration=1.0,
        gravity=mf.Gravity(in_plane=(0.0, -9.8)), start_angles=(),
        obstacles=(mf.Rectangle(position=(0.02, -0.015), size=(0.02, 0.004)),),
    )  # fmt: skip
    fold = mf.simulate(scene)
    assert fold.status is mf.FoldStatus.FOLDED
    # Its lowest corner, or the tip of its diagonal, lies on the ledge's top.
    heading, radius = float(fold.angles[0]), scene.casing.corner_radius
    turns = heading + np.deg2rad([0.0, 90.0, 180.0, 270.0])
    core = 0.5 * DIAGONAL - np.sqrt(2.0) * radius
    corners = fold.centres()[0] + core * np.stack([np.cos(turns), np.sin(turns)], axis=1)
    over = (corners[:, 0] > 0.01) & (corners[:, 0] < 0.03)
    assert corners[over, 1].min() - radius == pytest.approx(-0.013, abs=2e-5)


def test_a_feed_against_a_wall_jams() -> None:
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
    fold = session.fold()
    assert fold.status is mf.FoldStatus.JAMMED
    assert fold.push_peak == pytest.approx(1.0)
    assert fold.trajectory is not None
    assert fold.trajectory.push.max() <= 1.0 + 1e-9
    # In line with the wall the chain cannot give way, only the drive can.
    assert fold.base[0] == pytest.approx(3.0 * DIAGONAL - 0.002, abs=2e-5)
    assert np.abs(fold.joint_angles).max() < 1e-9


def test_a_drive_without_a_limit_jams_where_nothing_gives_way() -> None:
    wall = mf.Rectangle(position=(3.0 * DIAGONAL, 0.0), size=(0.004, 0.1))
    scene = mf.Scene(
        sequence=("----",) * 4,
        magnets=None,
        mount="tube",
        obstacles=(wall,),
        start_angle_spread=0.0,
    )
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


def test_a_chamber_changes_how_a_chain_folds() -> None:
    scene = drawn(mf.load_scene("tube-built").replace(friction=0.1))
    narrow = mf.channel((1.2 * DIAGONAL, 0.0), (12.0 * DIAGONAL, 0.0), 1.3 * DIAGONAL)
    free, within = mf.simulate(scene), mf.simulate(scene.replace(obstacles=narrow))
    assert free.status is mf.FoldStatus.FOLDED
    assert within.status is not mf.FoldStatus.FOLDED
    assert np.abs(within.joint_angles).max() < np.abs(free.joint_angles).max()


def test_batches_take_obstacles_and_bumps() -> None:
    walls: Any = mf.chamber((1.05 * DIAGONAL, -0.03), (0.06, 0.055), 0.024)
    bumps = mf.Bumps(rate=20.0, speed=0.1)
    scene = mf.Scene(sequence=SEQUENCE, mount="tube", obstacles=walls, bumps=bumps, duration=0.3)
    together = mf.simulate_batch([scene] * 4, seeds=range(4))
    for seed, fold in enumerate(together):
        alone = mf.simulate(scene, seed=seed)
        np.testing.assert_array_equal(fold.angles, alone.angles)
        assert (fold.time, fold.status) == (alone.time, alone.status)


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
