"""Environments of Stable-Baselines3 of which is shown what networks want."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper
from stable_baselines3.common.vec_env.base_vec_env import VecEnvStepReturn

from magfold_env.scoring.policy_file import Shown
from magfold_env.scoring.shown import View, shown_space


class ShownVecEnv(VecEnvWrapper):
    """Environments of Stable-Baselines3 of which is shown what is wanted."""

    def __init__(self, venv: VecEnv, shown: Shown) -> None:
        layout = venv.get_attr("layout")[0] if shown.blind else None
        self.view = View(shown, layout, venv.observation_space, venv.num_envs)
        super().__init__(venv, shown_space(shown, venv.observation_space))

    @property
    def kept(self) -> NDArray[Any] | None:
        """The observations that are shown again."""
        return self.view.frames.kept if self.view.frames else None

    def reset(self) -> Any:
        """Begin new episodes."""
        return self.view.of(self.venv.reset(), np.ones(self.num_envs, dtype=np.bool_))

    def step_wait(self) -> VecEnvStepReturn:
        """Take the step."""
        observations, rewards, dones, infos = self.venv.step_wait()
        for row in np.flatnonzero(dones).tolist():
            last = infos[row]["terminal_observation"]
            infos[row]["terminal_observation"] = self.view.last(last, row)
        return self.view.of(observations, dones), rewards, dones, infos
