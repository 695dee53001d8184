"""Folding without friction: impacts keep momentum, and energy never grows without a source."""

import numpy as np
import pytest

from magfold_bench.laws.along_folds import follow
from magfold_env.scene import Scene, load_scene
from tests.laws.test_conservation import momentum_of, thrown

pytestmark = pytest.mark.laws


@pytest.mark.parametrize("number", [1, 2, 3])
def test_folding_without_friction_keeps_momentum_through_impacts(number):
    scene = load_scene(f"paper/sequence-{number}").replace(friction=0.0, duration=0.2)
    session = thrown(scene, number, 3.0)
    linear, angular = momentum_of(session)
    session.settle()
    size = scene.masses.sum() * 1.0
    linear_after, angular_after = momentum_of(session)
    assert linear_after == pytest.approx(linear, abs=1e-4 * size)
    # Rotation is kept to the order of the solver's tolerance, 1e-3.
    assert angular_after == pytest.approx(angular, rel=2e-3, abs=1e-6)


SEQUENCES = {
    **{f"sequence-{k}": load_scene(f"paper/sequence-{k}").sequence for k in (1, 2, 3)},
    **{
        f"random-{seed}": tuple(
            "".join(row) for row in np.random.default_rng(seed).choice(["N", "S"], (6, 4))
        )
        for seed in range(5)
    },
}


@pytest.mark.parametrize("name", SEQUENCES)
@pytest.mark.parametrize("seed", [0, 1])
def test_energy_never_rises_without_friction_and_feed(name, seed):
    scene = Scene(sequence=SEQUENCES[name], friction=0.0, duration=0.4)
    motion, _ = follow(scene.draw(np.random.default_rng(seed)))
    assert motion.rise < 1e-4
