import numpy as np
import pytest

import magfold_env as mf
from magfold_env.envs.sequence_design import SequenceDesignEnv


@pytest.mark.parametrize("scene", ["tube-built", "tube-feed"])
@pytest.mark.parametrize("seed", range(3))
def test_one_step_is_one_simulation(scene: str, seed: int) -> None:
    env = SequenceDesignEnv(scene, baseline=None)
    observation, info = env.reset(seed=seed)
    assert not observation[env.layout.slices["released"]].any()
    action = np.random.default_rng(seed).integers(env.actions.sizes)
    observation, reward, terminated, truncated, info = env.step(action)
    assert terminated
    assert not truncated
    replay = env.to_scene()
    fold = mf.simulate(replay)
    np.testing.assert_array_equal(fold.angles, env.state.angles)
    assert (fold.word, str(fold.status), fold.energy) == (
        info["word"],
        info["status"],
        info["energy"],
    )
    assert replay.sequence == env.actions.decode(action)[0]
    assert reward == info["score"]


def test_the_minimisers_design_earns_about_nothing() -> None:
    env = SequenceDesignEnv(randomisation="none")
    rewards = []
    for target in ("LRLLL", "RLRLR"):
        env.reset(seed=0, options={"target": target})
        design = env.baseline
        assert design.sequence is not None
        assert design.speed is not None
        rewards.append(env.step(env.actions.encode(design.sequence, design.speed))[1])
    assert rewards == pytest.approx([0.0, 0.0])


def test_a_quasistatic_design_is_the_minimisers_prediction() -> None:
    env = SequenceDesignEnv(fidelity="quasistatic", components=8, targets=["LRLRLRL"])
    rng = np.random.default_rng(0)
    for _ in range(10):
        env.reset()
        *_, info = env.step(rng.integers(env.action_space.nvec))  # pyright: ignore[reportAttributeAccessIssue]
        assert info["word"] == mf.minimise(env.to_scene(), mode="forward").states[0].word
