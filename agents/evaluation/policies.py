"""Policies that can be compared: random, frozen choices, trained ones."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol, Self

import numpy as np
import sb3_contrib
import torch
from stable_baselines3.common.base_class import BaseAlgorithm

from agents.baselines.store import read_choices
from agents.evaluation.open_loop import FrozenPolicy
from agents.training.learners import load_model
from magfold_env.envs.fold_env import FoldEnv


class Policy(Protocol):
    """Anything that chooses the next action."""

    def act(self, env: FoldEnv[Any], observation: Any, rng: np.random.Generator) -> Any:
        """Return the action for the present state of `env`; `rng` is the episode's own."""
        ...


class RandomPolicy:
    """Draws every action evenly."""

    def act(self, env: FoldEnv[Any], observation: Any, rng: np.random.Generator) -> Any:
        """Return a random action."""
        env.action_space.seed(int(rng.integers(2**31)))
        return env.action_space.sample()


class DesignPolicy:
    """Feeds the energy minimiser's design for the target at the speed that suits it best.

    It is the design that the reward is measured against: it does not look at the chain, and its
    speed is the nearest that the actions offer.
    """

    def act(self, env: FoldEnv[Any], observation: Any, rng: np.random.Generator) -> Any:
        """Return the next component of the design.

        Raises
        ------
        ValueError
            If the env knows no design for the target.
        """
        baseline = env.baseline
        if baseline.sequence is None or baseline.speed is None:
            raise ValueError(f"target: {env.target!r} has no design to follow")
        if env.actions.components > 1:
            return env.actions.encode(baseline.sequence, baseline.speed)
        return env.actions.encode(baseline.sequence[env.next_component], baseline.speed)


class TrainedPolicy:
    """A trained policy.

    Parameters
    ----------
    model : BaseAlgorithm
        The model.
    sampled : bool
        Whether to draw actions as in training; by default the most probable one is played.
    """

    def __init__(self, model: BaseAlgorithm, sampled: bool = False) -> None:
        self._model = model
        self._sampled = sampled
        self._masked = isinstance(model, sb3_contrib.MaskablePPO)

    @classmethod
    def load(cls, path: str | Path, sampled: bool = False) -> Self:
        """Read a checkpoint that `agents.train` wrote.

        Checkpoints hold pickles, which can run code: load only your own.

        Raises
        ------
        ValueError
            If the file is damaged, or no checkpoint of an algorithm that is known.
        """
        torch.set_num_threads(1)
        return cls(load_model(path), sampled)

    @property
    def training_steps(self) -> int:
        """Environment steps that it was trained for."""
        return self._model.num_timesteps

    def act(self, env: FoldEnv[Any], observation: Any, rng: np.random.Generator) -> Any:
        """Return the policy's action.

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
        if self._sampled:
            torch.manual_seed(int(rng.integers(2**31)))
        masks: Mapping[str, Any] = {"action_masks": env.action_masks()} if self._masked else {}
        action, _ = self._model.predict(observation, deterministic=not self._sampled, **masks)
        return action


def make_policy(name: str) -> Policy:
    """Return the policy called `name`.

    Parameters
    ----------
    name : str
        ``random``; ``minimiser``, the design that rewards are measured against; the path of
        choices that `agents.baselines` wrote (``.json``), or of a checkpoint (``.zip``).

    Raises
    ------
    ValueError
        If it is none of these, or the file is damaged or not one that is understood.
    """
    if name == "random":
        return RandomPolicy()
    if name == "minimiser":
        return DesignPolicy()
    path = Path(name)
    if not path.is_file():
        raise ValueError(
            f"{name}: no such file; must be random, minimiser, choices (.json) "
            "or a checkpoint (.zip)"
        )
    return FrozenPolicy(read_choices(path)) if path.suffix == ".json" else TrainedPolicy.load(path)
