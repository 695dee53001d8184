"""Tests that kinds of scenes have the named features, and that drawn scenes satisfy all laws."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from magfold_bench.laws.overlap import deepest_overlap
from magfold_bench.stress.campaign import Case
from magfold_bench.stress.kinds import KINDS
from magfold_bench.stress.laws import check
from magfold_env.scene import load_scene
from magfold_env.shapes import headings
from magfold_env.simulation.session import Session
from tests.stress.drawn import scenes

NEVER_SLOW = [HealthCheck.too_slow, HealthCheck.data_too_large]
CHEAP = ("ordinary", "friction", "overlapping", "straight", "stops")
NAMED = [name for name in KINDS if name != "long"]
FOUND = sorted((Path(__file__).parent / "found").glob("*.yaml"))
KNOWN = sorted((Path(__file__).parent / "known").glob("*.yaml"))
SECONDS_EACH = {"light-end", "rounding-hides-the-rest", "stopped-by-decree"}


def some(kind, count=40):
    return [Case(0, kind, number).scene() for number in range(count)]


@pytest.mark.parametrize("kind", NAMED)
def test_a_name_gives_one_scene_with_nothing_left_to_draw(kind):
    scenes = some(kind, 5)
    assert scenes == some(kind, 5)
    assert all(scene.is_concrete for scene in scenes)
    assert Case(1, kind, 0).scene() != scenes[0]


def test_overlapping_starts_overlap():
    for scene in some("overlapping"):
        assert scene.start_angles is not None
        start = headings(scene.start_angles)
        deep = deepest_overlap(scene.replace(mount="free"), start, np.zeros(2), scene.n)
        assert deep > 0.1 * scene.casing.side


@pytest.mark.parametrize("kind", CHEAP)
@settings(max_examples=4, suppress_health_check=NEVER_SLOW)
@given(data=st.data())
def test_some_scenes_keep_every_law(kind, data):
    scene = data.draw(scenes(kind))
    if scene.mount == "tube":  # they take longest; the larger test has them
        joints = np.diff(Session(scene).angles)
        scene = scene.replace(mount="free", start_angles=np.clip(joints, -1.5, 1.5))
    assert check(scene).broken == []


@pytest.mark.stress
@pytest.mark.parametrize("kind", [name for name in KINDS if name not in {"long", "marathon"}])
@settings(max_examples=100, suppress_health_check=NEVER_SLOW)
@given(data=st.data())
def test_many_scenes_keep_every_law(kind, data):
    assert check(data.draw(scenes(kind))).broken == []


@pytest.mark.stress
def test_long_chains_keep_every_law():
    for number in range(20):
        assert Case(0, "long", number).verdict().broken == []


@pytest.mark.stress
@pytest.mark.xfail(reason="passivity: energy drifts with the number of steps")
def test_ten_million_steps_of_a_pendulum_keep_every_law():
    assert Case(0, "marathon", 0).verdict().broken == []


@pytest.mark.parametrize("path", [
    pytest.param(
        path, id=path.stem, marks=pytest.mark.medium if path.stem in SECONDS_EACH else ()
    )
    for path in FOUND
])  # fmt: skip
def test_scenes_that_once_broke_a_law_keep_all(path: Path):
    assert check(load_scene(path)).broken == []


@pytest.mark.slow
@pytest.mark.xfail(strict=True, reason="docs/stress.md says by how much, and why")
@pytest.mark.parametrize("path", KNOWN, ids=lambda path: path.stem)
def test_known_defects_are_mended(path: Path):
    assert check(load_scene(path)).broken == []
