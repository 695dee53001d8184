"""The environments of a training run, and their state."""

from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common import vec_env
from stable_baselines3.common.vec_env.base_vec_env import VecEnvStepReturn

from agents.settings import EnvSettings, SettingsError, TrainSettings
from magfold_env.envs.episodes import EpisodesState
from magfold_env.envs.vector_env import ChainVectorEnv
from magfold_env.sb3 import make_sb3_vec
from magfold_env.scoring.policy_file import Shown
from magfold_env.scoring.shown import View, shown_space


class ShownVecEnv(vec_env.VecEnvWrapper):
    """Environments of Stable-Baselines3 with observations in the form for networks."""

    def __init__(self, venv: vec_env.VecEnv, shown: Shown) -> None:
        layout = venv.get_attr("layout")[0] if shown.blind else None
        self.view = View(shown, layout, venv.observation_space, venv.num_envs)
        super().__init__(venv, shown_space(shown, venv.observation_space))

    @property
    def kept(self) -> NDArray[Any] | None:
        """The stacked observations."""
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


@dataclass(frozen=True)
class EnvsState:
    """The states of all environments of a run."""

    inner: EpisodesState
    """The state of all of them."""
    returns: NDArray[np.float32]
    """Rewards so far of the running episodes."""
    lengths: NDArray[np.int32]
    """Steps so far of the running episodes."""
    kept: NDArray[Any] | None = None
    """The stacked observations; None if each is shown once."""


def make_env(settings: EnvSettings, gamma: float | None = None) -> gymnasium.Env[Any, Any]:
    """Return an environment; `gamma` is the discount of its shaping, where there is any."""
    return gymnasium.make(settings.id, disable_env_checker=True, **settings.options(gamma))


def check_envs(settings: TrainSettings) -> None:
    """Make every environment of a run once, as a check.

    Raises
    ------
    SettingsError
        If an option is not allowed, or the environments of two phases do not match.
    """
    *before, main = settings.phases
    last = _checked("env", settings, main.env)
    for number, phase in enumerate(before):
        key = f"pretraining[{number}].env"
        env = _checked(key, settings, phase.env)
        for name in ("observation_space", "action_space"):
            own, wanted = getattr(env, name), getattr(last, name)
            if own != wanted:
                raise SettingsError(
                    f"{key}: its {name} {own} is not allowed; "
                    f"must be that of the main phase, {wanted}"
                )


def make_training_envs(settings: TrainSettings, phase: int) -> vec_env.VecMonitor:
    """Return the environments of a phase of the run, numbered from 0, seeded."""
    env, learner = settings.phases[phase].env, settings.learner
    envs = make_sb3_vec(env.id, settings.envs, **env.options(learner.gamma))
    if (learner.frames, learner.blind) != (1, False):
        envs = vec_env.VecMonitor(ShownVecEnv(envs.venv, learner))
    # The first phase has the seed of the run; the seeds of the others follow from it.
    follow = np.random.SeedSequence(settings.seed, spawn_key=(phase,)).generate_state(1)
    envs.seed(int(follow[0]) if phase else settings.seed)
    return envs


def envs_state(envs: vec_env.VecMonitor) -> EnvsState:
    """Return where `envs` are."""
    kept = envs.venv.kept if isinstance(envs.venv, ShownVecEnv) else None
    return EnvsState(
        _native(envs).get_state(),
        envs.episode_returns.copy(),
        envs.episode_lengths.copy(),
        None if kept is None else kept.copy(),
    )


def _native(envs: vec_env.VecMonitor) -> ChainVectorEnv[Any]:
    """Return the native vector environment within."""
    inner: Any = envs.venv.venv if isinstance(envs.venv, ShownVecEnv) else envs.venv
    return inner.vector


def set_envs_state(envs: vec_env.VecMonitor, state: EnvsState) -> None:
    """Go back to where `envs` were when `state` was taken."""
    _native(envs).set_state(state.inner)
    envs.episode_returns = state.returns.copy()
    envs.episode_lengths = state.lengths.copy()
    if isinstance(envs.venv, ShownVecEnv) and envs.venv.kept is not None:
        envs.venv.kept[:] = state.kept


def _checked(key: str, settings: TrainSettings, env: EnvSettings) -> gymnasium.Env[Any, Any]:
    """Return an environment; errors name the key of its settings."""
    try:
        return make_env(env, settings.learner.gamma)
    except ValueError as error:
        raise SettingsError(f"{key}: {error}") from None
