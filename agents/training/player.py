"""Networks that play many episodes at once: what they are shown and what they remember."""

from typing import Any

import numpy as np
from sb3_contrib.common.maskable.policies import MaskableActorCriticPolicy
from stable_baselines3.common.policies import BasePolicy

from agents.settings import Shown
from agents.training.shown import View, shown_space


class Player:
    """Plays so many episodes, which begin together.

    Parameters
    ----------
    policy : stable_baselines3.common.policies.BasePolicy
        What chooses the actions.
    shown : Shown
        What it wants to be shown.
    env : magfold_env.envs.chain_env.ChainEnv
        A single environment like those that are played.
    count : int
        How many.
    sampled : bool
        Whether actions are drawn as in training; else they are the most probable ones.

    Raises
    ------
    ValueError
        If the environment has other observations or actions.
    """

    def __init__(
        self,
        policy: BasePolicy,
        shown: Shown,
        env: Any,
        count: int = 1,
        sampled: bool = False,
    ) -> None:
        own = policy.observation_space, policy.action_space
        given = shown_space(shown, env.observation_space), env.action_space
        if own != given:
            raise ValueError(f"policy: its spaces {own} are not the environment's, {given}")
        self._policy: Any = policy
        self._view = View(shown, env.layout, env.observation_space, count)
        self._best = not sampled
        self._begun = np.ones(count, dtype=np.bool_)
        self._memory: Any = None
        self._masks: dict[str, Any] = {}
        if isinstance(policy, MaskableActorCriticPolicy):
            self._masks = {"action_masks": np.tile(env.action_masks(), (count, 1))}

    def act(self, observations: Any) -> Any:
        """Return the actions of all episodes, each of which has taken a step since the last."""
        seen = self._view.of(observations, self._begun)
        actions, self._memory = self._policy.predict(
            seen, self._memory, self._begun, self._best, **self._masks
        )
        self._begun = np.zeros_like(self._begun)
        return actions
