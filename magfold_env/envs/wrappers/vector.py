"""Wrappers of vector environments, named like the wrappers of single environments."""

from collections.abc import Callable
from typing import Any, cast

import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv, VectorWrapper
from gymnasium.vector.utils import batch_space, create_empty_array
from numpy.typing import NDArray

from magfold_env.envs.chains.arrays import Bools
from magfold_env.envs.tasks.checks import whole
from magfold_env.envs.vector_env import Infos
from magfold_env.envs.wrappers.canonical import CanonicalView
from magfold_env.envs.wrappers.mouth_order import MouthOrder


class _Observation(VectorWrapper[Any, Any, Any, Any, Any]):
    """Changes the form of array observations, in every autoreset mode.

    Gymnasium's base class for such wrappers does not support SAME_STEP. `shown` returns all
    observations in the new form, given which environments have begun and which have taken a step.
    `last` returns the new form of an episode's last observation, given its row.
    """

    def __init__(
        self,
        env: VectorEnv[Any, Any, Any],
        space: spaces.Box,
        shown: Callable[[NDArray[Any], Bools, Bools], NDArray[Any]],
        last: Callable[[NDArray[Any], int], NDArray[Any]],
    ) -> None:
        super().__init__(env)
        self._mode = env.metadata["autoreset_mode"]
        self.single_observation_space = space
        self.observation_space = batch_space(space, env.num_envs)
        self._over = np.zeros(env.num_envs, dtype=np.bool_)
        self._shown, self._last = shown, last

    def reset(
        self, *, seed: Any = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, Infos]:
        """Begin new episodes."""
        begun = (options or {}).get("reset_mask", np.ones(self.num_envs, dtype=np.bool_))
        observations, infos = self.env.reset(seed=seed, options=options)
        self._over = self._over & ~begun
        return self._shown(observations, begun, np.zeros_like(begun)), infos

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, Infos]:
        """Take a step in every environment."""
        observations, rewards, terminated, truncated, infos = self.env.step(actions)
        begun, self._over = self._over, terminated | truncated
        if self._mode == AutoresetMode.SAME_STEP:
            begun = self._over
            if begun.any():
                final = infos["final_obs"].copy()
                for row in np.flatnonzero(begun).tolist():
                    final[row] = self._last(final[row], row)
                infos = infos | {"final_obs": final}
        shown = self._shown(observations, begun, ~begun)
        return shown, rewards, terminated, truncated, infos


class MouthOrderObservation(_Observation):
    """The vector form of `magfold_env.envs.wrappers.mouth_order.MouthOrderObservation`."""

    def __init__(self, env: VectorEnv[Any, Any, Any]) -> None:
        layout, scene = _of_one(env, "layout"), _of_one(env, "scene")
        order = MouthOrder(layout, scene.feed.direction == "backward")
        super().__init__(
            env, order.space, lambda seen, _begun, _on: order(seen), lambda one, _: order(one)
        )


class CanonicalObservation(_Observation):
    """The vector form of `magfold_env.envs.wrappers.canonical.CanonicalObservation`."""

    def __init__(self, env: VectorEnv[Any, Any, Any]) -> None:
        view = CanonicalView(_of_one(env, "layout"), _of_one(env, "scene"))
        space = cast("Any", env).single_observation_space
        super().__init__(env, space, lambda seen, _begun, _on: view(seen), lambda one, _: view(one))


def _of_one(env: VectorEnv[Any, Any, Any], name: str) -> Any:
    """Return an attribute of the single environments."""
    inner: Any = env.unwrapped
    native = hasattr(inner, "template")
    return getattr(inner.template, name) if native else inner.get_attr(name)[0]


class FrameStackObservation(_Observation):
    """Stacks the most recent observations, like `gymnasium.wrappers.FrameStackObservation`.

    Gymnasium has no vector form of that wrapper. An episode's first observation pads the stack.

    Parameters
    ----------
    env : gymnasium.vector.VectorEnv
        An environment whose observations are arrays.
    stack_size : int
        Number of stacked observations.

    Raises
    ------
    ValueError
        If `stack_size` is less than 1, or observations are not arrays.
    """

    def __init__(self, env: VectorEnv[Any, Any, Any], stack_size: int) -> None:
        whole("stack_size", stack_size, 1)
        space = cast("Any", env).single_observation_space
        if not isinstance(space, spaces.Box):
            raise ValueError(f"env: observations {space} are not allowed; must be a Box")
        frames = Frames(cast("spaces.Box", space), stack_size, env.num_envs)
        super().__init__(env, frames.space, frames.push, frames.last)


class Frames:
    """Stacks of the last `stack_size` observations of `count` environments, the newest last."""

    def __init__(self, space: spaces.Box, stack_size: int, count: int) -> None:
        self.space = cast("spaces.Box", batch_space(space, stack_size))
        """Space of the stack of one environment, (stack_size, ...)."""
        self.kept = cast("NDArray[Any]", create_empty_array(self.space, count))
        """The stacks, (count, stack_size, ...)."""

    def push(self, observations: NDArray[Any], begun: Bools, stepped: Bools) -> NDArray[Any]:
        """Add observations of environments that began or took a step; return a copy of all stacks.

        An episode's first observation pads the stack.
        """
        self.kept[stepped, :-1] = self.kept[stepped, 1:]
        self.kept[stepped, -1] = observations[stepped]
        self.kept[begun] = observations[begun, None]
        return self.kept.copy()

    def last(self, observation: NDArray[Any], row: int) -> NDArray[Any]:
        """Return the stack of an episode's last observations, given the newest of them."""
        return np.concatenate([self.kept[row, 1:], observation[None]])
