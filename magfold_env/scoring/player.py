"""Networks that play many episodes at once: what they are shown and what they remember."""

import inspect
from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
from gymnasium import Space

from magfold_env.envs.chains.arrays import Ints
from magfold_env.envs.episodes import Episodes
from magfold_env.scoring.policy_file import Shown
from magfold_env.scoring.shown import View, shown_space


class Policy(Protocol):
    """What Stable-Baselines3's policies are, as far as is needed to play."""

    @property
    def observation_space(self) -> Space[Any]:
        """Of what it is shown."""
        ...

    @property
    def action_space(self) -> Space[Any]:
        """Of what it chooses."""
        ...

    def predict(
        self, observation: Any, state: Any, episode_start: Any, deterministic: bool
    ) -> tuple[Any, Any]:
        """Return actions for many observations, and what it remembers."""
        ...


class Player:
    """Plays so many episodes, which begin together.

    Parameters
    ----------
    policy : Policy
        What chooses the actions; masks those of it that it can, as sb3-contrib's ``MaskablePPO``.
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
        policy: Policy,
        shown: Shown,
        env: Any,
        count: int = 1,
        sampled: bool = False,
    ) -> None:
        own = policy.observation_space, policy.action_space
        given = shown_space(shown, env.observation_space), env.action_space
        if own != given:
            raise ValueError(f"policy: its spaces {own} are not the environment's, {given}")
        self._predict: Any = policy.predict
        self._view = View(shown, env.layout, env.observation_space, count)
        self._best = not sampled
        self.count = count
        """How many episodes."""
        self._begun = np.ones(count, dtype=np.bool_)
        self._memory: Any = None
        self._own_masks: Callable[[], Any] | None = None
        if "action_masks" in inspect.signature(policy.predict).parameters:
            self._own_masks = env.action_masks

    def act(self, observations: Any, masks: Any = None) -> Any:
        """Return the actions of all episodes, each of which has taken a step since the last.

        `masks` say which can be taken, (count, …); by default those that the environment's do.
        """
        seen = self._view.of(observations, self._begun)
        given: dict[str, Any] = {}
        if self._own_masks is not None:
            if masks is None:
                masks = np.tile(self._own_masks(), (self.count, 1))
            given["action_masks"] = masks
        actions, self._memory = self._predict(seen, self._memory, self._begun, self._best, **given)
        self._begun = np.zeros_like(self._begun)
        return actions


def choices(player: Player, env: Any, episodes: Episodes[Any]) -> Callable[[Ints], Any]:
    """Return what a player asks for in its episodes, as `Episodes.play` wants it.

    They are the first ones, and those of them that go on have all taken the same steps; `env` is a
    single environment that takes its actions.
    """
    table, first = env.world.actions, slice(player.count)

    def choose(rows: Ints) -> Any:
        masks = episodes.action_masks(table)
        if masks is not None:
            masks = masks[first]
        observations: Any = episodes.observe()
        if player.count < episodes.count:
            observations = observations[first]
        choice = table.read(player.act(observations, masks), player.count)
        return tuple(part[rows] for part in choice)

    return choose
