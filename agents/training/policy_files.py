"""Policies as files that run no code: weights and settings, of which code here makes the networks.

A file is one of `safetensors <https://github.com/huggingface/safetensors>`_: the length of a
header, 8 bytes, little-endian; the header, JSON, with each weight's type, shape and place, and the
settings, JSON too, among its metadata; then the weights.
"""

import hashlib
import itertools
import json
import math
import pickle
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
import torch
from gymnasium import spaces
from pydantic import Discriminator, Field, Tag, model_validator
from sb3_contrib.common.recurrent.policies import RecurrentActorCriticPolicy
from stable_baselines3.common import base_class, off_policy_algorithm, policies

from agents.settings import (
    Algorithm,
    Features,
    Group,
    LSTMSettings,
    SettingsError,
    Shown,
    Widths,
    checked,
)
from agents.training.models import CLASSES, FEATURES, UNREADABLE, network
from agents.training.shown import shown_space
from magfold_env.checkpoint import difference
from magfold_env.files import replacing
from magfold_env.scene import Problem, SceneError

FORMAT = "magfold_env policy 1"
_ACTIVATIONS = {"tanh": torch.nn.Tanh, "relu": torch.nn.ReLU}
_WRITTEN = {"net_arch", "activation_fn", "features_extractor_class", "features_extractor_kwargs"}
_WRITTEN |= {"lstm_hidden_size", "n_lstm_layers", "shared_lstm", "enable_critic_lstm"}
"""Options of a policy that settings hold; others have Stable-Baselines3's defaults."""

_MODULES: dict[str, type[base_class.BaseAlgorithm]] = {
    "stable_baselines3.common.policies": CLASSES["ppo"],
    "agents.training.symmetry": CLASSES["ppo"],
    "agents.training.symmetry_masked": CLASSES["maskable-ppo"],
    "sb3_contrib.common.maskable.policies": CLASSES["maskable-ppo"],
    "sb3_contrib.common.recurrent.policies": CLASSES["recurrent-ppo"],
    "stable_baselines3.sac.policies": CLASSES["sac"],
    "sb3_contrib.tqc.policies": CLASSES["tqc"],
}
"""The class that wrote a pickled model, by the module of its policy."""


@dataclass(frozen=True)
class SavedPolicy:
    """A policy that was read."""

    policy: policies.BasePolicy
    """The networks, ready to choose actions."""
    shown: Shown
    """What they want to be shown."""
    steps: int
    """Environment steps that it was trained for."""


_MAX = float(np.finfo(np.float32).max)
_Bound = Annotated[float, Field(ge=-_MAX, le=_MAX)]
_Choices = Annotated[int, Field(ge=1, lt=2**31)]


class _Box(Group, frozen=True):
    low: Annotated[tuple[_Bound, ...], Field(min_length=1, max_length=10_000)]
    high: tuple[_Bound, ...]

    @model_validator(mode="after")
    def _of_one_length(self) -> Self:
        if len(self.high) != len(self.low):
            allowed = f"must have {len(self.low)} entries, as low has"
            raise SceneError([Problem("high", len(self.high), allowed)])
        return self

    @property
    def size(self) -> int:
        return len(self.low)

    def space(self) -> spaces.Box:
        low, high = (np.array(each, dtype=np.float32) for each in (self.low, self.high))
        return spaces.Box(low, high, dtype=np.float32)


class _Boxes(Group, frozen=True):
    boxes: Annotated[dict[str, _Box], Field(min_length=1)]

    @property
    def size(self) -> int:
        return sum(box.size for box in self.boxes.values())

    def space(self) -> spaces.Dict:
        return spaces.Dict([(name, box.space()) for name, box in self.boxes.items()])


class _Discrete(Group, frozen=True):
    n: _Choices

    @property
    def size(self) -> int:
        return self.n

    def space(self) -> spaces.Discrete:
        return spaces.Discrete(self.n)


class _MultiDiscrete(Group, frozen=True):
    nvec: Annotated[tuple[_Choices, ...], Field(min_length=1)]

    @property
    def size(self) -> int:
        return sum(self.nvec)

    def space(self) -> spaces.MultiDiscrete:
        return spaces.MultiDiscrete(list(self.nvec))


def _kind(value: Any) -> str | None:
    """Return the tag of the space that `value` describes; None if it is none that is known."""
    kinds = {"low": "<box>", "boxes": "<dict>", "n": "<discrete>", "nvec": "<multidiscrete>"}
    given = value if isinstance(value, dict) else getattr(value, "__dict__", {})
    return next((kind for key, kind in kinds.items() if key in given), None)


