"""Scenes: what is allowed, what is said about what is not, and the draw."""

import math
from typing import Any

import numpy as np
import pytest

import magfold_env as mf

SEQUENCE = ("NSNN", "NSSN", "SNSS")


@pytest.fixture
def scene() -> mf.Scene:
    return mf.Scene(sequence=SEQUENCE)


FIXED: dict[str, Any] = {"position": (0.05, 0.05), "width": 0.02, "height": 0.02, "thickness": 0.01}

WRONG: list[tuple[dict[str, Any], str]] = [
    ({"colour": "red"}, "colour: 'red' is not allowed; unknown key, must be one of sequence"),
    (
        {"casing": {"weight": 3}},
        "casing.weight: 3 is not allowed; unknown key, must be one of side",
    ),
    ({"casing": {"mass": -1.0}}, "casing.mass: -1.0 is not allowed; must be greater than 0"),
    ({"casing": {"mass": [1, -2, 1]}}, "casing.mass[1]: -2 is not allowed; must be greater than 0"),
    ({"casing": {"mass": [1, 1]}}, "casing.mass: (1.0, 1.0) is not allowed; must have 3 numbers"),
    ({"casing": {"inertia": [1]}}, "casing.inertia: (1.0,) is not allowed; must have 3 numbers"),
    ({"casing": {"side": 0}}, "casing.side: 0 is not allowed; must be greater than 0"),
    ({"casing": {"hinge": "face"}}, "casing.hinge: 'face' is not allowed; must be 'corner'"),
    ({"casing": 3}, "casing: 3 is not allowed; must be"),
    (
        {"sequence": ["NSNSN"]},
        "sequence[0]: 'NSNSN' is not allowed; must be four letters N, S or -",
    ),
    ({"sequence": ["NSNS", "nsns"]}, "sequence[1]: 'nsns' is not allowed; must be four letters"),
    ({"sequence": []}, "sequence: [] is not allowed; must have at least one component"),
    ({"sequence": "NSNS"}, "sequence: 'NSNS' is not allowed; must be"),
    (
        {"feed": {"speed": [0.1] * 4}},
        "feed.speed: (0.1, 0.1, 0.1, 0.1) is not allowed; must have 3",
    ),
    ({"feed": {"speed": 0.0}}, "feed.speed: 0.0 is not allowed; must be greater than 0"),
    ({"feed": {"bore": 0.01}}, "feed.bore: 0.01 is not allowed; must be at least the casing's"),
    ({"start_angles": [0.0] * 3}, "start_angles: (0.0, 0.0, 0.0) is not allowed; must have 2"),
    ({"start_angles": [0.0, 2.0]}, "start_angles[1]: 2.0 is not allowed; must be less than or"),
    ({"start_angle_spread": 0.6}, "start_angle_spread: 0.6 is not allowed; must be less than or"),
    ({"magnets": {"width": 0.01}}, "magnets.width: 0.01 is not allowed; the magnets of a casing"),
    ({"magnets": {"inset": 0.01}}, "magnets.width: 0.006 is not allowed; the magnets of a casing"),
    ({"magnets": {"remanence": None}}, "magnets.remanence: None is not allowed; must be given, or"),
    (
        {"magnets": {"remanence": 0.6, "pole_charge": 8.0}},
        "magnets.pole_charge: 8.0 is not allowed; must be left out when remanence (0.6) is given",
    ),
    (
        {"magnets": {"width": [0.006, 0.006, 0.006]}},
        "magnets.width: [0.006, 0.006, 0.006] is not allowed; must be one number, or four, one a "
        "face (front-left, back-left, back-right, front-right)",
    ),
    ({"magnets": {"width": []}}, "magnets.width: [] is not allowed; must be one number, or four"),
    ({"magnets": {"inset": [0, 0, 0, -1]}}, "magnets.inset[3]: -1 is not allowed; must be greater"),
    ({"magnets": {"height": [[1] * 4]}}, "magnets.height[0]: [1, 1, 1, 1] is not allowed; must be"),
    (
        {"magnets": {"remanence": [1.0, 1.0]}},
        "magnets.remanence: [1.0, 1.0] is not allowed; must be one number, or four, one a face",
    ),
    (
        {"magnets": {"remanence": [[1.0] * 4] * 2}},
        "magnets.remanence: ((1.0, 1.0, 1.0, 1.0), (1.0, 1.0, 1.0, 1.0)) is not allowed; must "
        "have 3 rows of four, the scene has 3 components",
    ),
    (
        {"magnets": {"pole_charge": [[1.0] * 4, [1.0] * 3, [1.0] * 4]}},
        "magnets.pole_charge[1]: [1.0, 1.0, 1.0] is not allowed; must be four numbers, one a face",
    ),
    (
        {"magnets": {"pole_charge": [[1.0] * 4, [1.0, 0.0, 1.0, 1.0], [1.0] * 4]}},
        "magnets.pole_charge[1][1]: 0.0 is not allowed; must be greater than 0",
    ),
    (
        {"magnets": {"pole_charge": [[1.0] * 4, 1.0, [1.0] * 4]}},
        "magnets.pole_charge[1]: 1.0 is not allowed; must be four numbers, one a face",
    ),
    (
        {"magnets": {"remanence": [0.6] * 4, "pole_charge": [8.0] * 4}},
        "magnets.pole_charge: (8.0, 8.0, 8.0, 8.0) is not allowed; must be left out when remanence",
    ),
    (
        {"magnets": {"width": [0.007, 0.007, 0.006, 0.006]}},
        "magnets.width: (0.007, 0.007, 0.006, 0.006) is not allowed; the magnets of front-left and "
        "back-left overlap, front-left's must be at most 0.0065 or back-left's at most 0.0065",
    ),
    (
        {"magnets": {"width": [0.013, 0.001, 0.001, 0.001], "thickness": 0.001}},
        "magnets.width: (0.013, 0.001, 0.001, 0.001) is not allowed; front-left's must be at most "
        "the casing's side, 0.0125",
    ),
    (
        {"magnets": {"width": 0.001, "thickness": [0.009, 0.001, 0.004, 0.001]}},
        "magnets.thickness: (0.009, 0.001, 0.004, 0.001) is not allowed; the magnets of front-left "
        "and back-right overlap, their insets and thicknesses must add up to at most the casing's",
    ),
    ({"field": {"uniform": [0.1]}}, "field.uniform: [0.1] is not allowed; must have a value"),
    ({"field": {"uniform": 0.1}}, "field.uniform: 0.1 is not allowed; must be"),
    ({"field": {"magnet": {"width": 0.1}}}, "field.magnet.position: None is not allowed; must be"),
    (
        {"field": {"magnet": {**FIXED, "remanence": 0.0}}},
        "field.magnet.remanence: 0.0 is not allowed; must be greater than 0",
    ),
    (
        {"mount": "tube", "field": {"magnet": {**FIXED, "position": (-0.05, 0.015)}}},
        "field.magnet.position: (-0.05, 0.015) is not allowed; a fixed external magnet must lie "
        "outside the tube: nowhere both x < 0 and |y| < bore/2 + wall = 0.0102808",
    ),
    ({"magnets": {"nodes": 2.5}}, "magnets.nodes: 2.5 is not allowed; must be a valid integer"),
    ({"mount": "glued"}, "mount: 'glued' is not allowed; must be 'pinned', 'free' or 'tube'"),
    ({"friction": -0.1}, "friction: -0.1 is not allowed; must be greater than or equal to 0"),
    ({"friction": math.nan}, "friction: nan is not allowed; must be a finite number"),
    ({"duration": math.inf}, "duration: inf is not allowed; must be a finite number"),
    ({"gravity": {"in_plane": [0.0]}}, "gravity.in_plane: [0.0] is not allowed; must have a value"),
    ({"gravity": {"in_plane": [0, 0, 0]}}, "gravity.in_plane: [0, 0, 0] is not allowed; must have"),
    ({"friction": True}, "friction: True is not allowed; must be a valid number"),
    ({"casing": {"mass": [1, True, 1]}}, "casing.mass[1]: True is not allowed; must be a valid nu"),
    ({"solver": {"max_steps": True}}, "solver.max_steps: True is not allowed; must be a valid int"),
    ({"friction": "0.3"}, "friction: '0.3' is not allowed; must be a valid number"),
    ({"contact": 1}, "contact: 1 is not allowed; must be a valid boolean"),
    ({"spreads": {"mass": 1.0}}, "spreads.mass: 1.0 is not allowed; must be less than 1"),
    ({"solver": {"method": "paper"}}, "solver.method: 'paper' is not allowed; the paper's solver"),
]


