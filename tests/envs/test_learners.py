"""Learners of Stable-Baselines3 take the environments as they are."""

from typing import Any

import gymnasium
import pytest
from sb3_contrib import MaskablePPO
from sb3_contrib.common.maskable.utils import get_action_masks
from stable_baselines3 import DQN, PPO, SAC

import magfold_env  # noqa: F401 - registers the environments

pytestmark = pytest.mark.train

QUICK: dict[str, Any] = {"fidelity": "quasistatic", "components": 3}


def small() -> dict[str, Any]:
    """Return the settings of a network that learns next to nothing, and that soon."""
    return {"policy_kwargs": {"net_arch": [16]}}


def test_masks_reach_the_learner_and_are_kept() -> None:
    built = ["NSNS", "SSNN"]
    env = gymnasium.make("MagFold/TubeFeed-v0", catalogue=built, **QUICK)
    model = MaskablePPO("MlpPolicy", env, n_steps=32, batch_size=32, n_epochs=1, seed=0, **small())
    model.learn(64)
    observation, _ = env.reset(seed=0)
    for _ in range(50):
        masks = get_action_masks(env)
        action, _ = model.predict(observation, action_masks=masks)
        assert masks[int(action[0])]


@pytest.mark.parametrize(
    ("learner", "kind"), [(PPO, "multidiscrete"), (DQN, "discrete"), (SAC, "box")]
)
def test_every_action_variant_has_a_learner(learner: Any, kind: str) -> None:
    env = gymnasium.make("MagFold/TubeFeed-v0", actions=kind, **QUICK)
    settings = {PPO: {"n_steps": 32, "batch_size": 32}, DQN: {"learning_starts": 10}}
    options = settings.get(learner, {"learning_starts": 10}) | small()
    learner("MlpPolicy", env, seed=0, **options).learn(32)
