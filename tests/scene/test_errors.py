"""Tests of error messages for scenes."""

from typing import Any

import pytest

import magfold_env as mf

SEQUENCE = ("NSNN", "NSSN", "SNSS")
TUBE: dict[str, Any] = {"mount": "tube"}
FIXED: dict[str, Any] = {"position": (0.05, 0.05), "width": 0.02, "height": 0.02, "thickness": 0.01}

FOUR, THREE = [1.0] * 4, [1.0] * 3
FACES_OR = (
    "must be one number, or four, one a face (front-left, back-left, back-right, front-right)"
)
WRONG: list[tuple[dict[str, Any], str, str]] = [
    ({"colour": "red"}, "colour", "unknown key, must be one of sequence"),
    ({"casing": {"side": 5}}, "casing.side", "must be at most 0.5 m; 5 mm are 0.0"),
    ({"casing": {"side": 0.005, "mass": 0.5}, "magnets": None}, "casing.mass", "0.5 g are 0.0005"),
    ({"casing": {"mass": [3.7, 3.5, 3.6]}}, "casing.mass", "at most 1.95 kg where casing.side is"),
    ({"casing": {"mass": [1, -2, 1]}}, "casing.mass[1]", "must be greater than 0"),
    ({"casing": {"hinge": "face"}}, "casing.hinge", "must be 'corner'"),
    ({"sequence": ["NSNS", "nsns"]}, "sequence[1]", "must be four letters"),
    ({"sequence": []}, "sequence", "must have at least one component"),
    ({"feed": {"speed": [0.1] * 4}}, "feed.speed",
     "must be one number, or 3, one for each component"),
    ({"feed": {"bore": 0.01}}, "feed.bore", "must be at least the casing's"),
    ({"feed": {"speed": 1e9}}, "feed.speed", "must be at most 20 m/s"),
    ({"feed": {"bore": 2e4}}, "feed.bore", "must be at most 1000 m"),
    ({"feed": {"schedule": {"time": [[1.0, 0.0], [1, -0.1]]}}}, "feed.schedule.time", "a leg with"),
    ({"feed": {"schedule": {"time": [[1.0, -50]]}}}, "feed.schedule.time[0][1]", "or equal to -20"),
    ({"feed": {"schedule": {"advance": [[2.0, 0.1], [2.0, 0.2]]}}}, "feed.schedule.advance",
     "every leg must lead"),
    ({"start_angles": [0.0] * 3}, "start_angles", "must be 2 numbers, one for each joint"),
    ({**TUBE, "start_angles": [0.3, 0.3]}, "start_angles", "must lie within 0.000441942 m of the"),
    ({**TUBE, "start_angles": [1.5, 1.5], "feed": {"bore": 0.1}}, "start_angles",
     "neighbouring hinges must lie at most the side"),
    ({"start_offsets": [0.0] * 3}, "start_offsets", "must be 4 numbers, one for each hinge"),
    ({**TUBE, "start_offsets": [0.0, 0.0, 5e-4, 0.0]}, "start_offsets", "within 0.000441942 m"),
    ({**TUBE, "start_offsets": [0.0] * 4, "start_angles": [0.0] * 2}, "start_offsets",
     "must be left out where start_angles"),
    ({"magnets": {"width": 0.01}}, "magnets.width", "the magnets of a casing overlap"),
    ({"magnets": {"inset": 0.01}}, "magnets.width", "must have casing.side at least 0.031 m"),
    ({"casing": {"side": 0.005}, "magnets": {"width": 0.002, "thickness": 0.0018}}, "magnets.width",
     "side - 2 (inset + thickness) = 0.0004 m, or casing.side at least 0.0066 m"),
    ({"magnets": {"remanence": None}}, "magnets.remanence", "must be given, or"),
    ({"magnets": {"remanence": 0.6, "pole_charge": 8.0}}, "magnets.pole_charge",
     "must be left out"),
    ({"magnets": {"width": [0.006] * 3}}, "magnets.width",
     FACES_OR),
    ({"magnets": {"remanence": THREE}}, "magnets.remanence", f"{FACES_OR}, or a row of four for"),
    ({"magnets": {"pole_charge": []}}, "magnets.pole_charge", f"{FACES_OR}, or a row of four for"),
    ({"magnets": {"remanence": [FOUR] * 2}}, "magnets.remanence",
     "must be one number, or four, or 3 rows of four, one for each component"),
    ({"magnets": {"remanence": "N42"}}, "magnets.remanence", "must be a number in T"),
    ({"magnets": {"width": [0.006] * 3 + ["6 mm"]}}, "magnets.width[3]", "must be a number in m"),
    ({"feed": {"schedule": {"time": [[1.0, "5 mm/s"]]}}}, "feed.schedule.time[0][1]",
     "must be a number in m/s"),
    ({"magnets": {"remanence": 1300}}, "magnets.remanence", "at most 10 T; 1300 mT are 1.3"),
    ({"magnets": {"pole_charge": [FOUR, THREE, FOUR]}}, "magnets.pole_charge[1]", "four numbers"),
    ({"magnets": {"pole_charge": [FOUR, [1, 0, 1, 1], FOUR]}}, "magnets.pole_charge[1][1]",
     "than 0"),
    ({"magnets": {"width": [0.007, 0.007, 0.006, 0.006]}}, "magnets.width",
     "front-left's must be at most 0.0065 m or back-left's at most 0.0065"),
    ({"magnets": {"width": [0.013, 0.001, 0.001, 0.001], "thickness": 0.001}}, "magnets.width",
     "front-left's must be at most the casing's side, 0.0125 m"),
    ({"magnets": {"width": 0.001, "thickness": [0.009, 0.001, 0.004, 0.001]}}, "magnets.thickness",
     "and back-right overlap, their insets and thicknesses must add up to at most the casing's"),
    ({"field": {"magnet": {"width": 0.1}}}, "field.magnet.position", "must be"),
    ({"field": {"magnet": {**FIXED, "width": 20}}}, "field.magnet.width", "20 mm are 0.02"),
    ({**TUBE, "field": {"magnet": {**FIXED, "position": (-0.05, 0.015)}}}, "field.magnet.position",
     "as a casing is long: nowhere both x < 0.0176777 and |y| < 0.0"),
    ({**TUBE, "obstacles": [{"position": [-0.02, 0.0], "size": [0.01, 0.01]}]},
     "obstacles[0].position", "must leave free the tube's bore"),
    ({"friction": [0.1, 0.2]}, "friction", "must be one number, or 3, one for each component"),
    ({"gravity": {"in_plane": [0.0]}}, "gravity.in_plane", "must have a value"),
    ({"solver": {"method": "paper"}}, "solver.method", "the paper's solver"),
    ({"solver": {"max_steps": 10**19}}, "solver.max_steps", "less than or equal to 1000000000000"),
    ({"spreads": {"inset": 0.9}}, "spreads.inset", "a scene at its end: magnets"),
    ({"magnets": {"remanence": 4}, "spreads": {"magnet": 0.9, "remanence": 0.5}}, "spreads.magnet",
     "must keep magnets.remanence at most 10 T; draws reach 11.4"),
    ({"feed": {"speed": 15}, "spreads": {"feed_jitter": 0.5}}, "spreads.feed_jitter",
     "must keep feed.speed at most 20 m/s; draws reach"),
]  # fmt: skip


