"""Wrappers of vector environments, named as Gymnasium's are: as those of single ones."""

from abc import abstractmethod
from typing import Any, cast

import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv, VectorWrapper
from gymnasium.vector.utils import batch_space, create_empty_array
from numpy.typing import NDArray

from magfold_env.envs.chains.arrays import Bools
from magfold_env.envs.tasks.checks import whole
from magfold_env.envs.vector_env import Infos
from magfold_env.envs.wrappers.mouth_order import MouthOrder

Singles = NDArray[np.float32]


class _Observation(VectorWrapper[Any, Any, Any, Any, Any]):
    """Shows arrays in another form, whenever episodes that have ended are followed by others.

    Gymnasium's base class of such wrappers refuses SAME_STEP.
    """

    def __init__(self, env: VectorEnv[Any, Any, Any], space: spaces.Box) -> None:
        super().__init__(env)
        self._mode = env.metadata["autoreset_mode"]
        self.single_observation_space = space
        self.observation_space = batch_space(space, env.num_envs)
        self._over = np.zeros(env.num_envs, dtype=np.bool_)

    @abstractmethod
    def _shown(self, observations: Any, begun: Bools, stepped: Bools) -> Any:
        """Return the form of all observations; some environments began, or made a step."""

    @abstractmethod
    def _last(self, observation: Any, row: int) -> Any:
        """Return the form of an episode's last observation, which another's first follows."""

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
    """Many of `magfold_env.envs.wrappers.mouth_order.MouthOrderObservation`."""

    def __init__(self, env: VectorEnv[Any, Any, Any]) -> None:
        inner: Any = env.unwrapped

        def of_one(name: str) -> Any:
            native = hasattr(inner, "template")
            return getattr(inner.template, name) if native else inner.get_attr(name)[0]

        backward = of_one("scene").feed.direction == "backward"
        self._ordered = MouthOrder(of_one("layout"), backward)
        super().__init__(env, self._ordered.space)

    def _shown(self, observations: Singles, begun: Bools, stepped: Bools) -> Singles:
        return self._ordered(observations)

    def _last(self, observation: Singles, row: int) -> Singles:
        return self._ordered(observation)


class FrameStackObservation(_Observation):
    """Shows the last observations, the newest last: `gymnasium.wrappers.FrameStackObservation`.

    Gymnasium has no vector form of it. An episode's first observation stands for those before it.

    Parameters
    ----------
    env : gymnasium.vector.VectorEnv
        Any whose observations are arrays.
    stack_size : int
        How many observations are shown.

    Raises
    ------
    ValueError
        If it is not 1 or more, or observations are no arrays.
    """

    def __init__(self, env: VectorEnv[Any, Any, Any], stack_size: int) -> None:
        whole("stack_size", stack_size, 1)
        space = cast("Any", env).single_observation_space
        if not isinstance(space, spaces.Box):
            raise ValueError(f"env: observations {space} are not allowed; must be a Box")
        self._frames = Frames(cast("spaces.Box", space), stack_size, env.num_envs)
        super().__init__(env, self._frames.space)

    def _shown(self, observations: NDArray[Any], begun: Bools, stepped: Bools) -> NDArray[Any]:
        return self._frames.push(observations, begun, stepped)

    def _last(self, observation: NDArray[Any], row: int) -> NDArray[Any]:
        return self._frames.last(observation, row)


class Frames:
    """The last observations of many environments, the newest last.

    Parameters
    ----------
    space : gymnasium.spaces.Box
        Of one observation.
    stack_size : int
        How many of an environment's are kept.
    count : int
        How many environments.

    Attributes
    ----------
    space : gymnasium.spaces.Box
        Of what is kept of an environment, (stack_size, ...).
    kept : array
        What is, (count, stack_size, ...).
    """

    def __init__(self, space: spaces.Box, stack_size: int, count: int) -> None:
        self.space = cast("spaces.Box", batch_space(space, stack_size))
        self.kept = cast("NDArray[Any]", create_empty_array(self.space, count))

    def push(self, observations: NDArray[Any], begun: Bools, stepped: Bools) -> NDArray[Any]:
        """Take in observations of environments that began, or made a step; return all, copied.

        An episode's first observation stands for those before it.
        """
        self.kept[stepped, :-1] = self.kept[stepped, 1:]
        self.kept[stepped, -1] = observations[stepped]
        self.kept[begun] = observations[begun, None]
        return self.kept.copy()

    def last(self, observation: NDArray[Any], row: int) -> NDArray[Any]:
        """Return an episode's last observations, the newest of which is given."""
        return np.concatenate([self.kept[row, 1:], observation[None]])
