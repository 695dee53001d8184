"""The environments of a training run and their state."""

from typing import Any, cast

import gymnasium
import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common import vec_env
from stable_baselines3.common.vec_env.base_vec_env import VecEnvStepReturn

from agents.settings import EnvSettings, SettingsError, TrainSettings
from magfold_env.envs.vector_env import ChainVectorEnv
from magfold_env.sb3 import make_sb3_vec
from magfold_env.scoring.observation_view import ObservationView, form_space
from magfold_env.scoring.policy_file import ObservationForm


class ObservationVecEnv(vec_env.VecEnvWrapper):
    """Stable-Baselines3's environments, with observations in the form that networks read."""

    def __init__(self, venv: vec_env.VecEnv, shown: ObservationForm) -> None:
        layout, scene = (venv.get_attr(name)[0] for name in ("layout", "scene"))
        self.view = ObservationView(shown, layout, scene, venv.observation_space, venv.num_envs)
        super().__init__(venv, form_space(shown, venv.observation_space))

    def reset(self) -> Any:
        """Begin new episodes, and return their observations as the networks read them."""
        return self.view.of(self.venv.reset(), np.ones(self.num_envs, dtype=np.bool_))

    def step_wait(self) -> VecEnvStepReturn:
        """Wait for the step, and return its results as the networks read them."""
        observations, rewards, dones, infos = self.venv.step_wait()
        for row in np.flatnonzero(dones).tolist():
            last = infos[row]["terminal_observation"]
            infos[row]["terminal_observation"] = self.view.last(last, row)
        return self.view.of(observations, dones), rewards, dones, infos


def make_env(settings: EnvSettings, gamma: float | None = None) -> gymnasium.Env[Any, Any]:
    """Return an environment; `gamma` is the discount of its shaping, if it has any."""
    return gymnasium.make(settings.id, disable_env_checker=True, **settings.options(gamma))


def check_envs(settings: TrainSettings) -> None:
    """Create every environment of a run once, as a check.

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
    """Return the seeded environments of a phase of the run; phases are numbered from 0."""
    env, learner = settings.phases[phase].env, settings.learner
    envs = make_sb3_vec(env.id, settings.envs, **env.options(learner.gamma))
    if learner.frames > 1 or learner.blind or learner.view != "own":
        envs = vec_env.VecMonitor(ObservationVecEnv(envs.venv, learner))
    # The first phase has the seed of the run; the seeds of the others follow from it.
    follow = np.random.SeedSequence(settings.seed, spawn_key=(phase,)).generate_state(1)
    envs.seed(int(follow[0]) if phase else settings.seed)
    return envs


def envs_state(envs: vec_env.VecMonitor) -> dict[str, Any]:
    """Return the state of `envs`: episodes, their statistics, and stacked observations."""
    vector, kept = _inner(envs)
    return {
        "episodes": vector.get_state(),
        "returns": envs.episode_returns.copy(),
        "lengths": envs.episode_lengths.copy(),
        "kept": None if kept is None else kept.copy(),
    }


def set_envs_state(envs: vec_env.VecMonitor, state: dict[str, Any]) -> None:
    """Restore a state of `envs`."""
    vector, kept = _inner(envs)
    vector.set_state(state["episodes"])
    envs.episode_returns = state["returns"].copy()
    envs.episode_lengths = state["lengths"].copy()
    if kept is not None:
        kept[:] = state["kept"]


def _inner(envs: vec_env.VecMonitor) -> tuple[ChainVectorEnv[Any], NDArray[Any] | None]:
    """Return the native vector environment inside `envs`, and stacked observations, if any."""
    inner: Any = envs.venv
    if not isinstance(inner, ObservationVecEnv):
        return inner.vector, None
    frames, vector = inner.view.frames, cast("Any", inner.venv).vector
    return vector, frames.kept if frames else None


def _checked(key: str, settings: TrainSettings, env: EnvSettings) -> gymnasium.Env[Any, Any]:
    """Return an environment; errors name the key of its settings."""
    try:
        return make_env(env, settings.learner.gamma)
    except ValueError as error:
        raise SettingsError(f"{key}: {error}") from None
