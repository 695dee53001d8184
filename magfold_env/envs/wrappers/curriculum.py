"""A wrapper that makes the task harder as the agent gets better."""

from collections import deque
from collections.abc import Mapping, Sequence
from typing import Any, cast

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils import RecordConstructorArgs
from numpy.typing import NDArray

from magfold_env.envs.spaces.observation import Layout
from magfold_env.envs.tasks.checks import require, share_of, whole


class Curriculum(gymnasium.Wrapper[Any, Any, Any, Any], RecordConstructorArgs):
    """Move from one stage of a task to the next when enough recent episodes succeed.

    The wrapped environment is the last stage. Earlier stages differ from it in some options, such
    as ``{"components": 4}`` or ``{"difficulty": 0.25}``. The spaces are those of the last stage.
    Observations of shorter chains are padded with zeros at the end of each group. All stages must
    have the same actions. The stage is in ``info["stage"]``.

    Parameters
    ----------
    env : gymnasium.Env
        An environment of this package, made by `gymnasium.make`.
    stages : sequence of mapping
        Options that differ in each stage before the last, the easiest first.
    threshold : float
        Share of successes that starts the next stage.
    window : int
        Number of episodes in one stage that the share is taken over.

    Raises
    ------
    ValueError
        If there is no stage, or the spaces of the stages do not match.
    """

    def __init__(
        self,
        env: gymnasium.Env[Any, Any],
        stages: Sequence[Mapping[str, Any]],
        *,
        threshold: float = 0.8,
        window: int = 100,
    ) -> None:
        RecordConstructorArgs.__init__(self, stages=stages, threshold=threshold, window=window)
        spec = env.unwrapped.spec
        if spec is None:
            raise ValueError(f"env: {env} is not allowed; must be made by gymnasium.make")
        require(bool(stages), "stages", stages, "must have one stage or more")
        whole("window", window, 1)
        easier = [gymnasium.make(spec.id, **{**spec.kwargs, **stage}) for stage in stages]
        self._envs = [*easier, env]
        for number, each in enumerate(easier):
            _check_spaces(number, each, env)
        super().__init__(self._envs[0])
        self.observation_space = env.observation_space
        self.action_space = env.action_space
        self._threshold = share_of("threshold", threshold)
        self._stage = 0
        self._successes: deque[bool] = deque(maxlen=window)

    @property
    def spec(self) -> EnvSpec | None:
        """The specification from which `gymnasium.make` makes the same curriculum."""
        present, self.env = self.env, self._envs[-1]
        try:
            return super().spec
        finally:
            self.env = present

    @property
    def layout(self) -> Layout:
        """The slice of each group of entries in an observation."""
        return _layout(self._envs[-1])

    @property
    def stage(self) -> int:
        """Number of the current stage, from 0."""
        return self._stage

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin an episode, in the next stage if enough recent episodes succeeded."""
        full = len(self._successes) == self._successes.maxlen
        last = self._stage == len(self._envs) - 1
        if full and not last and float(np.mean(self._successes)) >= self._threshold:
            self._stage += 1
            self._successes.clear()
            if seed is None:
                # The next stage continues this one's random numbers.
                seed = int(self.env.np_random.integers(2**31))
            self.env = self._envs[self._stage]
        observation, info = self.env.reset(seed=seed, options=options)
        return self._spread(observation), info | {"stage": self._stage}

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """Step the current stage."""
        observation, reward, terminated, truncated, info = self.env.step(action)
        if terminated or truncated:
            self._successes.append(bool(info.get("is_success", False)))
        return (
            self._spread(observation),
            reward,
            terminated,
            truncated,
            info | {"stage": self._stage},
        )

    def close(self) -> None:
        """Close the environments of all stages."""
        for env in self._envs:
            env.close()

    def _spread(self, observation: Any) -> Any:
        """Pad an observation to the size of the longest chain's."""
        if self.env.observation_space == self.observation_space:
            return observation
        entries = cast("NDArray[np.float32]", observation)
        small, large = _layout(self.env), _layout(self._envs[-1])
        spread = np.zeros(large.size, dtype=np.float32)
        for name, group in small.slices.items():
            start = large.slices[name].start
            spread[start : start + group.stop - group.start] = entries[group]
        return spread


def _layout(env: gymnasium.Env[Any, Any]) -> Layout:
    return cast("Layout", env.get_wrapper_attr("layout"))


def _check_spaces(number: int, env: gymnasium.Env[Any, Any], last: gymnasium.Env[Any, Any]) -> None:
    """Refuse a stage whose observations or actions do not fit the last stage's."""
    if env.action_space != last.action_space:
        raise ValueError(
            f"stages[{number}]: the actions {env.action_space} are not allowed; "
            f"must be those of the last stage, {last.action_space}"
        )
    if env.observation_space == last.observation_space:
        return
    flat = isinstance(env.observation_space, spaces.Box)
    if not flat or _layout(env).size > _layout(last).size:
        raise ValueError(
            f"stages[{number}]: the observations {env.observation_space} are not allowed; "
            "must be flat and not larger than the last stage's"
        )
