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


def test_overlapping_starts_overlap():
    for scene in some("overlapping"):
        assert scene.start_angles is not None
        start = headings(scene.start_angles)
        deep = deepest_overlap(scene.replace(mount="free"), start, np.zeros(2), scene.n)
        assert deep > 0.1 * scene.casing.side
