"""Tests that `simulate_batch` and single simulations agree on any number of threads."""

import numpy as np
import pytest

import magfold_env as mf

SCENE = mf.load_scene("paper/sequence-3")
TUBE = SCENE.replace(mount="tube", feed={"direction": "backward", "speed": 0.1})
WALLS = mf.chamber((0.0186, -0.03), (0.06, 0.055), 0.024)
AMONG_WALLS = TUBE.replace(
    obstacles=WALLS, bumps={"rate": 20.0, "speed": 0.1}, feed={"direction": "forward"}, duration=0.3
)
SEEDS = range(5)


def bits(fold: mf.Fold) -> tuple[object, ...]:
    run = fold.trajectory
    frames = b"" if run is None else run.angles.tobytes() + run.rates.tobytes()
    return fold.angles.tobytes(), fold.base.tobytes(), fold.time, fold.status, fold.steps, frames


@pytest.mark.parametrize("scene", [SCENE, TUBE, AMONG_WALLS], ids=["free", "tube", "walls"])
@pytest.mark.parametrize("threads", [None, 1, 4])
def test_a_batch_gives_the_folds_of_single_runs_bit_for_bit(scene, threads):
    alone = [bits(mf.simulate(scene, seed)) for seed in SEEDS]
    assert [bits(fold) for fold in mf.simulate_batch(scene, SEEDS, threads=threads)] == alone
    assert len(set(alone)) == len(alone)


def test_every_fold_may_have_a_scene_of_its_own_and_a_record():
    folds = mf.simulate_batch([SCENE, TUBE], [3, 4], threads=2, frame_rate=240.0)
    alone = [mf.simulate(SCENE, 3, frame_rate=240.0), mf.simulate(TUBE, 4, frame_rate=240.0)]
    assert list(map(bits, folds)) == list(map(bits, alone))


def test_generators_go_on_and_there_must_be_as_many_scenes_as_seeds() -> None:
    with pytest.raises(mf.SceneError, match="scenes: 1 is not allowed; must be one, or as many as"):
        mf.simulate_batch([SCENE], [1, 2])
    rng, twin = np.random.default_rng(5), np.random.default_rng(5)
    twin.random()
    rng.random()
    assert bits(mf.simulate_batch(SCENE, [rng])[0]) == bits(mf.simulate(SCENE, twin))
