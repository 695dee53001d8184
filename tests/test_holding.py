"""Tests of limit loads: hand calculations, symmetry, and errors."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import magfold_env as mf
from magfold_bench.laws.random_scenes import random_scene
from magfold_env.fold import FoldStatus
from magfold_env.scene import Rectangle
from magfold_env.shapes import FloatArray
from tests.folds import lying

SIDE = mf.Casing().side
HALF = SIDE * math.sqrt(0.5)
ARM = 0.3826 * SIDE  # c of the friction ellipsoid
MASS, GRAVITY = 0.0037, 9.8
# Of two components: one that is far too heavy to be moved.
HEAVY: dict[str, Any] = {"mass": (1000.0 * MASS, MASS)}
EXACT = mf.Scene(sequence=("NNSS", "SSNN"), friction=0.0, magnets=mf.Magnets(accuracy=1e-8))


def torque_about_hinge(fold: mf.Fold) -> float:
    """Return the torque on the second of two components about the hinge [N·m]."""
    force, torque = mf.forces(fold.scene, fold.angles)
    arm = HALF * np.array([math.cos(fold.angles[1]), math.sin(fold.angles[1])])
    return float(torque[1] + arm[0] * force[1, 1] - arm[1] * force[1, 0])


@pytest.mark.parametrize("friction", [0.0, 0.4])
@pytest.mark.parametrize("field", [None, {"uniform": (0.0, 0.002)}])
def test_two_components_by_hand(friction: float, field: dict[str, Any] | None) -> None:
    if field and not friction:
        return  # nothing would hold the chain
    scene = EXACT.replace(friction=friction, casing=HEAVY)
    fold = lying(scene.replace(field=field), "L")
    # The second component turns about the hinge, while the first one stays.
    rubs = friction * MASS * GRAVITY * math.hypot(HALF, ARM)
    closed = torque_about_hinge(fold)
    assert closed > 0.0
    found = mf.holding(fold, pulled=2)
    assert found.opening[0] == pytest.approx([math.inf, closed + rubs], rel=1e-6)
    # To pull on its centre takes half a diagonal's arm, and where along it no force does.
    expected = (closed + rubs) / HALF / np.maximum(np.cos(found.directions), 1e-9)
    free = np.cos(found.directions) > 1e-3
    assert found.pull[free] == pytest.approx(expected[free], rel=1e-6)
    assert np.isinf(found.pull[~free]).all()
    assert (found.pulled, found.held) == (2, 1)


def test_the_stiffness_is_the_slope_of_the_moment() -> None:
    fold = lying(EXACT, "L")
    turned = [
        torque_about_hinge(replace(fold, angles=fold.angles - [0.0, step]))
        for step in (0.0, 1e-3, 2e-3)
    ]
    slope = (-1.5 * turned[0] + 2.0 * turned[1] - 0.5 * turned[2]) / 1e-3
    assert mf.holding(fold).stiffness == pytest.approx([slope], rel=2e-3)
    assert slope < 0.0


def test_one_component_slides_away() -> None:
    scene = mf.Scene(sequence=("NNSS",), magnets=None, friction=0.3)
    grip = 0.3 * MASS * GRAVITY
    assert mf.holding(lying(scene, "")).pull == pytest.approx(np.full(24, grip), rel=1e-7)
    leaning = scene.replace(gravity={"in_plane": (1.0, 0.0)})
    found = mf.holding(lying(leaning, ""), directions=[0.0, math.pi])
    assert found.pull == pytest.approx([grip - MASS, grip + MASS], rel=1e-7)
    assert str(found) == (
        "component 1 gives way at 0.00718 N towards 0°, 0° right of its front "
        "(the mount and the floor hold)"
    )


def test_obstacles_hold() -> None:
    scene = mf.Scene(sequence=("NNSS",), magnets=None, start_angles=(), friction=0.3)
    # Turned by 45° its faces look along the axes.
    fold = lying(scene, "", first=math.pi / 4)
    reach = float(fold.centres()[0, 0]) + 0.5 * SIDE
    wall = Rectangle(position=(reach + 0.001, 0.0), size=(0.002, 0.1))
    fold = replace(fold, scene=scene.model_copy(update={"obstacles": (wall,)}))
    found = mf.holding(fold, directions=[0.0, math.pi / 2, math.pi])
    grip = 0.3 * MASS * GRAVITY
    assert found.pull == pytest.approx([math.inf, grip, grip], rel=1e-6)


def test_a_pendulum_hangs() -> None:
    scene = mf.Scene(
        sequence=("NNSS", "NNSS"), magnets=None, mount="pinned", friction=0.0,
        gravity=mf.Gravity(in_plane=(0.0, -2.0)),
    )  # fmt: skip
    found = mf.holding(lying(scene, "S", first=-math.pi / 2))
    assert found.opening == pytest.approx(np.zeros((1, 2)), abs=1e-9)
    assert found.stiffness == pytest.approx([2.0 * MASS * HALF], rel=1e-6)


def folded(seed: int, **changes: Any) -> mf.Fold:
    fold = mf.simulate(random_scene(2 * seed).replace(**changes))
    if fold.status not in {FoldStatus.FOLDED, FoldStatus.MISFOLDED}:
        return folded(seed + 100, **changes)
    return fold


def loads(found: mf.Holding) -> FloatArray:
    """Return moments and pulls in one row."""
    return np.concatenate([found.opening.ravel(), found.pull])


@settings(max_examples=8, deadline=None)
@given(st.integers(0, 25))
def test_the_mirror_image_bears_the_mirrored_loads(seed: int) -> None:
    fold = folded(seed)
    # A casing's left and right faces change places.
    swapped = tuple(f[3] + f[2] + f[1] + f[0] for f in fold.scene.sequence)
    scene = fold.scene.model_copy(update={"sequence": swapped})
    image = replace(fold, scene=scene, angles=-fold.angles, base=fold.base * [1.0, -1.0])
    found = mf.holding(fold)
    mirrored = mf.holding(image, directions=-found.directions)
    assert mirrored.opening[:, ::-1] == pytest.approx(found.opening, rel=1e-5, abs=1e-9)
    assert mirrored.pull == pytest.approx(found.pull, rel=1e-5, abs=1e-7)
    assert mirrored.stiffness == pytest.approx(found.stiffness, rel=1e-4, abs=1e-7)


@settings(max_examples=8, deadline=None)
@given(st.integers(0, 25))
def test_a_chain_bears_the_same_from_its_other_end(seed: int) -> None:
    fold = folded(seed, mount="free")
    n, sequence = fold.scene.n, fold.scene.sequence[::-1]
    other = fold.scene.replace(sequence=tuple(f[2:] + f[:2] for f in sequence))
    reach = 2.0 * HALF * np.stack([np.cos(fold.angles), np.sin(fold.angles)], axis=1)
    turned = replace(
        fold, scene=other, angles=fold.angles[::-1] + math.pi, base=fold.base + reach.sum(axis=0)
    )
    one = mf.holding(fold)
    two = mf.holding(turned, pulled=n)
    assert (two.pulled, two.held) == (n, 1)
    assert two.opening[::-1, ::-1] == pytest.approx(one.opening, rel=1e-5, abs=1e-9)
    assert two.pull == pytest.approx(one.pull, rel=1e-5, abs=1e-7)


@settings(max_examples=8, deadline=None)
@given(st.integers(0, 25), st.floats(1.0, 3.0))
def test_more_friction_holds_no_less(seed: int, factor: float) -> None:
    fold = folded(seed)
    rougher = fold.scene.replace(friction=factor * fold.scene.frictions)
    once, more = loads(mf.holding(fold)), loads(mf.holding(replace(fold, scene=rougher)))
    assert (more >= once * (1.0 - 1e-6)).all()


def test_without_magnets_only_stops_hold() -> None:
    # A ring of eight around a hole: component 8 lies flush on component 1.
    scene = mf.Scene(sequence=("----",) * 8, magnets=None, friction=0.0)
    ring = mf.holding(lying(scene, "RLLLRLL"))
    outward = np.array([[letter == "L", letter == "R"] for letter in "RLLLRLL"])
    assert ring.opening == pytest.approx(np.where(outward, math.inf, 0.0), abs=1e-9)
    loose = mf.holding(lying(scene.replace(contact=False), "RLLLRLL"))
    assert loose.opening == pytest.approx(np.zeros((7, 2)), abs=1e-9)


def test_the_tube_holds_what_is_in_it() -> None:
    scene = mf.load_scene("paper/sequence-3").replace(
        mount="tube", feed={"direction": "forward", "schedule": {"advance": [[3.2, 0.05]]}}
    )
    fold = mf.simulate(scene)
    assert (fold.status, fold.in_tube) == (FoldStatus.HELD, 3)
    found = mf.holding(fold)
    assert (found.pulled, found.held) == (1, 0)
    assert np.isinf(found.opening[-2:]).all()
    assert np.isfinite(found.opens[:2]).all()
    back = mf.simulate(scene.replace(feed={"direction": "backward"}))
    found = mf.holding(back)
    assert (found.pulled, found.held) == (6, 0)
    assert np.isinf(found.opening[:2]).all()


def test_json_holds_it_all(tmp_path: Path) -> None:
    found = mf.holding(mf.simulate(mf.load_scene("paper/sequence-3")))
    found.to_json(tmp_path / "holding.json")
    data = json.loads((tmp_path / "holding.json").read_text("utf-8"))
    assert data["pull"] == found.pull.tolist()
    assert data["opening"][0] == [None, found.opening[0, 1]]
    assert data["fold"]["word"] == "LRLLL"
    assert found.least_pull[0] == found.pull.min()


@pytest.mark.parametrize(("changes", "arguments", "message"), [
    ({"status": FoldStatus.UNSETTLED}, {}, "fold.status: 'unsettled' is not allowed; must be"),
    ({}, {"held": 1}, "held: 1 is not allowed; must be from 1 to 6 and not the one"),
    ({"angles": np.arange(6.0)}, {}, "is not allowed; must be 0 at rest; it is the largest"),
])  # fmt: skip
def test_what_is_not_allowed_is_told(changes, arguments, message):
    fold = mf.simulate(mf.load_scene("paper/sequence-3"))
    with pytest.raises(mf.SceneError) as caught:
        mf.holding(replace(fold, **changes), **arguments)
    assert message in str(caught.value)
