"""How good a policy is on draws that are kept for validation, while it is being trained."""

from typing import Any

import numpy as np
from sb3_contrib import MaskablePPO
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.logger import Logger

from agents.settings.env import EnvSettings
from agents.training.envs import make_env
from magfold_env.envs.tasks.draws import episode_seeds


class Validation:
    """Plays every target in turn, each time with the policy's most probable action.

    The draws are neither those of training nor those that results are reported on.

    Parameters
    ----------
    settings : EnvSettings
        The environment.
    episodes : int
        How many to play.
    """

    def __init__(self, settings: EnvSettings, episodes: int) -> None:
        self._env = make_env(settings.unshaped())
        self._seeds = episode_seeds("validation", episodes)
        inner: Any = self._env.unwrapped
        if hasattr(inner, "tasks"):
            self._wanted = [{"task": number} for number in range(len(inner.tasks))]
        else:
            self._wanted = [{"target": word} for word in inner.targets]

    def __call__(self, model: BaseAlgorithm) -> dict[str, float]:
        """Return the rate of success and the mean score of `model`."""
        ends = [self._play(model, number) for number in range(len(self._seeds))]
        return {
            # What an episode that runs out of time has not reached.
            "success_rate": float(np.mean([info.get("is_success", False) for info in ends])),
            "score": float(np.mean([info.get("score", 0.0) for info in ends])),
        }

    def _play(self, model: BaseAlgorithm, number: int) -> dict[str, Any]:
        """Play an episode and return its last info."""
        wanted = self._wanted[number % len(self._wanted)]
        observation, info = self._env.reset(seed=self._seeds[number], options=wanted)
        ended = False
        while not ended:
            action = self._greedy(model, observation)
            observation, _, terminated, truncated, info = self._env.step(action)
            ended = terminated or truncated
        return info

    def _greedy(self, model: BaseAlgorithm, observation: Any) -> Any:
        if isinstance(model, MaskablePPO):
            masks = self._env.get_wrapper_attr("action_masks")()
            return model.predict(observation, deterministic=True, action_masks=masks)[0]
        return model.predict(observation, deterministic=True)[0]


def log_validation(model: BaseAlgorithm, result: dict[str, float]) -> None:
    """Write `result` to the outputs of the model's logger, at the steps made so far."""
    # A logger of its own: what the model has recorded belongs to a later step.
    logger = Logger(None, model.logger.output_formats)
    for name, value in result.items():
        logger.record(f"validation/{name}", value)
    logger.dump(model.num_timesteps)
