"""Models of Stable-Baselines3 and sb3-contrib: creation and resumption.

One file contains the complete state of a training run; an interrupted write leaves no partial file.
"""

import io
import json
import pickle
import random
import warnings
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import torch
from sb3_contrib import TQC, MaskablePPO, RecurrentPPO
from stable_baselines3 import PPO, SAC, HerReplayBuffer
from stable_baselines3.common import (
    base_class,
    logger,
    off_policy_algorithm,
    torch_layers,
    vec_env,
)

from agents import settings as train_settings
from agents.training import features, symmetry
from agents.training.envs import envs_state, set_envs_state
from agents.training.shared_layers import MaskableSharedPolicy, SharedPolicy
from magfold_env.checkpoint import CheckpointError, difference
from magfold_env.files import replacing
from magfold_env.scene import Scene

CLASSES: dict[str, type[base_class.BaseAlgorithm]] = {
    "ppo": PPO,
    "maskable-ppo": MaskablePPO,
    "recurrent-ppo": RecurrentPPO,
    "sac": SAC,
    "tqc": TQC,
}
"""The class of each algorithm."""

FEATURES = {
    torch_layers.FlattenExtractor: "chain",
    torch_layers.CombinedExtractor: "chain",
    features.FromTheMouth: "mouth",
    symmetry.FromOneSide: "symmetric",
}
"""Names of networks' features in settings, by the class that computes them."""

SHARED = {"ppo": SharedPolicy, "maskable-ppo": MaskableSharedPolicy}
"""The class of policies whose actor and critic share their hidden layers, by algorithm."""

MODEL, REPLAY, REST = "model.zip", "replay_buffer.pkl", "state.pkl"
_RECORDS = ("name_to_value", "name_to_count", "name_to_excluded")
KEY = "key.json"
_REMEDY = "train afresh, or in another folder"


@dataclass
class LearningRate:
    """A constant rate, or one that falls linearly to zero over every phase of a run.

    Stable-Baselines3 passes the remaining share of all steps up to the end of the phase, including
    the steps of earlier phases; `start` and `end` convert it to a share of the phase.
    """

    rate: float
    """The rate at the start of a phase."""
    anneal: bool
    """Whether the rate falls."""
    start: int = 0
    """Total steps at the start of the phase."""
    end: int = 1
    """Total steps at the end of the phase."""

    def __call__(self, remaining: float) -> float:
        """Return the rate when a share `remaining` of `end` steps remains."""
        if not self.anneal:
            return self.rate
        # The last rollout may exceed the end.
        return self.rate * max(0.0, remaining * self.end / (self.end - self.start))


def make_model(
    settings: train_settings.LearnerSettings, env: vec_env.VecEnv, seed: int, device: str = "cpu"
) -> base_class.BaseAlgorithm:
    """Return an untrained model; `seed` determines its initial networks and random actions.

    Raises
    ------
    ValueError
        If the features are symmetric but the scene is not.
    """
    own = {"algorithm", "learning_rate", "anneal", "hidden", "hindsight", "features"}
    own |= {"anneal_entropy", "lstm", "shared_layers", *train_settings.ObservationForm.model_fields}
    options: dict[str, Any] = settings.model_dump(exclude=own)
    if isinstance(settings, train_settings.SACSettings) and settings.hindsight is not None:
        options["replay_buffer_class"] = HerReplayBuffer
        options["replay_buffer_kwargs"] = settings.hindsight.model_dump()
    dictionary = isinstance(env.observation_space, gymnasium.spaces.Dict)
    backward = False
    if settings.features != "chain":
        scene: Scene = env.get_attr("scene")[0]
        backward = scene.feed.direction == "backward"
        if settings.features == "symmetric" and not symmetry.is_symmetric(scene):
            raise ValueError(
                "learner.features: 'symmetric' is not allowed for a scene with a field, a "
                "slope or magnets that differ from left to right; must be chain or mouth"
            )
    lstm = settings.lstm if isinstance(settings, train_settings.RecurrentPPOSettings) else None
    kind, policy = network(settings.algorithm, settings.features, dictionary, backward, lstm)
    if isinstance(settings, train_settings.PPOSettings) and settings.shared_layers:
        kind = SHARED[settings.algorithm]
    return CLASSES[settings.algorithm](
        kind,
        env,
        learning_rate=LearningRate(settings.learning_rate, settings.anneal),
        policy_kwargs=policy | {"net_arch": list(settings.hidden)},
        seed=seed,
        device=device,
        **options,
    )