@pytest.mark.parametrize(("change", "key", "remedy"), WRONG)
def test_wrong_values_are_named_with_key_value_and_remedy(change, key, remedy):
    given: dict[str, Any] = {"sequence": SEQUENCE}
    with pytest.raises(mf.SceneError) as caught:
        mf.Scene(**given | change)
    message = str(caught.value)
    assert message.startswith(f"{key}: ")
    assert remedy in message.partition(" is not allowed; ")[2]
    with pytest.raises(mf.SceneError) as again:
        mf.Scene(**given).replace(**change)
    assert str(again.value) == message


@pytest.mark.parametrize("casing", [
    {"side": 0.5},
    {"mass": 1.0},
    {"mass": (3.7, 0.0037, 3.7)},  # one that is too heavy to be moved
    {"mass": 1e300},  # beyond any slip of units
    {"side": 0.001},
    {"side": 1e-200},
])  # fmt: skip
def test_what_is_no_slip_of_units_is_allowed(casing: dict[str, Any]) -> None:
    mf.Scene(sequence=SEQUENCE, casing=mf.Casing(**casing), magnets=None)


def test_a_scene_at_the_end_of_its_spreads_is_told_in_one_line() -> None:
    magnets = mf.Magnets(width=(0.006, 0.007, 0.006, 0.007))  # of which all overlap at that end
    with pytest.raises(mf.SceneError) as caught:
        mf.Scene(sequence=SEQUENCE, magnets=magnets, spreads=mf.Spreads(side=0.2))
    assert str(caught.value).startswith("spreads.side: 0.2 is not allowed; a scene at its end: ")
    assert str(caught.value).count("; magnets.width: ") == 3
    assert "\n" not in str(caught.value)


def test_every_problem_has_its_own_line_and_a_misspelt_key_its_right_one() -> None:
    with pytest.raises(mf.SceneError) as caught:
        mf.load_scene("tube-feed").replace(
            sequence=("N", "NSNS"), casing={"mass": -1.0, "side": -2.0}, friction=True
        )
    keys = [line.split(":")[0] for line in str(caught.value).splitlines()]
    assert keys == ["sequence[0]", "casing.side", "casing.mass", "friction"]
    wrong: dict[str, Any] = {"frction": 0.1, "casing": {"sides": 0.01}}
    with pytest.raises(mf.SceneError) as caught:
        mf.Scene(sequence=SEQUENCE, **wrong)
    casing, friction = str(caught.value).splitlines()
    assert casing.endswith("hinge; did you mean side?")
    assert friction.endswith("duration; did you mean friction?")
    with pytest.raises(mf.SceneError, match=r"^sequence: None is not allowed; must be given"):
        mf.Scene(**{})


def test_a_class_without_a_source_has_no_units() -> None:
    space: dict[str, Any] = {"mf": mf, "__name__": "nowhere"}
    exec("class Own(mf.Magnets): pass", space)
    with pytest.raises(mf.SceneError, match=r"width: '6 mm' is not allowed; must be a number$"):
        space["Own"](width="6 mm")
