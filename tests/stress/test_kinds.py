"""Kinds of scenes hold what their names say, and a case's name gives one scene."""

import numpy as np
import pytest

from magfold_bench.laws.overlap import deepest_overlap
from magfold_bench.stress.campaign import Case
from magfold_bench.stress.kinds import KINDS
from magfold_env.shapes import headings

CHEAP = [name for name in KINDS if name != "long"]


def some(kind, count=40):
    return [Case(0, kind, number).scene() for number in range(count)]


@pytest.mark.parametrize("kind", CHEAP)
def test_a_name_gives_one_scene_with_nothing_left_to_draw(kind):
    scenes = some(kind, 5)
    assert scenes == some(kind, 5)
    assert all(scene.is_concrete for scene in scenes)
    assert Case(1, kind, 0).scene() != scenes[0]


def test_shares_are_of_a_hundred():
    assert sum(kind.share for kind in KINDS.values()) == 100


def test_corners_are_reached():
    ratios = [s.masses.max() / s.masses.min() for s in some("masses", 200)]
    assert 1e4 < max(ratios) <= 1e6
    frictions = {s.friction for s in some("friction")}
    assert {0.0, 10.0} < frictions
    speeds = np.concatenate([s.speeds for s in some("feed")])
    assert speeds.min() < 1e-3
    assert speeds.max() > 1.0
    insets = [np.min(s.magnets.inset) for s in some("gaps") if s.magnets]
    assert min(insets) < 1e-5
    tolerances = [s.solver.tolerance for s in some("tolerances", 100)]
    assert min(tolerances) < 1e-11
    assert max(tolerances) > 1e-2
    assert any(s.magnets is None for s in some("remanence"))
    assert max(s.solver.time_step for s in some("paper")) > 0.01
    assert Case(0, "long", 0).scene().n > 12


def test_overlapping_starts_overlap():
    for scene in some("overlapping"):
        assert scene.start_angles is not None
        start = headings(scene.start_angles)
        deep = deepest_overlap(scene.replace(mount="free"), start, np.zeros(2), scene.n)
        assert deep > 0.1 * scene.casing.side


def test_straight_chains_are_their_own_mirror_images():
    for scene in some("straight"):
        assert all(faces == faces[::-1] for faces in scene.sequence)