@pytest.mark.parametrize(("change", "message"), WRONG, ids=[message[:40] for _, message in WRONG])
def test_wrong_values_are_named_with_key_value_and_remedy(
    change: dict[str, Any], message: str
) -> None:
    given: dict[str, Any] = {"sequence": SEQUENCE}
    with pytest.raises(mf.SceneError) as caught:
        mf.Scene(**given | change)
    assert str(caught.value).startswith(message)
    with pytest.raises(mf.SceneError) as again:
        mf.Scene(**given).replace(**change)
    assert str(again.value) == str(caught.value)


def test_every_problem_has_its_own_line() -> None:
    with pytest.raises(mf.SceneError) as caught:
        mf.load_scene("tube-feed").replace(
            sequence=("N", "NSNS"), casing={"mass": -1.0, "side": -2.0}, friction=True
        )
    keys = [line.split(":")[0] for line in str(caught.value).splitlines()]
    assert keys == ["sequence[0]", "casing.side", "casing.mass", "friction"]


def test_a_missing_sequence_is_named() -> None:
    with pytest.raises(mf.SceneError, match=r"^sequence: None is not allowed; must be given"):
        mf.Scene(**{})


def test_a_group_alone_is_checked_too() -> None:
    with pytest.raises(mf.SceneError, match=r"^side: -1.0 is not allowed"):
        mf.Casing(side=-1.0)