def _one_of(allowed: str) -> Discriminator:
    return Discriminator(
        _kind, custom_error_type="space", custom_error_message=f"must be {allowed}"
    )


_Observations = Annotated[
    Annotated[_Box, Tag("<box>")] | Annotated[_Boxes, Tag("<dict>")],
    _one_of("a box (low, high) or some by name (boxes)"),
]
_Actions = Annotated[
    Annotated[_Box, Tag("<box>")]
    | Annotated[_Discrete, Tag("<discrete>")]
    | Annotated[_MultiDiscrete, Tag("<multidiscrete>")],
    _one_of("a box (low, high), discrete (n) or multidiscrete (nvec)"),
]


class PolicySettings(Shown, frozen=True):
    """Everything about a policy but its weights."""

    algorithm: Algorithm
    """What trained it."""
    features: Features
    """What it sees, as in `agents.settings.LearnerSettings`."""
    backward: bool = False
    """Whether the last component leaves the tube first, for features that count from its mouth."""
    actor: Widths
    """Widths of the hidden layers of the network that acts."""
    critic: Widths
    """The same of those that judge."""
    lstm: LSTMSettings | None = None
    """What they remember by, before these layers."""
    activation: Literal["tanh", "relu"]
    """What follows each of these layers."""
    observations: _Observations
    """What is observed at once."""
    actions: _Actions
    """What is chosen."""
    steps: Annotated[int, Field(ge=0)]
    """Environment steps that it was trained for."""

    @model_validator(mode="after")
    def _fits(self) -> Self:
        recurrent, box = self.algorithm == "recurrent-ppo", isinstance(self.actions, _Box)
        if recurrent != (self.lstm is not None):
            told = f"must {'' if recurrent else 'not '}be given with {self.algorithm}"
            raise SceneError([Problem("lstm", self.lstm, told)])
        any_actions = self.algorithm in ("ppo", "recurrent-ppo")
        if not any_actions and box == (self.algorithm == "maskable-ppo"):
            allowed = "discrete or multidiscrete" if box else "a box"
            told = f"must be {allowed} with {self.algorithm}"
            raise SceneError([Problem("actions", self.actions.model_dump(), told)])
        return self

    def _network(self) -> tuple[type[policies.BasePolicy], dict[str, Any]]:
        dictionary = isinstance(self.observations, _Boxes)
        return network(self.algorithm, self.features, dictionary, self.backward, self.lstm)

    @property
    def kind(self) -> type[policies.BasePolicy]:
        """The class of the policy."""
        return self._network()[0]

    def make(self) -> policies.BasePolicy:
        """Return a policy with these settings, untrained."""
        kind, options = self._network()
        if self.algorithm not in ("sac", "tqc"):
            options |= {"ortho_init": False}  # takes long, for weights that are replaced
        judge = "vf" if "ortho_init" in options else "qf"
        return kind(
            shown_space(self, self.observations.space()),
            self.actions.space(),
            lambda _: 0.0,
            net_arch={"pi": list(self.actor), judge: list(self.critic)},
            activation_fn=_ACTIVATIONS[self.activation],
            **options,
        )

    @property
    def least_bytes(self) -> int:
        """About what the weights take at least, to tell before any network is made."""
        layers = (self.actor, self.actions.size), (self.critic, 1)
        seen = self.frames * self.observations.size
        widths = [(seen, *hidden, last) for hidden, last in layers]
        if self.lstm is not None:
            wide = self.lstm.hidden
            widths = [(wide, *hidden, last) for hidden, last in layers]
            widths.append((seen + wide, 4 * wide))
        return 2 * sum(a * b for each in widths for a, b in itertools.pairwise(each))


def save(
    model: base_class.BaseAlgorithm, path: str | Path, shown: Shown | None = None, before: int = 0
) -> None:
    """Write the policy of `model` to `path` under a temporary name and move it into place.

    It was trained with what `shown` says; None stands for observations as they are. It had been
    trained for some steps `before` the model was made.

    Raises
    ------
    ValueError
        If the policy is not one that `load` can make again.
    """
    settings = _settings_of(model, shown or Shown())
    text = settings.model_copy(update={"steps": settings.steps + before}).model_dump_json()
    tensors = model.policy.state_dict()
    header: dict[str, Any] = {}
    parts: list[bytes] = []
    end = 0
    for name, tensor in tensors.items():
        begin, end = end, end + 4 * tensor.numel()
        header[name] = {"dtype": "F32", "shape": list(tensor.shape), "data_offsets": [begin, end]}
        parts.append(tensor.detach().cpu().numpy().astype("<f4").tobytes())
    data = b"".join(parts)
    header["__metadata__"] = {"format": FORMAT, "settings": text, "sha256": _digest(text, data)}
    head = json.dumps(header).encode()
    head += b" " * (-len(head) % 8)
    with replacing(path) as temporary:
        temporary.write_bytes(len(head).to_bytes(8, "little") + head + data)


