"""Everything that decides how a training run goes on, as bytes and back."""

import io
import pickle
from dataclasses import dataclass
from typing import Any

import gymnasium
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm
from stable_baselines3.common.vec_env import VecMonitor

from agents.training.envs import EnvsState, envs_state, set_envs_state
from agents.training.learners import CLASSES
from agents.training.progress import Progress
from agents.training.random_state import RandomState, random_state, set_random_state

MODEL, REPLAY, REST = "model.zip", "replay_buffer.pkl", "state.pkl"


@dataclass(frozen=True)
class RunState:
    """What is not in the model's own file.

    Attributes
    ----------
    progress : Progress
        How far the run has come.
    random : RandomState
        Random numbers of the process.
    actions : gymnasium.Space
        The space that random actions are drawn from, with its random numbers.
    envs : EnvsState
        Where the environments are.
    records : dict
        What the logger's attributes hold and has not written yet, by their name.
    events : dict
        Sizes of TensorBoard's files.
    """

    progress: Progress
    random: RandomState
    actions: gymnasium.Space[Any]
    envs: EnvsState
    records: dict[str, dict[str, Any]]
    events: dict[str, int]


def pack(
    model: BaseAlgorithm, envs: VecMonitor, progress: Progress, events: dict[str, int]
) -> dict[str, bytes]:
    """Return the state of a run between two rollouts, as named parts."""
    state = RunState(
        progress,
        random_state(),
        model.action_space,
        envs_state(envs),
        {name: dict(getattr(model.logger, name)) for name in _RECORDS},
        events,
    )
    parts = {MODEL: _written(model.save), REST: pickle.dumps(state)}
    if isinstance(model, OffPolicyAlgorithm):
        parts[REPLAY] = _written(model.save_replay_buffer)
    return parts


def unpack_rest(parts: dict[str, bytes]) -> RunState:
    """Return the part of the state that is not in the model's own files."""
    return pickle.loads(parts[REST])


def unpack_model(
    parts: dict[str, bytes], state: RunState, algorithm: str, envs: VecMonitor, device: str
) -> BaseAlgorithm:
    """Return the model as it was, in `envs`, which are taken to where they were.

    Parameters
    ----------
    parts : dict
        What `pack` returned.
    state : RunState
        The rest of them.
    algorithm : str
        Name of the learner.
    envs : VecMonitor
        Environments of the same phase of the same run.
    device : str
        Where the networks live.
    """
    model = CLASSES[algorithm].load(
        io.BytesIO(parts[MODEL]), env=envs, device=device, force_reset=False
    )
    if isinstance(model, OffPolicyAlgorithm):
        model.load_replay_buffer(io.BytesIO(parts[REPLAY]), truncate_last_traj=False)
    # Last, since making a model seeds all of these.
    model.action_space = state.actions
    set_envs_state(envs, state.envs)
    set_random_state(state.random)
    return model


def set_records(logger: Logger, state: RunState) -> None:
    """Give `logger` what another had not written yet."""
    for name in _RECORDS:
        getattr(logger, name).update(state.records[name])


_RECORDS = ("name_to_value", "name_to_count", "name_to_excluded")


def _written(save: Any) -> bytes:
    buffer = io.BytesIO()
    save(buffer)
    return buffer.getvalue()
