"""Many of `magfold_env.envs.feed_control.FeedControlEnv`, stepped on all cores."""

from collections.abc import Mapping, Sequence
from functools import partial
from itertools import count
from typing import Any, SupportsFloat

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from gymnasium.vector.utils import iterate

from magfold_env.envs.feed_control import FeedControlEnv
from magfold_env.envs.tasks.vector_options import (
    autoreset_mode_of,
    check_count,
    mask_of,
    seeds_of,
    threads_of,
)
from magfold_env.simulation.work_queue import Team

Said = tuple[Any, SupportsFloat, bool, bool, dict[str, Any]]
Infos = dict[str, Any]


class FeedControlVectorEnv(SyncVectorEnv):
    """Gymnasium's vector environment, but that threads take the steps ahead of it.

    Chains, directions of feed and what is to be done differ from one environment to the next, and
    a step simulates 20 ms, beside which Python's share is small: the environments are single
    ones.

    Parameters
    ----------
    num_envs : int
        How many.
    autoreset_mode : AutoresetMode or str
        When an episode that has ended is followed by another; Gymnasium's three modes.
    threads : int, optional
        How many threads simulate, by default as many as the process may use cores. Results do not
        depend on it.
    **options
        Those of the single environment.

    Raises
    ------
    ValueError
        For any argument that is not allowed; the message names it and what is.
    """

    def __init__(
        self,
        num_envs: int = 1,
        *,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        threads: int | None = None,
        **options: Any,
    ) -> None:
        check_count(num_envs, options.get("render_mode"))
        mode = autoreset_mode_of(autoreset_mode)
        self._team = Team(threads_of(threads))
        made = [partial(_Ahead, options) for _ in range(num_envs)]
        super().__init__(made, autoreset_mode=mode)  # pyright: ignore[reportUnknownMemberType]

    @property
    def template(self) -> FeedControlEnv:
        """The first environment."""
        first: Any = self.envs[0]
        return first.unwrapped

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: Mapping[str, Any] | None = None,
    ) -> tuple[Any, Infos]:
        """Begin new episodes; ``options`` are the single environment's, and ``reset_mask``.

        Raises
        ------
        ValueError, TypeError
            For a wrong number of seeds or an option that is not allowed.
        """
        given = dict(options or {})
        mask_of(given, self.num_envs)
        return super().reset(seed=seeds_of(seed, self.num_envs), options=given)

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, Infos]:
        """Take a step in every environment.

        Raises
        ------
        ValueError
            If an action lies outside the space.
        gymnasium.error.ResetNeeded
            Before the first reset, and, with the mode DISABLED, where an episode has ended.
        """
        over = self._autoreset_envs
        if self.autoreset_mode == AutoresetMode.DISABLED and over.any():
            raise gymnasium.error.ResetNeeded(
                f"the episodes of environments {np.flatnonzero(over).tolist()} are over; "
                "call reset(options={'reset_mask': ...}) first"
            )
        own: Any = self
        each = zip(iterate(own.action_space, actions), own.envs, over, strict=True)
        going = [(env, action) for action, env, has_ended in each if not has_ended]
        self._team.run(_step_ahead, (going, count()), len(going))
        return super().step(actions)

    def close_extras(self, **kwargs: Any) -> None:
        """End the threads."""
        self._team.close()
        super().close_extras(**kwargs)


class _Ahead(gymnasium.Wrapper[Any, Any, Any, Any]):
    """An environment whose next step may have been taken already."""

    def __init__(self, options: dict[str, Any]) -> None:
        super().__init__(FeedControlEnv(**options))
        self._said: Said | Exception | None = None

    def take(self, action: Any) -> None:
        """Take the next step, and keep what is said of it."""
        try:
            self._said = self.env.step(action)
        except Exception as error:
            self._said = error

    def step(self, action: Any) -> Said:
        """Say what was said of the step."""
        said, self._said = self._said, None
        if isinstance(said, Exception):
            raise said
        return self.env.step(action) if said is None else said


def _step_ahead(going: list[tuple[_Ahead, Any]], places: "count[int]") -> int:
    """Take steps of environments that no other thread has taken; return how many."""
    taken = 0
    while (place := next(places)) < len(going):
        env, action = going[place]
        env.take(action)
        taken += 1
    return taken
