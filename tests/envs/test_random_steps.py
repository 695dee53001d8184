"""Random actions never leave the spaces, break down or fill the memory."""

import tracemalloc

import gymnasium
import pytest

from magfold_env.envs import ENTRY_POINTS

WORLDS = [
    (env_id, fidelity)
    for env_id in ENTRY_POINTS
    for fidelity in ("dynamics", "quasistatic")
    if (env_id, fidelity) != ("MagFold/FeedControl-v0", "quasistatic")
]


def random_steps(env_id: str, fidelity: str, steps: int) -> None:
    env = gymnasium.make(env_id, fidelity=fidelity, randomisation="strong")
    env.action_space.seed(0)
    observation, _ = env.reset(seed=0)
    finished = 0
    for _ in range(steps):
        observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
        assert observation in env.observation_space
        assert -1.0 <= float(reward) <= 1.0
        if terminated or truncated:
            assert truncated or info["status"] != "failed", info["message"]
            finished += 1
            observation, _ = env.reset()
            assert observation in env.observation_space
    assert finished > 0


@pytest.mark.parametrize(("env_id", "fidelity"), WORLDS)
def test_some_random_steps(env_id: str, fidelity: str) -> None:
    whole_folds = "SequenceDesign" in env_id
    random_steps(
        env_id, fidelity, 3000 if fidelity == "quasistatic" else 100 if whole_folds else 600
    )


@pytest.mark.stress
@pytest.mark.parametrize(("env_id", "fidelity"), WORLDS)
def test_a_million_random_steps(env_id: str, fidelity: str) -> None:
    # A million in all: most where steps are cheap.
    random_steps(env_id, fidelity, 30_000 if fidelity == "dynamics" else 300_000)


@pytest.mark.parametrize(("env_id", "fidelity"), WORLDS)
def test_memory_stays_flat(env_id: str, fidelity: str) -> None:
    # Few targets or tasks: what is kept of each is found in the first episodes.
    env = gymnasium.make(env_id, fidelity=fidelity, difficulty=0.05)
    env.action_space.seed(0)

    def play(episodes: int) -> None:
        for _ in range(episodes):
            env.reset()
            ended = False
            while not ended:
                _, _, terminated, truncated, _ = env.step(env.action_space.sample())
                ended = terminated or truncated

    env.reset(seed=0)
    play(10)
    tracemalloc.start()
    try:
        play(5)
        before, _ = tracemalloc.get_traced_memory()
        play(15)
        after, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert after - before < 100_000