def test_a_scene_is_frozen(scene: mf.Scene) -> None:
    with pytest.raises(ValueError, match="frozen"):
        scene.friction = 0.1  # pyright: ignore[reportAttributeAccessIssue]
    assert hash(scene) == hash(mf.Scene(sequence=SEQUENCE))


def test_magnets_that_just_touch_at_their_corners_fit(scene: mf.Scene) -> None:
    tight = scene.replace(magnets={"width": 0.0065})
    assert tight.magnets is not None
    assert tight.magnets.width == 0.0065


def test_remanence_gives_the_charge_of_a_block() -> None:
    # FACTS: B_r A / mu0 = 17.1887 A m for 0.6 T and 36 mm².
    assert mf.Magnets().charge == pytest.approx(17.1887, abs=5e-5)
    assert mf.Magnets(pole_charge=8.5946).charge == 8.5946
    assert mf.Magnets(pole_charge=8.5946).remanence is None


def test_charges_by_face_and_component_carry_the_letters_signs() -> None:
    magnets = mf.Magnets(pole_charge=(1, 2, 3, 4))
    scene = mf.Scene(sequence=("NS-N", "----", "SSNN"), magnets=magnets)
    np.testing.assert_array_equal(scene.charges, [[1, -2, 0, 4], [0, 0, 0, 0], [-1, -2, 3, 4]])
    rows = np.arange(1.0, 13.0).reshape(3, 4)
    each = scene.replace(magnets={"pole_charge": rows})
    np.testing.assert_array_equal(each.charges, rows * [[1, -1, 0, 1], [0] * 4, [-1, -1, 1, 1]])
    assert each.magnets is not None
    assert each.magnets.charge == 12.0
    np.testing.assert_array_equal(each.magnets.charges(3), rows)
    with pytest.raises(ValueError, match="n: 2 is not allowed; pole_charge has 3 rows"):
        each.magnets.charges(2)
    assert not scene.replace(magnets=None).charges.any()


def test_remanence_times_each_faces_area_gives_its_charge() -> None:
    magnets = mf.Magnets(
        remanence=(0.6, 1.2, 0.6, 0.6), width=(0.006, 0.006, 0.003, 0.006), height=0.006
    )
    unit = mf.Magnets().charge
    np.testing.assert_allclose(magnets.charges(2), [[unit, 2 * unit, unit / 2, unit]] * 2)
    assert magnets.charge == pytest.approx(2 * unit)


