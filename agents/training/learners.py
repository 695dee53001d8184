"""The learners of Stable-Baselines3 and sb3-contrib, made from settings and read from files."""

import json
import pickle
import struct
import warnings
import zipfile
import zlib
from pathlib import Path
from typing import Any

from gymnasium import spaces
from sb3_contrib import TQC, MaskablePPO
from stable_baselines3 import PPO, SAC, HerReplayBuffer
from stable_baselines3.common import base_class, off_policy_algorithm, vec_env

from agents.features import FromTheMouth
from agents.learning_rate import LearningRate
from agents.settings import LearnerSettings, SACSettings
from agents.symmetry import FromOneSide, SymmetricPolicy, is_symmetric
from agents.symmetry_masked import MaskableSymmetricPolicy
from magfold_env.files import replacing
from magfold_env.scene import Scene

CLASSES: dict[str, type[base_class.BaseAlgorithm]] = {
    "ppo": PPO,
    "maskable-ppo": MaskablePPO,
    "sac": SAC,
    "tqc": TQC,
}
"""The class of each algorithm."""

_BY_POLICY: dict[str, type[base_class.BaseAlgorithm]] = {
    "stable_baselines3.common.policies": PPO,
    "agents.symmetry": PPO,
    "agents.symmetry_masked": MaskablePPO,
    "sb3_contrib.common.maskable.policies": MaskablePPO,
    "stable_baselines3.sac.policies": SAC,
    "sb3_contrib.tqc.policies": TQC,
}
"""The class that wrote a model, by the module of its policy."""

UNREADABLE = (
    OSError,
    ValueError,  # among them are wrong text and wrong JSON
    AttributeError,
    KeyError,
    TypeError,
    RuntimeError,  # encrypted, of an unknown method, or nested too deeply
    EOFError,
    struct.error,
    zipfile.BadZipFile,
    zlib.error,
)
"""What reading a file that is no zip file, or a damaged one, may raise."""


def make_model(
    settings: LearnerSettings, env: vec_env.VecEnv, seed: int, device: str = "cpu"
) -> base_class.BaseAlgorithm:
    """Return an untrained model.

    Parameters
    ----------
    settings : LearnerSettings
        The learner.
    env : VecEnv
        The environments to train in.
    seed : int
        Seed of networks and actions.
    device : str
        Where the networks live.

    Raises
    ------
    ValueError
        If the features are to be symmetric and the scene is not.
    """
    own = {"algorithm", "learning_rate", "anneal", "hidden", "hindsight", "features"}
    options: dict[str, Any] = settings.model_dump(exclude=own)
    if isinstance(settings, SACSettings) and settings.hindsight is not None:
        options["replay_buffer_class"] = HerReplayBuffer
        options["replay_buffer_kwargs"] = settings.hindsight.model_dump()
    policy: dict[str, Any] = {"net_arch": list(settings.hidden)}
    dictionary = isinstance(env.observation_space, spaces.Dict)
    kind: Any = "MultiInputPolicy" if dictionary else "MlpPolicy"
    if settings.features != "chain":
        scene: Scene = env.get_attr("scene")[0]
        policy["features_extractor_class"] = FromTheMouth
        policy["features_extractor_kwargs"] = {"backward": scene.feed.direction == "backward"}
        if settings.features == "symmetric":
            if not is_symmetric(scene):
                raise ValueError(
                    "learner.features: 'symmetric' is not allowed for a scene with a field, a "
                    "slope or magnets that differ from left to right; must be chain or mouth"
                )
            masked = settings.algorithm == "maskable-ppo"
            kind = MaskableSymmetricPolicy if masked else SymmetricPolicy
            policy["features_extractor_class"] = FromOneSide
    return CLASSES[settings.algorithm](
        kind,
        env,
        learning_rate=LearningRate(settings.learning_rate, settings.anneal),
        policy_kwargs=policy,
        seed=seed,
        device=device,
        **options,
    )


def save_policy(model: base_class.BaseAlgorithm, path: Path) -> None:
    """Write `model` to `path` (``.zip``) under a temporary name and move it into place."""
    with replacing(path) as temporary:
        model.save(temporary)


def load_model(path: str | Path, device: str = "cpu") -> base_class.BaseAlgorithm:
    """Read a model of any of the algorithms, to choose actions with.

    Such files hold pickles, which can run code: load only your own.

    Raises
    ------
    ValueError
        If there is no such file, or it is damaged or no model of an algorithm that is known.
    """
    written_by = _class_of(Path(path))
    # A replay buffer is large, and hindsight's wants an environment.
    without: dict[str, Any] = {}
    if issubclass(written_by, off_policy_algorithm.OffPolicyAlgorithm):
        without = {"buffer_size": 1, "replay_buffer_class": None, "replay_buffer_kwargs": {}}
    try:
        return written_by.load(path, device=device, **without)
    except (*UNREADABLE, AssertionError, ImportError, pickle.UnpicklingError) as error:
        raise ValueError(f"{path}: is not a model, or is damaged: {error}") from None


def _class_of(path: Path) -> type[base_class.BaseAlgorithm]:
    """Return the class that wrote a model, without unpickling anything."""
    if not path.is_file():
        raise ValueError(f"{path}: no such file; must be a model (.zip)")
    try:
        with zipfile.ZipFile(path) as archive:
            module = json.loads(archive.read("data"))["policy_class"]["__module__"]
    except UNREADABLE as error:
        raise ValueError(f"{path}: is not a model, or is damaged: {error}") from None
    if module not in _BY_POLICY:
        known = ", ".join(CLASSES)
        raise ValueError(f"{path}: its policy is from {module!r}; must be of one of {known}")
    return _BY_POLICY[module]


def enter(model: base_class.BaseAlgorithm, envs: vec_env.VecEnv) -> None:
    """Let `model` go on in other environments of the same spaces, in new episodes."""
    model.set_env(envs)
    buffer = getattr(model, "replay_buffer", None)
    if isinstance(buffer, HerReplayBuffer):
        buffer.env = envs
        with warnings.catch_warnings():
            # It says that it does what it is asked to.
            warnings.filterwarnings("ignore", "The last trajectory in the replay buffer")
            buffer.truncate_last_trajectory()