def begin_with(path: str | Path, model: base_class.BaseAlgorithm, shown: Shown) -> int:
    """Give the networks of `model` the weights of a policy that `save` wrote.

    Nothing else of it is taken over: optimisers begin anew. Returns the steps that it was trained
    for.

    Raises
    ------
    ValueError
        If there is no such file, it is damaged, or is of other networks, actions or observations.
    """
    settings, policy = _read(Path(path))
    aside = {"steps", "blind"}
    own = _settings_of(model, shown)
    theirs, wanted = (each.model_dump(exclude=aside) for each in (settings, own))
    if where := difference(theirs, wanted):
        raise ValueError(f"{path}: holds another policy, {where}; must be one of the same networks")
    model.policy.load_state_dict(policy.state_dict())
    return settings.steps


def load(path: str | Path, trust_pickle: bool = False) -> SavedPolicy:
    """Read a policy that `save` wrote.

    Parameters
    ----------
    path : str or Path
        The file.
    trust_pickle : bool
        Whether it may be a model as Stable-Baselines3 saves it, which can run any code: only for
        files of your own.

    Raises
    ------
    ValueError
        If there is no such file, it is damaged, or a model of Stable-Baselines3 and not trusted.
    """
    path = Path(path)
    if trust_pickle and _is_zip(path):
        model = _unpickled(path)
        return SavedPolicy(model.policy, Shown(), model.num_timesteps)
    settings, policy = _read(path)
    return SavedPolicy(policy, settings, settings.steps)


def _is_zip(path: Path) -> bool:
    if not path.is_file():
        raise ValueError(f"{path}: no such file; must be a policy (.safetensors)")
    with path.open("rb") as file:
        return file.read(4) == b"PK\x03\x04"


def _read(path: Path) -> tuple[PolicySettings, policies.BasePolicy]:
    """Return what a policy file says, and the networks with its weights."""
    if _is_zip(path):
        raise ValueError(
            f"{path}: is a zip file, as Stable-Baselines3 saves models, and holds pickles, "
            "which can run any code; must be a policy of agents.train (.safetensors), or, if "
            "it is your own, be read with --trust-pickle of agents.evaluate (in Python "
            "trust_pickle=True)"
        )
    content = path.read_bytes()
    try:
        start = 8 + int.from_bytes(content[:8], "little")
        header = json.loads(content[8:start])
        metadata = header.pop("__metadata__")
        if metadata["format"] != FORMAT:
            raise ValueError(f"format: {metadata['format']!r} is not {FORMAT!r}")
        text, data = metadata["settings"], content[start:]
        if metadata["sha256"] != _digest(text, data):
            raise ValueError("sha256: the weights or settings are not what was saved")
        given = json.loads(text)
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise ValueError(f"{path}: is not a policy, or is damaged: {error}") from None
    settings = checked(PolicySettings, given, path)
    if settings.least_bytes > len(data):
        allowed = f"must be those of the weights, {len(data)} bytes"
        widths = [*settings.actor, *settings.critic]
        raise SettingsError([Problem("actor, critic", widths, allowed)], str(path))
    try:
        policy = settings.make()
    except (*UNREADABLE, AssertionError) as error:
        raise ValueError(f"{path}: its networks cannot be made: {error}") from None
    try:
        policy.load_state_dict(_weights(policy.state_dict(), header, data))
    except ValueError as error:
        raise ValueError(f"{path}: weights: {error}") from None
    policy.set_training_mode(False)
    return settings, policy