def test_even_magnets_may_differ_in_strength_only() -> None:
    assert mf.Magnets(width=(0.005,) * 4, remanence=(0.1, 0.2, 0.3, 0.4)).even
    for name in ("width", "height", "thickness", "inset"):
        lengths: dict[str, Any] = {name: (0.002, 0.001, 0.001, 0.001)}
        assert not mf.Magnets(**lengths).even
    np.testing.assert_array_equal(mf.Magnets(inset=(1, 2, 3, 4)).by_face("inset"), [1, 2, 3, 4])
    np.testing.assert_array_equal(mf.Magnets().by_face("width"), [0.006] * 4)


def test_a_wide_magnet_fits_beside_narrow_ones(scene: mf.Scene) -> None:
    changed = scene.replace(magnets={"width": (0.008, 0.004, 0.008, 0.004)})
    assert changed.magnets is not None
    assert not changed.magnets.even
    with pytest.raises(mf.SceneError, match="of back-left and back-right overlap"):
        scene.replace(magnets={"width": (0.008, 0.007, 0.008, 0.004)})


def test_fields_are_merged_replaced_and_dropped(scene: mf.Scene) -> None:
    given = scene.replace(field={"magnet": FIXED})
    assert given.field == mf.Field(magnet=mf.FixedMagnet(**FIXED))
    both = given.replace(field={"uniform": (0.0, 1e-3)})
    assert both.field is not None
    assert both.field.magnet == mf.FixedMagnet(**FIXED)
    turned = both.replace(field={"magnet": {"heading": 0.5}})
    assert turned.field == mf.Field(
        uniform=(0.0, 1e-3),
        magnet=mf.FixedMagnet(**{**FIXED, "heading": 0.5}),
    )
    alone = turned.replace(field={"magnet": None})
    assert alone.field == mf.Field(uniform=(0.0, 1e-3))
    assert mf.Field(uniform=(0.0, 1e-3)).any
    assert not mf.Field().any
    assert turned.replace(field=None).field is None
    assert scene.replace(field=mf.Field()).field == mf.Field()


def test_the_geometry_of_a_fixed_magnet() -> None:
    magnet = mf.FixedMagnet(
        position=(1.0, 2.0), heading=math.pi / 2, width=0.4, height=0.1, thickness=0.2
    )
    np.testing.assert_allclose(magnet.poles, [[1.0, 2.1], [1.0, 1.9]])
    expected = [[1.2, 2.1], [0.8, 2.1], [0.8, 1.9], [1.2, 1.9]]
    np.testing.assert_allclose(magnet.corners, expected)
    # 1.2 T over 400 cm².
    assert magnet.charge == pytest.approx(1.2 * 0.04 / (4e-7 * math.pi))


def test_a_fixed_magnet_may_stand_before_or_beside_the_tube(scene: mf.Scene) -> None:
    tube = scene.replace(mount="tube")
    beside = 0.005 + tube.bore / 2 + tube.feed.wall
    for position in ((0.010, 0.0), (-0.05, beside), (-0.05, -beside - 1e-9), (0.0, 0.05)):
        size = {"width": 0.01, "height": 0.01, "thickness": 0.02}
        placed = tube.replace(field={"magnet": {"position": position, **size}})
        assert placed.field is not None
    # Without a tube there is none to keep clear of.
    inside = {"magnet": {**FIXED, "position": (-0.05, 0.0)}}
    assert scene.replace(mount="pinned", field=inside).field is not None


def test_replace_keeps_what_is_not_named(scene: mf.Scene) -> None:
    changed = scene.replace(feed={"direction": "backward"}).replace(feed={"speed": 0.1})
    assert changed.feed == mf.Feed(direction="backward", speed=0.1)
    assert scene.feed == mf.Feed()


def test_replace_takes_groups_arrays_and_none(scene: mf.Scene) -> None:
    assert scene.replace(casing=mf.Casing(side=0.02)).casing.side == 0.02
    assert scene.replace(start_angles=np.array([0.1, -0.1])).start_angles == (0.1, -0.1)
    assert scene.replace(friction=np.float32(0.5)).friction == 0.5
    bare = scene.replace(magnets=None)
    assert bare.magnets is None
    assert bare.replace(magnets={"model": "points"}).magnets == mf.Magnets(model="points")


