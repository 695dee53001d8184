"""The engine against the slow reference simulation: whole folds, by words and by trajectories.

The reference has sharp corners, smoothed friction and springs for stops, so times of snaps differ
a little and final angles of misfolds by tenths of a degree.
"""

import numpy as np
import pytest

from magfold_env.scene import load_scene
from magfold_env.simulation.simulate import simulate
from tests.reference import simulation as reference
from tests.reference.simulation_kernels import SLOW, run

pytestmark = pytest.mark.laws


def compare(number, direction, seed, step, after):
    scene = load_scene(f"paper/sequence-{number}")
    if direction != "free":
        scene = scene.replace(mount="tube", feed={"direction": direction, "speed": 0.05})
    scene = scene.draw(np.random.default_rng(seed))
    fold = simulate(scene, frame_rate=240.0)
    slow = reference.simulate(scene, step=step, after=after)
    assert slow.speed < SLOW  # at rest but for the creep
    assert slow.word == fold.word
    assert np.diff(slow.angles[-1]) == pytest.approx(fold.joint_angles, abs=0.01)
    path = fold.trajectory
    assert path is not None
    joints = np.diff(slow.angles, axis=1).T
    there = np.stack([np.interp(path.time, slow.time, joint) for joint in joints], axis=1)
    apart = np.abs(there - np.diff(path.angles, axis=1))
    # A snap of 90° that comes a few milliseconds early is a large difference for a frame or two.
    assert np.median(apart) < 5e-3


def test_a_free_fold_agrees(monkeypatch):
    # Its outermost loop takes longer to compile than Python takes to run it once.
    monkeypatch.setattr(reference, "run", getattr(run, "py_func", run))
    compare(2, "free", 0, 5e-5, 0.15)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("number", [1, 2, 3])
def test_free_folds_agree(number, seed):
    compare(number, "free", seed, 1e-5, 0.35)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "direction"),
    [(1, "forward"), (1, "backward"), (2, "forward"), (2, "backward"), (3, "forward"),
     (3, "backward")],
)  # fmt: skip
def test_tube_feeds_agree(number, direction):
    """Sequence 2 in forward feed among them: both engines misfold it as LRRSL."""
    compare(number, direction, 0, 2e-5, 0.2)
