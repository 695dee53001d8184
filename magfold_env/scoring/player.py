"""Players of many simultaneous episodes, and the loop that plays them.

A `Plan` is a function that returns the next actions of given rows of episodes. A `Player` makes a
plan from a network; it stores the network's latest observations and recurrent states.
"""

import inspect
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np

from magfold_env.envs.baselines.constant_speed import Plan
from magfold_env.envs.chains.arrays import Ints
from magfold_env.envs.episodes import Columns, Episodes
from magfold_env.scoring.observation_view import ObservationView, form_space
from magfold_env.scoring.policy_file import ObservationForm


class Player:
    """Plays a number of episodes that begin together.

    Parameters
    ----------
    policy : magfold_env.scoring.network.Actor, or a policy of Stable-Baselines3
        The policy that chooses the actions; ``MaskablePPO`` of sb3-contrib also gets masks.
    shown : ObservationForm
        The form of observations for the policy.
    env : magfold_env.envs.chain_env.ChainEnv
        A single environment like the played ones, with the spaces of the policy.
    count : int
        Number of episodes.
    sampled : bool
        Whether to draw actions as in training; otherwise the most probable ones are chosen.
    """

    def __init__(
        self,
        policy: Any,
        shown: ObservationForm,
        env: Any,
        count: int = 1,
        sampled: bool = False,
    ) -> None:
        own = policy.observation_space, policy.action_space
        given = form_space(shown, env.observation_space), env.action_space
        if own != given:
            raise ValueError(f"policy: its spaces {own} are not the environment's, {given}")
        self._predict: Any = policy.predict
        self._view = ObservationView(shown, env.layout, env.scene, env.observation_space, count)
        self._best = not sampled
        self.count = count
        """Number of episodes."""
        self._begun = np.ones(count, dtype=np.bool_)
        self._memory: Any = None
        self._own_masks: Callable[[], Any] | None = None
        if "action_masks" in inspect.signature(policy.predict).parameters:
            self._own_masks = env.action_masks

    def act(self, observations: Any, masks: Any = None) -> Any:
        """Return the actions of all episodes; each must have taken one step since the last call.

        `masks`, shape (count, …), marks the possible actions; by default, it is the mask of `env`.
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
        """Return a plan that plays the first `count` rows of a batch of episodes.

        All running episodes must be at the same step. `env` must accept the actions.
        """
        table, first = env.setup.actions, slice(self.count)

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
    """Play episodes to their ends in parts, which all reuse `episodes`.

    Yields the results of `Episodes.play` for each part of the task `numbers` and `seeds`.
    `plan_of` returns the plan of a part, with one row per episode.
    """
    for start in range(0, len(seeds), episodes.count):
        part = slice(start, start + episodes.count)
        choose = partial(plan_of(part), episodes)
        yield episodes.play(seeds[part], [int(each) for each in numbers[part]], choose)
