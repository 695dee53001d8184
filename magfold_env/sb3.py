"""Vector environments for Stable-Baselines3, which the rest of the package does not need.

>>> from stable_baselines3 import PPO
>>> from magfold_env.sb3 import make_sb3_vec
>>> model = PPO("MlpPolicy", make_sb3_vec("MagFold/TubeFeed-v0", 64, shaping=True))
"""

from collections.abc import Sequence
from typing import Any, cast

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from magfold_env.files import pip_install

try:
    from stable_baselines3.common.vec_env import VecMonitor
    from stable_baselines3.common.vec_env.base_vec_env import VecEnv, VecEnvIndices
except ImportError as error:
    raise ImportError(
        f"make_sb3_vec needs Stable-Baselines3: install the extra, {pip_install('agents')}"
    ) from error

from magfold_env.envs.vector_env import ChainVectorEnv

Info = dict[str, Any]
VectorEnv = ChainVectorEnv[Any]


def make_sb3_vec(env_id: str, num_envs: int, **options: Any) -> VecMonitor:
    """Return a vector environment for Stable-Baselines3 that reports episode statistics.

    Parameters
    ----------
    env_id : str
        Id of the environment, such as ``MagFold/TubeFeed-v0``.
    num_envs : int
        Number of environments.
    **options
        Options of the vector environment: `magfold_env.envs.vector_env.ChainVectorEnv`.
    """
    made = gymnasium.make_vec(
        env_id, num_envs=num_envs, autoreset_mode=AutoresetMode.SAME_STEP, **options
    )
    return VecMonitor(FoldVecEnv(cast("VectorEnv", made.unwrapped)))


class FoldVecEnv(VecEnv):
    """A vector environment in the form of Stable-Baselines3.

    Methods and attributes requested by name, such as ``compute_reward``, are those of a single
    environment with the same options. The exception is ``action_masks``, which returns the masks of
    the requested environments. The autoreset mode must be SAME_STEP.
    """

    def __init__(self, vector: VectorEnv) -> None:
        if vector.autoreset_mode != AutoresetMode.SAME_STEP:
            raise ValueError(
                f"autoreset_mode: {vector.autoreset_mode} is not allowed; must be SAME_STEP"
            )
        self.vector = vector
        self._actions: Any = None
        given: Any = vector
        super().__init__(  # pyright: ignore[reportUnknownMemberType]
            vector.num_envs, given.single_observation_space, given.single_action_space
        )

    def reset(self) -> Any:
        """Begin new episodes, with the seeds and options set earlier, if any."""
        options = self._options[0]
        if any(each != options for each in self._options):
            key = self.vector.template.setup.option[0]
            if any(each.keys() != {key} for each in self._options):
                raise ValueError(
                    f"options: {self._options!r} are not allowed; must be the same for all "
                    f"environments, or a {key!r} for each"
                )
            options = {key: [each[key] for each in self._options]}
        observation, infos = self.vector.reset(seed=self._seeds, options=options)
        self.reset_infos = _each(infos, self.num_envs)
        self._reset_seeds()
        self._reset_options()
        return observation

    def step_async(self, actions: NDArray[Any]) -> None:
        """Store the actions for the next step."""
        self._actions = actions

    def step_wait(self) -> Any:
        """Take a step with the stored actions and return its results."""
        observation, reward, terminated, truncated, infos = self.vector.step(self._actions)
        done = terminated | truncated
        final_obs, final = infos.pop("final_obs", None), infos.pop("final_info", {})
        each = _each(infos, self.num_envs)
        if final:
            self.reset_infos = [
                info if over else before
                for info, over, before in zip(each, done, self.reset_infos, strict=True)
            ]
            ends = _each(final, self.num_envs)
            for row in np.flatnonzero(done).tolist():
                each[row] = ends[row] | {"terminal_observation": final_obs[row]}
        for row, info in enumerate(each):
            info["TimeLimit.truncated"] = bool(truncated[row] and not terminated[row])
        return observation, reward.astype(np.float32), done, each

    def close(self) -> None:
        """Close the vector environment and end its threads."""
        self.vector.close()

    def get_images(self) -> Sequence[NDArray[np.uint8] | None]:
        """Return a picture of each environment."""
        return cast("Any", self.vector).render()

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """Return an attribute of a single environment, once per requested environment."""
        return [getattr(self.vector.template, attr_name)] * len(self._rows(indices))

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Raise an error, because options are set when the environment is made."""
        raise NotImplementedError(f"{attr_name}: cannot be set once the environments are made")

    def env_method(
        self,
        method_name: str,
        *method_args: Any,
        indices: VecEnvIndices = None,
        **method_kwargs: Any,
    ) -> list[Any]:
        """Return the result of a method of a single environment, once per requested environment."""
        if method_name == "action_masks":
            masks: Any = cast("Any", self.vector).action_masks()
            return [masks[row] for row in self._rows(indices)]
        method = getattr(self.vector.template, method_name)
        return [method(*method_args, **method_kwargs)] * len(self._rows(indices))

    def env_is_wrapped(
        self,
        wrapper_class: type[gymnasium.Wrapper[Any, Any, Any, Any]],
        indices: VecEnvIndices = None,
    ) -> list[bool]:
        """Return False for every requested environment, because none is wrapped."""
        return [False] * len(self._rows(indices))

    def _rows(self, indices: VecEnvIndices) -> list[int]:
        return list(self._get_indices(indices))


def _each(infos: Info, count: int) -> list[Info]:
    """Return one info per environment from infos in the form of Gymnasium's vector API."""
    each: list[Info] = [{} for _ in range(count)]
    for key, values in infos.items():
        if key.startswith("_"):
            continue
        present = infos[f"_{key}"]
        for info, value, has in zip(each, values.tolist(), present.tolist(), strict=True):
            if has:
                info[key] = value
    return each
