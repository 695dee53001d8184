"""Scenes: what is said about what is not allowed."""

import math
from typing import Any

import pytest

import magfold_env as mf

SEQUENCE = ("NSNN", "NSSN", "SNSS")
FIXED: dict[str, Any] = {"position": (0.05, 0.05), "width": 0.02, "height": 0.02, "thickness": 0.01}

WRONG: list[tuple[dict[str, Any], str]] = [
    ({"colour": "red"}, "colour: 'red' is not allowed; unknown key, must be one of sequence"),
    ({"casing": {"side": 5}}, "casing.side: 5 is not allowed; must be at most 0.5 m; 5 mm are 0.0"),
    (
        {"casing": {"side": 0.005, "mass": 0.5}, "magnets": None},
        "casing.mass: 0.5 is not allowed; must be at most 0.125 kg where casing.side is 0.005 m; "
        "0.5 g are 0.0005",
    ),
    (
        {"casing": {"mass": [3.7, 3.5, 3.6]}},
        "casing.mass: (3.7, 3.5, 3.6) is not allowed; must be at most 1.95 kg where casing.side is "
        "0.0125 m; 3.5 g are 0.0035",
    ),
    ({"casing": {"mass": -1.0}}, "casing.mass: -1.0 is not allowed; must be greater than 0"),
    ({"casing": {"mass": [1, -2, 1]}}, "casing.mass[1]: -2 is not allowed; must be greater than 0"),
    ({"casing": {"hinge": "face"}}, "casing.hinge: 'face' is not allowed; must be 'corner'"),
    ({"sequence": ["NSNS", "nsns"]}, "sequence[1]: 'nsns' is not allowed; must be four letters"),
    ({"sequence": []}, "sequence: [] is not allowed; must have at least one component"),
    ({"sequence": "NSNS NSNSN"}, "sequence[1]: 'NSNSN' is not allowed; must be four letters"),
    (
        {"feed": {"speed": [0.1] * 4}},
        "feed.speed: (0.1, 0.1, 0.1, 0.1) is not allowed; must have 3",
    ),
    ({"feed": {"bore": 0.01}}, "feed.bore: 0.01 is not allowed; must be at least the casing's"),
    ({"start_angles": [0.0] * 3}, "start_angles: (0.0, 0.0, 0.0) is not allowed; must have 2"),
    (
        {"mount": "tube", "start_angles": [0.3, 0.3]},
        "start_angles: (0.3, 0.3) is not allowed; hinges must lie within 0.000441942 m of the "
        "tube's axis, as its bore asks; their narrowest strip reaches 0.00261",
    ),
    (
        {"mount": "tube", "start_angles": [1.5, 1.5], "feed": {"bore": 0.1}},
        "start_angles: (1.5, 1.5) is not allowed; neighbouring hinges must lie at most the side",
    ),
    ({"start_offsets": [0.0] * 3}, "start_offsets: (0.0, 0.0, 0.0) is not allowed; must have 4"),
    (
        {"mount": "tube", "start_offsets": [0.0, 0.0, 5e-4, 0.0]},
        "start_offsets: (0.0, 0.0, 0.0005, 0.0) is not allowed; must lie within 0.000441942 m",
    ),
    (
        {"mount": "tube", "start_offsets": [0.0] * 4, "start_angles": [0.0] * 2},
        "start_offsets: (0.0, 0.0, 0.0, 0.0) is not allowed; must be left out where start_angles",
    ),
    ({"start_angle_spread": 0.6}, "start_angle_spread: 0.6 is not allowed; must be less than or"),
    ({"magnets": {"width": 0.01}}, "magnets.width: 0.01 is not allowed; the magnets of a casing"),
    (
        {"magnets": {"inset": 0.01}},
        "magnets.width: 0.006 is not allowed; the magnets of a casing overlap, no magnet so thick "
        "fits, must have casing.side at least 0.031 m",
    ),
    (
        {"casing": {"side": 0.005}, "magnets": {"width": 0.002, "thickness": 0.0018}},
        "magnets.width: 0.002 is not allowed; the magnets of a casing overlap, must be at most "
        "side - 2 (inset + thickness) = 0.0004 m, or casing.side at least 0.0066 m",
    ),
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
        {"magnets": {"width": [0.007, 0.007, 0.006, 0.006]}},
        "magnets.width: (0.007, 0.007, 0.006, 0.006) is not allowed; the magnets of front-left and "
        "back-left overlap, front-left's must be at most 0.0065 m or back-left's at most 0.0065",
    ),
    (
        {"magnets": {"width": [0.013, 0.001, 0.001, 0.001], "thickness": 0.001}},
        "magnets.width: (0.013, 0.001, 0.001, 0.001) is not allowed; front-left's must be at most "
        "the casing's side, 0.0125 m",
    ),
    (
        {"magnets": {"width": 0.001, "thickness": [0.009, 0.001, 0.004, 0.001]}},
        "magnets.thickness: (0.009, 0.001, 0.004, 0.001) is not allowed; the magnets of front-left "
        "and back-right overlap, their insets and thicknesses must add up to at most the casing's",
    ),
    ({"field": {"uniform": [0.1]}}, "field.uniform: [0.1] is not allowed; must have a value"),
    ({"field": {"magnet": {"width": 0.1}}}, "field.magnet.position: None is not allowed; must be"),
    (
        {"mount": "tube", "field": {"magnet": {**FIXED, "position": (-0.05, 0.015)}}},
        "field.magnet.position: (-0.05, 0.015) is not allowed; must leave free the tube's bore and "
        "as much before its mouth as a casing is long: nowhere both x < 0.0176777 and |y| < 0.0",
    ),
    ({"mount": "glued"}, "mount: 'glued' is not allowed; must be 'pinned', 'free' or 'tube'"),
    ({"friction": math.nan}, "friction: nan is not allowed; must be a finite number"),
    ({"gravity": {"in_plane": [0.0]}}, "gravity.in_plane: [0.0] is not allowed; must have a value"),
    ({"casing": {"mass": [1, True, 1]}}, "casing.mass[1]: True is not allowed; must be a valid nu"),
    (
        {"feed": {"schedule": {"time": [[1.0, 0.0], [1.0, -0.1]]}}},
        "feed.schedule.time: ((1.0, 0.0), (1.0, -0.1)) is not allowed; must have a leg with a",
    ),
    (
        {"feed": {"schedule": {"advance": [[2.0, 0.1], [2.0, 0.2]]}}},
        "feed.schedule.advance: ((2.0, 0.1), (2.0, 0.2)) is not allowed; every leg must lead",
    ),
    (
        {"mount": "tube", "obstacles": [{"position": [-0.02, 0.0], "size": [0.01, 0.01]}]},
        "obstacles[0].position: (-0.02, 0.0) is not allowed; must leave free the tube's bore",
    ),
    ({"spreads": {"inset": 0.9}}, "spreads.inset: 0.9 is not allowed; a scene at its end: magnets"),
    (
        {"magnets": {"remanence": 1300}},
        "magnets.remanence: 1300 is not allowed; must be at most 10 T; 1300 mT are 1.3",
    ),
    *(
        ({"magnets": {name: 5}}, f"magnets.{name}: 5 is not allowed; must be at most 0.5 m; 5 mm")
        for name in ("width", "height", "thickness", "inset")
    ),
    *(
        (
            {"field": {"magnet": {**FIXED, name: 20}}},
            f"field.magnet.{name}: 20 is not allowed; must be at most 0.5 m; 20 mm are 0.02",
        )
        for name in ("width", "height", "thickness")
    ),
    ({"feed": {"speed": 1e9}}, "feed.speed: 1000000000.0 is not allowed; must be at most 20 m/s"),
    (
        {"feed": {"schedule": {"time": [[1.0, 0.1], [1.0, -50]]}}},
        "feed.schedule.time[1][1]: -50 is not allowed; must be greater than or equal to -20",
    ),
    *(
        (
            {"solver": {name: 10**19}},
            f"solver.{name}: 10000000000000000000 is not allowed; must be less than or equal to "
            "1000000000000",
        )
        for name in ("max_steps", "max_steps_per_second")
    ),
    (
        {"magnets": {"remanence": 4}, "spreads": {"magnet": 0.9, "remanence": 0.5}},
        "spreads.magnet: 0.9 is not allowed; must keep magnets.remanence at most 10 T; draws reach "
        "11.4",
    ),
    (
        {"feed": {"speed": 15}, "spreads": {"feed_jitter": 0.5}},
        "spreads.feed_jitter: 0.5 is not allowed; must keep feed.speed at most 20 m/s; draws reach",
    ),
    ({"friction": [0.1, 0.2]}, "friction: (0.1, 0.2) is not allowed; must have 3 numbers"),
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


