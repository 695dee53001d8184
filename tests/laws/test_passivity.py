"""Folding without friction: impacts keep momentum, and energy never grows without a source."""

import numpy as np
import pytest

from magfold_bench.laws.along_folds import follow
from magfold_env.scene import Scene, load_scene

pytestmark = pytest.mark.laws


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
