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
