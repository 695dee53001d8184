"""Tests of whole folds: limits of gaps, joints and energy, the view from the other end, work."""

from functools import partial

import numpy as np
import pytest

import magfold_env as mf
from magfold_bench.laws.along_folds import follow
from magfold_bench.laws.dense import look_inside
from magfold_bench.laws.overlap import squares_apart
from magfold_bench.laws.random_scenes import random_scene
from magfold_env.shapes import centres
from tests.words import reverse

pytestmark = pytest.mark.laws
thoroughly = partial(pytest.param, marks=pytest.mark.slow)

NEARLY_SHARP = 1e-5  # [m] the corners' rounding takes what a sharp square has more
SETTLED = {mf.FoldStatus.FOLDED, mf.FoldStatus.MISFOLDED}
OTHER_END = (2, 3, 0, 1)


def random_faces(seed):
    """Return a sequence of six components with random magnets."""
    faces = np.random.default_rng(seed).choice(["N", "S"], (6, 4))
    return tuple("".join(row) for row in faces)


@pytest.mark.parametrize("direction", ["free", "forward", "backward"])
@pytest.mark.parametrize("seed", range(6))
def test_squares_stay_apart_and_joints_within_their_stops(seed, direction):
    scene = mf.Scene(sequence=random_faces(seed), duration=1.0)
    scene = scene.replace(casing={"corner_radius": NEARLY_SHARP})
    if direction != "free":
        scene = scene.replace(mount="tube", feed={"direction": direction, "speed": 0.2})
    run = mf.simulate(scene, seed, frame_rate=240.0).trajectory
    assert run is not None
    assert np.abs(np.diff(run.angles, axis=1)).max() < np.pi / 2 + 1e-3
    side = scene.casing.side
    places = centres(run.angles, side, run.base)
    gap = min(squares_apart(p, a, side) for p, a in zip(places, run.angles, strict=True))
    assert gap > -1e-3 * side


FEW = (3, 8, 10, 13, 14)
MANY = (pytest.param(seed, marks=pytest.mark.weekly) for seed in range(40) if seed not in FEW)


@pytest.mark.parametrize("seed", [*FEW, *map(thoroughly, range(100, 150)), *MANY])
def test_every_step_of_many_folds_keeps_all_limits(seed):
    scene = random_scene(seed)
    (motion, session), (inside, _) = follow(scene), look_inside(scene)
    assert motion.finite, session.message
    assert session.status is not mf.FoldStatus.FAILED, session.message
    assert max(inside.casings, inside.solids) <= 1e-3
    assert inside.past_stop <= scene.solver.tolerance
    assert motion.rise <= (1e-5 if scene.frictions.any() else 1e-4)


@pytest.mark.parametrize("sequence", [
    *[mf.load_scene(f"paper/sequence-{k}").sequence for k in (1, 2, 3)],
    *[random_faces(seed) for seed in range(5)],
])  # fmt: skip
@pytest.mark.parametrize("seed", [0, 1])
def test_energy_never_rises_without_friction_and_feed(sequence, seed):
    scene = mf.Scene(sequence=sequence, friction=0.0, duration=0.4)
    motion, _ = follow(scene.draw(np.random.default_rng(seed)))
    assert motion.rise < 1e-4


@pytest.mark.parametrize("number", [1, 2, 3])
@pytest.mark.parametrize("direction", ["forward", "backward"])
def test_the_view_from_the_other_end_is_the_same_fold_bit_for_bit(number, direction):
    scene = mf.load_scene(f"paper/sequence-{number}").replace(mount="tube")
    scene = scene.replace(feed={"direction": direction, "speed": 0.2})
    scene = scene.draw(np.random.default_rng(number))
    scene = scene.replace(friction=np.linspace(0.1, 0.4, scene.n))
    assert scene.start_offsets is not None
    other = scene.replace(
        sequence=["".join(faces[k] for k in OTHER_END) for faces in scene.sequence[::-1]],
        start_offsets=scene.start_offsets[::-1],
        friction=scene.frictions[::-1],
        feed={"direction": "backward" if direction == "forward" else "forward"},
    )
    a, b = mf.simulate(scene), mf.simulate(other)
    assert b.word == reverse(a.word)
    assert (b.status, b.time, b.steps) == (a.status, a.time, a.steps)
    # Both run as the one that is indexed from its held end; only the view differs.
    assert b.joint_angles == pytest.approx(-a.joint_angles[::-1], abs=1e-14)


# In each of these components once stopped and crept on in turns, a tenth of a microsecond at a
# time: pushed by hardly more than friction holds, or joined to one that friction cannot hold.
@pytest.mark.parametrize("seed", [39, 80, 229, *map(thoroughly, (246, 277))])
def test_creeping_chains_come_to_rest_in_few_steps(seed):
    fold = mf.simulate(random_scene(seed))
    assert fold.status in SETTLED
    assert fold.steps < 2000 * (1.0 + fold.time), fold.message


@pytest.mark.parametrize("seed", [246, thoroughly(277)])
def test_finer_steps_are_not_many_more(seed):
    scene = random_scene(seed)
    tolerance = scene.solver.tolerance / 20.0
    coarse, fine = mf.simulate(scene), mf.simulate(scene.replace(solver={"tolerance": tolerance}))
    assert fine.word == coarse.word
    # Steps of second order grow √20-fold, 4.5, and steps of first order twentyfold.
    assert fine.steps < 8 * coarse.steps
