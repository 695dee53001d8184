"""Squares are hard: at no recorded time do they overlap, nor joints pass their stops."""

import numpy as np
import pytest

from magfold_bench.laws.overlap import squares_apart
from magfold_env.scene import Scene
from magfold_env.shapes import centres
from magfold_env.simulation.simulate import simulate

pytestmark = pytest.mark.laws


NEARLY_SHARP = 1e-5  # [m] the corners' rounding takes what a sharp square has more


@pytest.mark.parametrize("direction", ["free", "forward", "backward"])
@pytest.mark.parametrize("seed", range(6))
def test_squares_stay_apart_and_joints_within_their_stops(seed, direction):
    faces = np.random.default_rng(seed).choice(["N", "S"], (6, 4))
    scene = Scene(sequence=tuple("".join(row) for row in faces), duration=1.0)
    scene = scene.replace(casing={"corner_radius": NEARLY_SHARP})
    if direction != "free":
        scene = scene.replace(mount="tube", feed={"direction": direction, "speed": 0.2})
    fold = simulate(scene, seed, frame_rate=240.0)
    run = fold.trajectory
    assert run is not None
    assert np.abs(np.diff(run.angles, axis=1)).max() < np.pi / 2 + 1e-3
    side = scene.casing.side
    places = centres(run.angles, side, run.base)
    gap = min(squares_apart(p, a, side) for p, a in zip(places, run.angles, strict=True))
    assert gap > -1e-3 * side