def network(
    algorithm: train_settings.Algorithm,
    seen: train_settings.Features,
    dictionary: bool,
    backward: bool,
    lstm: train_settings.LSTMSettings | None,
) -> tuple[Any, dict[str, Any]]:
    """Return the class of a policy, and the options of its features and its memory.

    `dictionary` says whether observations are a dictionary; `backward` says whether the last
    component leaves the tube first.
    """
    name = f"{'MultiInput' if dictionary else 'Mlp'}{'' if lstm is None else 'Lstm'}Policy"
    kind: Any = CLASSES[algorithm].policy_aliases[name]
    options: dict[str, Any] = {}
    if lstm is not None:
        options = {
            "lstm_hidden_size": lstm.hidden,
            "n_lstm_layers": lstm.layers,
            "shared_lstm": lstm.critic == "shared",
            "enable_critic_lstm": lstm.critic == "own",
        }
    if seen == "chain":
        return kind, options
    extractor = features.FromTheMouth
    if seen == "symmetric":
        masked = algorithm == "maskable-ppo"
        kind = symmetry.MaskableSymmetricPolicy if masked else symmetry.SymmetricPolicy
        extractor = symmetry.FromOneSide
    return kind, options | {
        "features_extractor_class": extractor,
        "features_extractor_kwargs": {"backward": backward},
    }


def enter(model: base_class.BaseAlgorithm, envs: vec_env.VecEnv) -> None:
    """Let `model` continue in other environments with the same spaces, in new episodes."""
    model.set_env(envs)
    buffer = getattr(model, "replay_buffer", None)
    if isinstance(buffer, HerReplayBuffer):
        buffer.env = envs
        with warnings.catch_warnings():
            # The warning only reports the requested behaviour.
            warnings.filterwarnings("ignore", "The last trajectory in the replay buffer")
            buffer.truncate_last_trajectory()


@dataclass
class Progress:
    """The progress of a run; together with the model, it determines how the run continues."""

    phase: int = 0
    """Number of the current phase, from 0."""
    phase_start: int = 0
    """Environment steps before the current phase."""
    seconds: float = 0.0
    """Training time [s], including that of earlier processes."""
    validated_at: int = 0
    """Steps at the last validation."""
    saved_at: int = 0
    """Steps at the last checkpoint."""
    before: int = 0
    """Number of training steps of the initial policy."""
    last: dict[str, float] | None = None
    """Result of the last validation of the phase."""
    best: dict[str, float] | None = None
    """Result of the best validation of the phase."""
    validations: int = 0
    """Number of validations in the phase."""
    stale: int = 0
    """Number of validations since the best one."""
    stopping: bool = False
    """Whether the phase ends with the next step."""

    def note(self, result: dict[str, float], stop: train_settings.StopSettings) -> bool:
        """Record the result of a validation; return whether it is the best of the phase.

        The higher success rate is better; the score decides ties.
        """
        self.last = result
        self.validations += 1
        keys = ("success_rate", "score")
        rank, earlier = (
            [each[key] for key in keys] if each else [] for each in (result, self.best)
        )
        best = rank > earlier
        if best:
            self.best, self.stale = result, 0
        else:
            self.stale += 1
        enough = stop.success is not None and result["success_rate"] >= stop.success
        tired = stop.patience is not None and self.stale >= stop.patience
        self.stopping = enough or tired
        return best

    def next_phase(self, steps: int) -> None:
        """Begin the next phase after `steps` steps."""
        self.phase += 1
        self.phase_start = steps
        self.validations = 0
        self.best, self.stale, self.stopping = None, 0, False


