"""Tests of `magfold scenes`: the shipped scenes, and all keys of a scene."""

from collections.abc import Iterator
from typing import Any

import pytest

import magfold_env as mf
from magfold_env.cli.scenes import Key, scene_keys
from magfold_env.scene import Schedule
from tests.command_line import rows, run


@pytest.fixture(scope="module")
def keys() -> dict[str, Key]:
    return {key.key: key for key in scene_keys()}


def dotted(values: object, before: str = "") -> Iterator[str]:
    """Yield the dotted keys of a scene's entries."""
    if isinstance(values, dict):
        for name, value in values.items():
            yield before + name
            yield from dotted(value, f"{before}{name}.")


def test_keys_are_those_of_scenes_with_all_that_there_is(keys: dict[str, Key]) -> None:
    given: set[str] = set()
    for name in mf.scene_names():
        given |= {*dotted(mf.load_scene(name).model_dump())}
    assert given <= {*keys}
    assert all(key.meaning for key in keys.values())
    assert {key.partition("[]")[0] for key in keys} - given <= {
        *(f"bumps.{name}" for name in mf.Bumps.model_fields),
        *(f"feed.schedule.{name}" for name in Schedule.model_fields),
    }
    assert {f"obstacles[].{name}" for name in mf.Rectangle.model_fields} < {*keys}


@pytest.mark.parametrize(("key", "allowed", "unit", "default", "meaning"), [
    ("casing.side", "number > 0 and ≤ 0.5", "m", "0.0125", "Edge length."),
    ("mount", "pinned, free, tube", "", "free", "`pinned`: component 1's outer hinge is fixed"),
    ("magnets", "the keys below, or null", "", "", "The magnets"),
    ("magnets.inset", "number ≥ 0 and ≤ 0.5, or 4 numbers ≥ 0 and ≤ 0.5", "m", "0.0005",
     "How far the outer"),
    ("friction", "number ≥ 0, or list of numbers ≥ 0", "", "0.35", "Coulomb coefficient"),
    ("spreads.tilt", "number ≥ 0 and ≤ 45", "degrees", "0", "How far the floor tilts"),
    ("field.magnet.position", "2 numbers ≥ -1000 and ≤ 1000", "m", "must be given",
     "Centre; the origin"),
    ("feed.schedule.time", "list of pairs (number > 0, number ≥ -20 and ≤ 20), or null",
     "s, m/s", "null", "Legs as pairs of a duration [s] and a speed [m/s]"),
    ("contact", "true or false", "", "true", "Whether squares collide"),
    ("solver.max_steps", "integer ≥ 1 and ≤ 1000000000000", "", "200000", "Work cap"),
])  # fmt: skip
def test_keys_say_what_may_be_unit_and_default(keys, key, allowed, unit, default, meaning):
    assert keys[key][:4] == (key, allowed, unit, default)
    assert keys[key].meaning.startswith(meaning)


def test_text_instead_of_a_number_is_refused_with_its_keys_unit(
    keys: dict[str, Key],
) -> None:
    for key in filter(lambda each: each.unit, keys.values()):
        given: Any = "10 mm"
        for name in reversed(key.key.split(".")):
            given = {name.removesuffix("[]"): [given] if name.endswith("[]") else given}
        with pytest.raises(mf.SceneError) as caught:
            mf.Scene(sequence=("NSNS",), **given)
        many = "number" if key.allowed.startswith("number") else "list of numbers"
        unit = key.unit.replace(", ", " and ")
        told = f"{key.key.replace('[]', '[0]')}: '10 mm' is not allowed; must be a {many} in {unit}"
        assert told in str(caught.value).splitlines()


def test_every_shipped_scene_and_all_keys_are_printed(keys: dict[str, Key]) -> None:
    result = run("scenes", "--keys", code=0)
    shown = [row[0] for row in rows(result.stdout) if row[0]]
    assert shown == [*keys]
    result = run("scenes", code=0)
    assert all(name in result.stdout for name in mf.scene_names())