def test_naming_one_strength_drops_the_other(scene: mf.Scene) -> None:
    charged = scene.replace(magnets={"pole_charge": 2.0})
    assert charged.magnets == mf.Magnets(pole_charge=2.0)
    assert charged.replace(magnets={"remanence": 0.6}).magnets == mf.Magnets()


def test_arrays_of_the_bodies(scene: mf.Scene) -> None:
    np.testing.assert_array_equal(scene.masses, [0.0037] * 3)
    np.testing.assert_allclose(scene.inertias, 0.0037 * 0.0125**2 / 6, rtol=1e-15)
    each = scene.replace(casing={"mass": [1, 2, 3], "inertia": 0.5}, feed={"speed": [1, 2, 3]})
    np.testing.assert_array_equal(each.masses, [1, 2, 3])
    np.testing.assert_array_equal(each.inertias, [0.5] * 3)
    np.testing.assert_array_equal(each.speeds, [1, 2, 3])
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


def test_draws_are_seeded_and_inside_their_widths(scene: mf.Scene) -> None:
    wide = scene.replace(spreads=SPREADS)
    assert wide.draw(np.random.default_rng(3)) == wide.draw(np.random.default_rng(3))
    for seed in range(50):
        drawn = wide.draw(np.random.default_rng(seed))
        assert drawn.magnets is not None
        assert drawn.start_angles is not None
        assert isinstance(drawn.feed.speed, float)
        assert abs(drawn.friction / 0.35 - 1) <= 0.2
        assert np.abs(drawn.masses / 0.0037 - 1).max() <= 0.1
        assert abs(drawn.magnets.charge / mf.Magnets().charge - 1) <= 0.05
        assert abs(drawn.feed.speed / 0.05 - 1) <= 0.3
        assert max(map(abs, drawn.start_angles)) <= 0.03


def test_switching_a_spread_on_leaves_the_other_draws_alone(scene: mf.Scene) -> None:
    few = scene.draw(np.random.default_rng(4))
    many = scene.replace(spreads=SPREADS).draw(np.random.default_rng(4))
    assert few.start_angles == many.start_angles
    assert few == many.replace(
        friction=few.friction, casing={"mass": 0.0037}, magnets=few.magnets, feed=few.feed
    )


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


@pytest.mark.parametrize("name", ["feed_jitter", "magnet"])
def test_jitter_and_magnets_are_drawn_apart(scene: mf.Scene, name: str) -> None:
    both, one = (
        scene.replace(spreads=spreads).draw(np.random.default_rng(8))
        for spreads in (EACH, {name: EACH[name]})
    )
    if name == "magnet":
        assert one == both.replace(feed=scene.feed)
    else:
        assert one == both.replace(magnets=scene.magnets)


def test_a_draw_without_them_takes_no_more_numbers_than_ever(scene: mf.Scene) -> None:
    rng, twin = np.random.default_rng(9), np.random.default_rng(9)
    scene.replace(spreads=SPREADS).draw(rng)
    twin.random(2 * 3 + 2)
    assert rng.bit_generator.state == twin.bit_generator.state


def test_given_angles_stay_and_given_inertias_follow_the_masses(scene: mf.Scene) -> None:
    given = scene.replace(
        start_angles=[0.2, 0.3], spreads={"mass": 0.1}, casing={"inertia": [1, 2, 3]}
    )
    drawn = given.draw(np.random.default_rng(5))
    assert drawn.start_angles == (0.2, 0.3)
    np.testing.assert_allclose(drawn.inertias / given.inertias, drawn.masses / given.masses)
    assert len(set(drawn.masses)) == 3


def test_a_pole_charge_is_drawn_like_a_remanence(scene: mf.Scene) -> None:
    wide = scene.replace(spreads={"remanence": 0.05})
    strength = wide.draw(np.random.default_rng(6)).magnets
    charge = wide.replace(magnets={"pole_charge": 1.0}).draw(np.random.default_rng(6)).magnets
    assert strength is not None
    assert charge is not None
    assert strength.charge / mf.Magnets().charge == pytest.approx(charge.charge, rel=1e-15)


def test_a_single_component_draws_no_angles() -> None:
    assert mf.Scene(sequence=("NNNN",)).draw(np.random.default_rng(0)).start_angles == ()
