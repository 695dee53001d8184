"""Tests of scenes: immutability, changed copies and draws."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import magfold_env as mf

SEQUENCE = ("NSNN", "NSSN", "SNSS")


@pytest.fixture
def scene() -> mf.Scene:
    return mf.Scene(sequence=SEQUENCE)


def test_a_scene_is_frozen(scene: mf.Scene) -> None:
    with pytest.raises(ValueError, match="frozen"):
        scene.friction = 0.1  # pyright: ignore[reportAttributeAccessIssue]
    assert hash(scene) == hash(mf.Scene(sequence=SEQUENCE))


def test_replace_keeps_what_is_not_named_and_takes_groups_arrays_and_none(scene: mf.Scene) -> None:
    changed = scene.replace(feed={"direction": "backward"}).replace(feed={"speed": 0.1})
    assert changed.feed == mf.Feed(direction="backward", speed=0.1)
    assert scene.feed == mf.Feed()
    assert scene.replace(casing=mf.Casing(side=0.02)).casing.side == 0.02
    assert scene.replace(start_angles=np.array([0.1, -0.1])).start_angles == (0.1, -0.1)
    assert scene.replace(friction=np.float32(0.5)).friction == 0.5
    bare = scene.replace(magnets=None)
    assert bare.magnets is None
    assert bare.replace(magnets={"model": "points"}).magnets == mf.Magnets(model="points")


def test_arrays_of_the_bodies(scene: mf.Scene) -> None:
    np.testing.assert_array_equal(scene.masses, [0.0037] * 3)
    np.testing.assert_allclose(scene.inertias, 0.0037 * 0.0125**2 / 6, rtol=1e-15)
    each = scene.replace(casing={"mass": [1, 2, 3], "inertia": 0.5}, feed={"speed": [1, 2, 3]})
    np.testing.assert_array_equal(each.masses, [1, 2, 3])
    np.testing.assert_array_equal(each.inertias, [0.5] * 3)
    np.testing.assert_array_equal(each.speeds, [1, 2, 3])
    np.testing.assert_array_equal(scene.frictions, [0.35] * 3)
    np.testing.assert_array_equal(scene.replace(friction=[1, 0, 3]).frictions, [1, 0, 3])
    assert scene.bore == pytest.approx(1.05 * 0.0125 * math.sqrt(2))
    assert scene.replace(feed={"bore": 0.02}).bore == 0.02


SPREADS = {"friction": 0.2, "mass": 0.1, "remanence": 0.05, "feed_speed": 0.3}
EACH = {"feed_jitter": 0.2, "magnet": 0.1}


def test_a_draw_leaves_nothing_to_draw(scene: mf.Scene) -> None:
    drawn = scene.replace(spreads=SPREADS).draw(np.random.default_rng(1))
    assert drawn.is_concrete
    assert drawn.spreads == mf.Spreads()
    rng = np.random.default_rng(2)
    state = rng.bit_generator.state
    assert drawn.draw(rng) is drawn
    assert rng.bit_generator.state == state


def test_the_first_draws_come_in_the_stated_order(scene: mf.Scene) -> None:
    drawn = scene.replace(spreads=SPREADS).draw(np.random.default_rng(3))
    unit = 2.0 * np.random.default_rng(3).random(2 * 3 + 2) - 1.0
    magnets: Any = drawn.magnets
    found = [drawn.friction, *drawn.masses, magnets.remanence, drawn.feed.speed]
    stated = [0.35, *[0.0037] * 3, 0.6, 0.05]
    widths = [0.2, *[0.1] * 3, 0.05, 0.3]
    np.testing.assert_allclose(np.divide(found, stated) - 1.0, widths * unit[:6], atol=1e-12)
    np.testing.assert_allclose(drawn.start_angles or (), 0.03 * unit[6:], atol=1e-12)


def test_friction_can_be_drawn_evenly_on_a_scale_of_powers(scene: mf.Scene) -> None:
    wide = scene.replace(friction=1.0, spreads={"friction_decades": 0.5})
    drawn = [wide.draw(np.random.default_rng(seed)).friction for seed in range(300)]
    decades = np.sort(np.log10(drawn))
    even = np.linspace(-0.5, 0.5, len(drawn))
    # Kolmogorov's bound at 1e-6, as a share of the width.
    assert np.abs(decades - even).max() < 2.7 / math.sqrt(len(drawn))


def test_speeds_and_magnets_are_drawn_one_by_one_after_all_else(scene: mf.Scene) -> None:
    few, many = (
        scene.replace(spreads=spreads).draw(np.random.default_rng(7))
        for spreads in (SPREADS, SPREADS | EACH)
    )
    assert many.is_concrete
    assert many.magnets is not None
    assert few.magnets is not None
    # The draws that are older stay, in value and in number where nothing is drawn one by one.
    assert few == many.replace(magnets=few.magnets, feed=few.feed)
    speeds = many.speeds / few.speeds - 1
    strengths = many.magnets.charges(3) / few.magnets.charges(3) - 1
    unit = 2 * np.random.default_rng(7).random(2 * 3 + 2 + 5 * 3)[2 * 3 + 2 :] - 1
    np.testing.assert_allclose(speeds, 0.2 * unit[:3], atol=1e-12)
    np.testing.assert_allclose(strengths.ravel(), 0.1 * unit[3:], atol=1e-12)


def test_a_schedule_is_drawn_as_fast_as_the_feed(scene: mf.Scene) -> None:
    legs = {"advance": [[2.0, 0.1], [0.5, 0.2]]}
    fed = scene.replace(mount="tube", feed={"schedule": legs}, spreads={"feed_speed": 0.3})
    drawn: Any = fed.draw(np.random.default_rng(3)).feed
    assert drawn.schedule.advance is not None
    pace = float(np.max(drawn.speed)) / 0.05
    assert pace != 1.0
    assert [goal for goal, _ in drawn.schedule.advance] == [2.0, 0.5]
    assert [v for _, v in drawn.schedule.advance] == pytest.approx([0.1 * pace, 0.2 * pace])


def test_a_spread_of_friction_multiplies_all_of_a_floor(scene: mf.Scene) -> None:
    floor = scene.replace(friction=[0.1, 0.2, 0.4], spreads={"friction": 0.2})
    one = scene.replace(friction=1.0, spreads={"friction": 0.2})
    drawn, factor = (each.draw(np.random.default_rng(8)).frictions for each in (floor, one))
    np.testing.assert_array_equal(drawn, floor.frictions * factor)


def test_a_floor_tilts_evenly_up_to_its_spread_and_in_all_directions(scene: mf.Scene) -> None:
    tilting = scene.replace(spreads={"tilt": 2.0})
    drawn = [tilting.draw(np.random.default_rng(seed)).gravity for seed in range(300)]
    pulls = np.array([each.in_plane for each in drawn])
    normal = np.array([each.normal for each in drawn])
    np.testing.assert_allclose(np.hypot(normal, np.hypot(*pulls.T)), 9.8, rtol=1e-12)
    angles = np.sort(np.degrees(np.arctan2(np.hypot(*pulls.T), normal)))
    ways = np.sort(np.arctan2(*pulls.T))
    # Kolmogorov's bound at 1e-6, as a share of the width.
    assert np.abs(angles - np.linspace(0.0, 2.0, 300)).max() <= 0.16 * 2.0
    assert np.abs(ways - np.linspace(-np.pi, np.pi, 300)).max() <= 0.16 * 2.0 * np.pi


def test_a_tilt_is_drawn_last_and_comes_on_top_of_what_pulls_along_the_floor(scene):
    pulled = scene.replace(gravity={"in_plane": (1.0, -2.0)}, spreads={"tilt": 2.0})
    flat = pulled.replace(gravity={"in_plane": (0.0, 0.0)})
    mine, other = (
        np.array(each.draw(np.random.default_rng(8)).gravity.in_plane) for each in (pulled, flat)
    )
    np.testing.assert_allclose(mine - other, [1.0, -2.0], rtol=1e-12)
    wide = {**SPREADS, **EACH, "side": 0.01}
    bumped = scene.replace(spreads=wide, bumps={"rate": 1.0, "speed": 0.1})
    level, tilted = (
        each.draw(np.random.default_rng(8))
        for each in (bumped, bumped.replace(spreads={"tilt": 1.0}))
    )
    assert tilted.gravity != level.gravity
    assert tilted.replace(gravity=level.gravity) == level


def test_given_angles_stay_and_given_inertias_follow_the_masses(scene: mf.Scene) -> None:
    given = scene.replace(
        start_angles=[0.2, 0.3], spreads={"mass": 0.1}, casing={"inertia": [1, 2, 3]}
    )
    drawn = given.draw(np.random.default_rng(5))
    assert drawn.start_angles == (0.2, 0.3)
    np.testing.assert_allclose(drawn.inertias / given.inertias, drawn.masses / given.masses)
    assert len(set(drawn.masses)) == 3


def test_a_tube_draws_where_its_hinges_lie(scene: mf.Scene) -> None:
    tube = scene.replace(mount="tube", spreads=SPREADS)
    drawn: Any = tube.draw(np.random.default_rng(10))
    assert drawn.is_concrete
    unit = 2 * np.random.default_rng(10).random(2 * 3 + 4) - 1
    most = 0.25 * 0.03 * scene.casing.diagonal
    np.testing.assert_allclose(drawn.start_offsets, most * unit[3 + 3 :], atol=1e-18)
    tight = tube.replace(feed={"bore": 1.001 * scene.casing.diagonal})
    offsets: Any = tight.draw(np.random.default_rng(10)).start_offsets
    np.testing.assert_allclose(offsets, 0.0005 * scene.casing.diagonal * unit[6:], atol=1e-15)


def test_naming_one_way_to_start_drops_the_other(scene: mf.Scene) -> None:
    tube = scene.replace(mount="tube", start_offsets=(0.0, 1e-4, 0.0, 0.0))
    angles = tube.replace(start_angles=(0.0, 0.01))
    assert (angles.start_angles, angles.start_offsets) == ((0.0, 0.01), None)
    assert angles.replace(start_offsets=(0.0,) * 4).start_angles is None
    drawn = tube.replace(start_angles=None)
    assert drawn.start_offsets is None
    # Of a chain that no tube holds, offsets say nothing.
    assert tube.is_concrete
    free = tube.replace(mount="free")
    assert not free.is_concrete
    assert free.draw(np.random.default_rng(0)).start_angles is not None


def test_a_sequence_may_be_text(tmp_path: Path) -> None:
    given: Any = "NSNS N-SS"
    scene = mf.Scene(sequence=given)
    assert scene == mf.Scene(sequence=("NSNS", "N-SS")) == scene.replace(sequence=given)
    (tmp_path / "scene.yaml").write_text(f"sequence: {given}\n", encoding="utf-8")
    assert mf.load_scene(tmp_path / "scene.yaml") == scene
