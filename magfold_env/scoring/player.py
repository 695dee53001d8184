"""Who plays many episodes at once, and the one loop in which episodes are played.

Whoever plays is a `Plan`: from episodes and some of their rows to what these do next. Networks
become one by a `Player`, which knows what they are shown and what they remember.
"""

import inspect
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np

from magfold_env.envs.baselines.constant_speed import Plan
from magfold_env.envs.chains.arrays import Ints
from magfold_env.envs.episodes import Columns, Episodes
from magfold_env.scoring.policy_file import Shown
from magfold_env.scoring.shown import View, shown_space


class Player:
    """Plays so many episodes, which begin together.

    Parameters
    ----------
    policy : magfold_env.scoring.network.Actor, or a policy of Stable-Baselines3
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
        policy: Any,
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

    def plan(self, env: Any) -> Plan:
        """Return what it asks for in the first rows of episodes, as many as it plays.

        Those of them that go on have all taken the same steps; `env` is a single environment that
        takes its actions.
        """
        table, first = env.world.actions, slice(self.count)

        def choose(episodes: Episodes[Any], rows: Ints) -> Any:
            masks = episodes.action_masks(table)
            if masks is not None:
                masks = masks[first]
            observations: Any = episodes.observe()
            if self.count < episodes.count:
                observations = observations[first]
            choice = table.read(self.act(observations, masks), self.count)
            return tuple(part[rows] for part in choice)

        return choose


def play(
    episodes: Episodes[Any],
    numbers: Sequence[int] | Ints,
    seeds: Sequence[int],
    plan_of: Callable[[slice], Plan],
) -> Iterator[Columns]:
    """Play episodes to their ends, as many at a time as there is room for.

    Parameters
    ----------
    episodes : Episodes
        The room.
    numbers : sequence of int
        Numbers of their targets, or tasks.
    seeds : sequence of int
        Of their draws, as `reset` of a single environment takes them.
    plan_of : callable
        Returns what plays a part of them, each in a row of its own.

    Yields
    ------
    dict
        How the episodes of a part end, as `Episodes.play` returns it.
    """
    for start in range(0, len(seeds), episodes.count):
        part = slice(start, start + episodes.count)
        choose = partial(plan_of(part), episodes)
        yield episodes.play(seeds[part], [int(each) for each in numbers[part]], choose)