def random_state() -> tuple[Any, ...]:
    """Return the states of the random generators of Python, NumPy, torch and the GPUs."""
    return (
        random.getstate(),
        np.random.get_state(),  # noqa: NPY002 (Stable-Baselines3 draws from this generator)
        torch.get_rng_state(),
        torch.cuda.get_rng_state_all() if torch.cuda.is_available() else [],
    )


def set_random_state(state: tuple[Any, ...]) -> None:
    """Restore the state of all random generators."""
    random.setstate(state[0])
    np.random.set_state(state[1])  # noqa: NPY002
    torch.set_rng_state(state[2])
    if state[3]:
        torch.cuda.set_rng_state_all(state[3])


def pack(
    model: base_class.BaseAlgorithm,
    envs: vec_env.VecMonitor,
    progress: Progress,
    events: dict[str, int],
) -> dict[str, bytes]:
    """Return the state of a run between two rollouts, as named parts.

    `events` contains the sizes of TensorBoard's files.
    """
    rest = {
        "progress": progress,
        "random": random_state(),
        "actions": model.action_space,  # with the generator of random actions
        "envs": envs_state(envs),
        "records": {name: dict(getattr(model.logger, name)) for name in _RECORDS},
        "events": events,
        "memory": getattr(model, "_last_lstm_states", None),
    }
    parts = {MODEL: _written(model.save), REST: pickle.dumps(rest)}
    if isinstance(model, off_policy_algorithm.OffPolicyAlgorithm):
        parts[REPLAY] = _written(model.save_replay_buffer)
    return parts


def unpack_model(
    parts: dict[str, bytes],
    settings: train_settings.TrainSettings,
    envs: vec_env.VecMonitor,
    records: logger.Logger,
) -> base_class.BaseAlgorithm:
    """Return the model in the state that `pack` stored in `parts`.

    The state of `envs`, environments of the same phase of the same run, is also restored, and the
    logger gets back the values that were not yet written.
    """
    rest: dict[str, Any] = pickle.loads(parts[REST])
    model = CLASSES[settings.learner.algorithm].load(
        io.BytesIO(parts[MODEL]), env=envs, device=settings.device, force_reset=False
    )
    if isinstance(model, off_policy_algorithm.OffPolicyAlgorithm):
        model.load_replay_buffer(io.BytesIO(parts[REPLAY]), truncate_last_traj=False)
    model.set_logger(records)
    for name in _RECORDS:
        getattr(records, name).update(rest["records"][name])
    # These states are restored last, because creating a model seeds all generators.
    model.action_space = rest["actions"]
    if isinstance(model, RecurrentPPO):
        model._last_lstm_states = rest["memory"]
    set_envs_state(envs, rest["envs"])
    set_random_state(rest["random"])
    return model


def _written(save: Any) -> bytes:
    buffer = io.BytesIO()
    save(buffer)
    return buffer.getvalue()


def write_archive(path: Path, key: Mapping[str, Any], members: Mapping[str, bytes]) -> None:
    """Write named `members` to a zip file at `path`, under a temporary name until it is complete.

    `key` contains everything on which the members depend, as JSON values. Zip files have checksums.
    """
    with replacing(path) as temporary, zipfile.ZipFile(temporary, "w") as archive:
        archive.writestr(KEY, json.dumps(key, indent=1))
        for name, content in members.items():
            archive.writestr(name, content)


def read_archive(path: Path, key: Mapping[str, Any]) -> dict[str, bytes]:
    """Return the members of the file at `path`.

    Raises
    ------
    CheckpointError
        If the file is damaged or has another key.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            members = {name: archive.read(name) for name in archive.namelist()}
        found = json.loads(members.pop(KEY))
    except Exception as e:  # a damaged zip file raises errors of many kinds
        raise CheckpointError(f"{path}: is damaged ({e}); {_REMEDY}") from None
    if where := difference(found, json.loads(json.dumps(key))):
        raise CheckpointError(f"{path}: was written by another run, {where}; {_REMEDY}")
    return members