def test_a_misspelt_key_is_answered_by_the_one_that_was_meant() -> None:
    wrong: dict[str, Any] = {"frction": 0.1, "casing": {"sides": 0.01}}
    with pytest.raises(mf.SceneError) as caught:
        mf.Scene(sequence=SEQUENCE, **wrong)
    casing, friction = str(caught.value).splitlines()
    assert casing.endswith("hinge; did you mean side?")
    assert friction.endswith("duration; did you mean friction?")


@pytest.mark.parametrize(
    "casing",
    [
        {"side": 0.5},
        {"mass": 1.0},
        {"mass": (3.7, 0.0037, 3.7)},  # one that is too heavy to be moved
        {"mass": 1e300},  # beyond any slip of units
        {"side": 0.001},
        {"side": 1e-200},
    ],
)
def test_what_is_no_slip_of_units_is_allowed(casing: dict[str, Any]) -> None:
    mf.Scene(sequence=SEQUENCE, casing=mf.Casing(**casing), magnets=None)


def test_a_scene_at_the_end_of_its_spreads_is_told_in_one_line() -> None:
    magnets = mf.Magnets(width=(0.006, 0.007, 0.006, 0.007))  # of which all overlap at that end
    with pytest.raises(mf.SceneError) as caught:
        mf.Scene(sequence=SEQUENCE, magnets=magnets, spreads=mf.Spreads(side=0.2))
    assert str(caught.value).startswith("spreads.side: 0.2 is not allowed; a scene at its end: ")
    assert str(caught.value).count("; magnets.width: ") == 3
    assert "\n" not in str(caught.value)


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
