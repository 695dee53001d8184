"""The environments of a training run, and their state."""

import pickle
import signal
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, cast

import gymnasium
import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common import vec_env
from stable_baselines3.common.vec_env.base_vec_env import VecEnvStepReturn

from agents.settings import CurriculumSettings, EnvSettings, SettingsError, TrainSettings
from magfold_env.envs.episodes import EpisodesState
from magfold_env.envs.vector_env import ChainVectorEnv
from magfold_env.envs.wrappers.curriculum import Curriculum
from magfold_env.sb3 import FoldVecEnv, make_sb3_vec
from magfold_env.scoring.policy_file import Shown
from magfold_env.scoring.shown import View, shown_space


class Resumable(gymnasium.Wrapper[Any, Any, Any, Any]):
    """Returns the state of an environment as bytes, including random numbers and wrappers."""

    def snapshot(self) -> bytes:
        """Return the complete state of the environment."""
        return pickle.dumps(self.env)

    def restore(self, snapshot: bytes) -> None:
        """Restore the state at which `snapshot` was taken."""
        self.env = pickle.loads(snapshot)


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

    inner: list[bytes] | EpisodesState
    """A snapshot of each environment, or the state of all environments that are stepped
    natively."""
    returns: NDArray[np.float32]
    """Rewards so far of the running episodes."""
    lengths: NDArray[np.int32]
    """Steps so far of the running episodes."""
    kept: NDArray[Any] | None = None
    """The stacked observations; None if each is shown once."""


def make_env(
    settings: EnvSettings,
    gamma: float | None = None,
    curriculum: CurriculumSettings | None = None,
) -> gymnasium.Env[Any, Any]:
    """Return an environment; `gamma` is the discount of its shaping, if it has any."""
    options = settings.options(gamma)
    env = gymnasium.make(settings.id, disable_env_checker=True, **options)
    if curriculum is None:
        return env
    stages = [settings.changed(stage).options() for stage in curriculum.stages]
    return Curriculum(env, stages, threshold=curriculum.threshold, window=curriculum.window)


def check_envs(settings: TrainSettings) -> None:
    """Make every environment of a run once, as a check.

    Raises
    ------
    SettingsError
        If an option is not allowed, or the environments of two phases do not match.
    """
    *before, main = settings.phases
    last = _checked("env", settings, main.env)
    _stepping(settings, main.env)
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


class Processes(vec_env.SubprocVecEnv):
    """One process per environment; the main process handles Ctrl-C and ends them."""

    def __init__(self, makers: list[Callable[[], gymnasium.Env[Any, Any]]]) -> None:
        super().__init__([partial(_undisturbed, make) for make in makers])

    def close(self) -> None:
        """End the processes, even during a step of which some answers have been read."""
        if self.waiting:
            for process in self.processes:
                process.kill()
                process.join()
            self.closed = True
        super().close()


def _undisturbed(make: Callable[[], gymnasium.Env[Any, Any]]) -> gymnasium.Env[Any, Any]:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    return make()


def make_training_envs(settings: TrainSettings, phase: int) -> vec_env.VecMonitor:
    """Return the environments of a phase of the run, numbered from 0, seeded."""
    env, learner = settings.phases[phase].env, settings.learner
    gamma = learner.gamma
    if _stepping(settings, env) == "native":
        envs = make_sb3_vec(env.id, settings.envs, **env.options(gamma))
    else:

        def make() -> gymnasium.Env[Any, Any]:
            return Resumable(make_env(env, gamma, settings.curriculum))

        makers = [make] * settings.envs
        apart = settings.envs > 1 and _stepping(settings, env) == "processes"
        envs = vec_env.VecMonitor(Processes(makers) if apart else vec_env.DummyVecEnv(makers))
    if (learner.frames, learner.blind) != (1, False):
        envs = vec_env.VecMonitor(ShownVecEnv(envs.venv, learner))
    # The first phase has the seed of the run; the seeds of the others follow from it.
    follow = np.random.SeedSequence(settings.seed, spawn_key=(phase,)).generate_state(1)
    envs.seed(int(follow[0]) if phase else settings.seed)
    return envs


def _stepping(settings: TrainSettings, env: EnvSettings) -> str:
    """Return the method of stepping the environments of a phase; refuse an impossible one."""
    possible = settings.curriculum is None
    if settings.stepping == "native" and not possible:
        raise SettingsError(
            "stepping: 'native' is not allowed with a curriculum; must be 'processes' or 'serial'"
        )
    if settings.stepping is not None:
        return settings.stepping
    if possible:
        return "native"
    # Without dynamics, a step is faster than communication with another process.
    return "serial" if env.fidelity == "quasistatic" else "processes"


def envs_state(envs: vec_env.VecMonitor) -> EnvsState:
    """Return the state of `envs`."""
    native = _native(envs)
    inner = (
        cast("list[bytes]", envs.env_method("snapshot")) if native is None else native.get_state()
    )
    kept = envs.venv.kept if isinstance(envs.venv, ShownVecEnv) else None
    return EnvsState(
        inner,
        envs.episode_returns.copy(),
        envs.episode_lengths.copy(),
        None if kept is None else kept.copy(),
    )


def _native(envs: vec_env.VecMonitor) -> ChainVectorEnv[Any] | None:
    """Return the native vector environment inside, or None if there is none."""
    inner = envs.venv.venv if isinstance(envs.venv, ShownVecEnv) else envs.venv
    return inner.vector if isinstance(inner, FoldVecEnv) else None


def set_envs_state(envs: vec_env.VecMonitor, state: EnvsState) -> None:
    """Restore the state of `envs` at which `state` was taken."""
    native = _native(envs)
    if native is not None and isinstance(state.inner, EpisodesState):
        native.set_state(state.inner)
    else:
        for number, snapshot in enumerate(cast("list[bytes]", state.inner)):
            envs.env_method("restore", snapshot, indices=number)
    envs.episode_returns = state.returns.copy()
    envs.episode_lengths = state.lengths.copy()
    if isinstance(envs.venv, ShownVecEnv) and envs.venv.kept is not None:
        envs.venv.kept[:] = state.kept


def _checked(key: str, settings: TrainSettings, env: EnvSettings) -> gymnasium.Env[Any, Any]:
    """Return an environment; errors name the key of its settings."""
    try:
        return make_env(env, settings.learner.gamma, settings.curriculum)
    except ValueError as error:
        raise SettingsError(f"{key}: {error}") from None
