"""Tests of limit loads against rising loads in the slow reference simulation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import magfold_env as mf
from magfold_bench.laws.random_scenes import random_scene
from magfold_env.shapes import FloatArray
from tests.reference.simulation import MOVED, Loading

pytestmark = pytest.mark.laws

LEVELS = (0.9, 0.97, 0.99, 0.995, 1.005, 1.01, 1.03, 1.1)
LEAST = 5e-5  # [N·m]: what is less is a small difference of what magnets and friction do
STRETCHED = 10.0  # times the least pull: where it acts along hinges, springs give way before
MOVING = {17, 49}  # scenes of these numbers do not come to rest
FOLDS = [seed for seed in range(52) if seed not in MOVING]
NIGHTLY = 12  # of them, which are loaded every night; the others take longer in all


def random_fold(seed: int) -> mf.Fold:
    """Return a random fold at rest, with friction up to 0.5 and exact magnets."""
    scene = random_scene(seed)
    friction = float(scene.frictions[0])
    friction = friction if friction <= 0.5 else 0.5 * friction
    fold = mf.simulate(scene.replace(friction=friction, magnets={"accuracy": 1e-5}))
    assert fold.status in {mf.FoldStatus.FOLDED, mf.FoldStatus.MISFOLDED}
    return fold


def couple(fold: mf.Fold, joint: int, way: int) -> FloatArray:
    """Return the couple of 1 N·m that turns a joint to the left (0) or to the right (1)."""
    load = np.zeros((fold.scene.n, 3))
    load[joint : joint + 2, 2] = (-1.0, 1.0) if way == 0 else (1.0, -1.0)
    return load


def pull_along(found: mf.Holding, k: int) -> FloatArray:
    """Return the pull of 1 N in a direction."""
    load = np.zeros((found.fold.scene.n, 3))
    load[found.pulled - 1, :2] = np.cos(found.directions[k]), np.sin(found.directions[k])
    return load


def compare(seed: int) -> tuple[float, float]:
    """Return the errors of the loads at which a joint and the fold give way, as shares of them.

    A joint, a side and a direction are drawn, among those whose loads are not too large.
    """
    rng = np.random.default_rng([seed, 8])
    fold = random_fold(seed)
    loading = Loading(fold.scene, fold.angles, fold.base)
    found = mf.holding(replace(fold, angles=loading.angles, base=loading.base))
    joint, way = rng.choice(np.argwhere(np.isfinite(found.opening) & (found.opening > LEAST)))
    moment = found.opening[joint, way]
    bore, moved = loading.yields_between(moment * couple(fold, joint, way), LEVELS)
    # Until it counts as moved, the joint's magnets may turn it back more.
    rise = 2.0 * MOVED * abs(found.stiffness[joint]) / moment
    off = float(max(1.0 - bore, moved - 1.0 - rise))
    k = rng.choice(np.flatnonzero(found.pull < STRETCHED * found.pull.min()))
    bore, moved = loading.yields_between(found.pull[k] * pull_along(found, k), LEVELS, found.held)
    return off, max(1.0 - bore, moved - 1.0)


@pytest.mark.medium
@pytest.mark.parametrize(
    ("seed", "joint", "way"), [pytest.param(2, 0, 1, marks=pytest.mark.slow), (3, 2, 0)]
)
def test_a_joint_opens_at_its_moment(seed: int, joint: int, way: int) -> None:
    fold = random_fold(seed)
    moment = mf.holding(fold, directions=[0.0]).opening[joint, way]
    loading = Loading(fold.scene, fold.angles, fold.base)
    bore, moved = loading.yields_between(moment * couple(fold, joint, way), (0.99, 1.01))
    assert (bore, moved) == (0.99, 1.01)


def test_a_fold_gives_way_at_its_pull() -> None:
    fold = random_fold(0)
    found = mf.holding(fold, directions=[1.0])
    loading = Loading(fold.scene, fold.angles, fold.base)
    bore, moved = loading.yields_between(found.pull[0] * pull_along(found, 0), (0.99, 1.01), 3)
    assert (bore, moved) == (0.99, 1.01)


@pytest.mark.parametrize("seed", [
    pytest.param(seed, marks=pytest.mark.slow if k < NIGHTLY else pytest.mark.weekly)
    for k, seed in enumerate(FOLDS)
])  # fmt: skip
def test_random_folds_give_way_at_their_limit_loads(seed: int) -> None:
    moment, pull = compare(seed)
    assert moment <= 0.01 + 1e-9
    assert pull <= 0.03 + 1e-9