def _weights(
    wanted: dict[str, torch.Tensor], header: dict[str, Any], data: bytes
) -> dict[str, torch.Tensor]:
    """Return the weights in `data` whose names, shapes and places the header has."""
    if unknown := header.keys() - wanted.keys():
        raise ValueError(f"{min(unknown)}: is not one of the network's")
    found: dict[str, torch.Tensor] = {}
    for name, tensor in wanted.items():
        shape = list(tensor.shape)
        entry = header.get(name)
        begin = _begin(entry)
        size = 4 * math.prod(shape)
        right = {"dtype": "F32", "shape": shape, "data_offsets": [begin, begin + size]}
        if entry != right or begin + size > len(data):
            raise ValueError(f"{name}: {entry} is not allowed; must be F32 numbers, {shape}")
        numbers = np.frombuffer(data, "<f4", size // 4, begin).astype(np.float32).reshape(shape)
        if not np.isfinite(numbers).all():
            raise ValueError(f"{name}: has numbers that are not finite")
        found[name] = torch.from_numpy(numbers)
    return found


def _begin(entry: Any) -> int:
    """Return where a weight begins, as its entry in the header says; 0 if it says nothing."""
    try:
        return max(0, int(entry["data_offsets"][0]))
    except (LookupError, TypeError, ValueError, OverflowError):
        return 0


def _settings_of(model: base_class.BaseAlgorithm, shown: Shown) -> PolicySettings:
    """Return the settings with which the policy of `model` can be made again."""
    policy: Any = model.policy
    hidden, extractor = policy.net_arch, policy.features_extractor_class
    if not isinstance(hidden, dict):
        hidden = {"pi": hidden, "vf": hidden, "qf": hidden}
    algorithms = {each: name for name, each in CLASSES.items()}
    lstm = None
    if isinstance(policy, RecurrentActorCriticPolicy):
        separate = "own" if policy.enable_critic_lstm else "none"
        lstm = {
            "hidden": policy.lstm_actor.hidden_size,
            "layers": policy.lstm_actor.num_layers,
            "critic": "shared" if policy.shared_lstm else separate,
        }
    activations = {each: name for name, each in _ACTIVATIONS.items()}
    content = {
        "frames": shown.frames,
        "blind": shown.blind,
        "algorithm": algorithms.get(type(model), str(type(model))),
        "features": FEATURES.get(extractor, str(extractor)),
        "backward": policy.features_extractor_kwargs.get("backward", False),
        "actor": hidden.get("pi", ()),
        "critic": hidden.get("vf", hidden.get("qf", ())),
        "lstm": lstm,
        "activation": activations.get(policy.activation_fn, str(policy.activation_fn)),
        "observations": _described(model.observation_space, shown.frames > 1),
        "actions": _described(model.action_space),
        "steps": model.num_timesteps,
    }
    settings = checked(PolicySettings, content, "policy")
    same = shown_space(shown, settings.observations.space()) == model.observation_space
    same = same and settings.actions.space() == model.action_space
    lost = [name for name, value in model.policy_kwargs.items() if value and name not in _WRITTEN]
    if lost or model.use_sde or not same or type(policy) is not settings.kind:
        raise ValueError(
            f"policy: {type(policy).__name__} with its options {lost} or its spaces cannot be "
            "written; must be one that agents.train makes"
        )
    return settings


def _described(space: spaces.Space[Any], stacked: bool = False) -> dict[str, Any]:
    """Return what is known of a space, of one of the frames in it, as values that JSON can hold."""
    if isinstance(space, spaces.Dict):
        return {"boxes": {name: _described(each) for name, each in space.items()}}
    names = ("low", "high", "n", "nvec")
    values = {name: getattr(space, name) for name in names if hasattr(space, name)}
    return {
        name: np.asarray(value[-1] if stacked else value).tolist() for name, value in values.items()
    }


def _unpickled(path: Path) -> base_class.BaseAlgorithm:
    """Read a model of any of the algorithms as Stable-Baselines3 saved it."""
    try:
        with zipfile.ZipFile(path) as archive:
            module = json.loads(archive.read("data"))["policy_class"]["__module__"]
    except UNREADABLE as error:
        raise ValueError(f"{path}: is not a model, or is damaged: {error}") from None
    if module not in _MODULES:
        known = ", ".join(CLASSES)
        raise ValueError(f"{path}: its policy is from {module!r}; must be of one of {known}")
    # A replay buffer is large, and hindsight's wants an environment.
    without: dict[str, Any] = {}
    if issubclass(_MODULES[module], off_policy_algorithm.OffPolicyAlgorithm):
        without = {"buffer_size": 1, "replay_buffer_class": None, "replay_buffer_kwargs": {}}
    try:
        return _MODULES[module].load(path, device="cpu", **without)
    except (*UNREADABLE, AssertionError, ImportError, pickle.UnpicklingError) as error:
        raise ValueError(f"{path}: is not a model, or is damaged: {error}") from None


def _digest(text: str, data: bytes) -> str:
    return hashlib.sha256(text.encode() + data).hexdigest()
