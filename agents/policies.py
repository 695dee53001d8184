"""Policies that can be compared: random, the energy minimiser's design, a trained one."""

from pathlib import Path
from typing import Protocol, Self

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3 import PPO
from stable_baselines3.common.base_class import BaseAlgorithm

from magfold_env.envs.tube_feed import TubeFeedEnv


class Policy(Protocol):
    """Anything that chooses the next component's action."""

    def act(
        self, env: TubeFeedEnv, observation: NDArray[np.float32], rng: np.random.Generator
    ) -> NDArray[np.int64]:
        """Return the action for the present state of `env`; `rng` is the episode's own."""
        ...


class RandomPolicy:
    """Draws every action evenly."""

    def act(
        self, env: TubeFeedEnv, observation: NDArray[np.float32], rng: np.random.Generator
    ) -> NDArray[np.int64]:
        """Return a random action."""
        return rng.integers(env.actions.sizes)


class DesignPolicy:
    """Feeds the energy minimiser's design for the target at the speed that suits it best.

    It does not look at the chain, and its speed is the nearest that the actions offer.
    """

    def act(
        self, env: TubeFeedEnv, observation: NDArray[np.float32], rng: np.random.Generator
    ) -> NDArray[np.int64]:
        """Return the next component of the design.

        Raises
        ------
        ValueError
            If the env knows no design for the target.
        """
        baseline = env.baseline
        if baseline.sequence is None or baseline.speed is None:
            raise ValueError(f"target: {env.target!r} has no design to follow")
        return env.actions.encode(baseline.sequence[env.next_component], baseline.speed)


class TrainedPolicy:
    """A trained policy, playing its most probable action.

    Parameters
    ----------
    model : BaseAlgorithm
        The model.
    """

    def __init__(self, model: BaseAlgorithm) -> None:
        self._model = model

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read a checkpoint that `agents.train` wrote.

        Checkpoints hold pickles, which can run code: load only your own.
        """
        torch.set_num_threads(1)
        return cls(PPO.load(path, device="cpu"))

    def act(
        self, env: TubeFeedEnv, observation: NDArray[np.float32], rng: np.random.Generator
    ) -> NDArray[np.int64]:
        """Return the policy's most probable action.

        Raises
        ------
        ValueError
            If the policy was trained with other observations or actions than `env` has.
        """
        own = (self._model.observation_space, self._model.action_space)
        if own != (env.observation_space, env.action_space):
            raise ValueError(
                f"policy: its spaces {own} are not the environment's, "
                f"{(env.observation_space, env.action_space)}"
            )
        action, _ = self._model.predict(observation, deterministic=True)
        return action


def make_policy(name: str) -> Policy:
    """Return the policy called `name`: ``random``, ``minimiser``, or a checkpoint's path."""
    if name == "random":
        return RandomPolicy()
    if name == "minimiser":
        return DesignPolicy()
    return TrainedPolicy.load(name)
