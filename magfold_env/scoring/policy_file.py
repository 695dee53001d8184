"""Files of policies: weights and settings of networks. Reading a file runs no code from it.

The format is `safetensors <https://github.com/huggingface/safetensors>`_. The entry ``policy`` of
the metadata is JSON and contains the format, the settings (also as JSON), and the SHA-256 of
settings and weights. In older files, these are three separate entries of the metadata.
"""

import hashlib
import itertools
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, Self, cast

import numpy as np
import safetensors
from gymnasium import spaces
from numpy.typing import NDArray
from pydantic import Discriminator, Field, Tag, ValidationError, model_validator
from safetensors.numpy import save

from magfold_env.files import replacing
from magfold_env.scene import Problem, SceneError
from magfold_env.scene.base import FrozenModel
from magfold_env.scene.errors import problems_of, refuse

FORMAT = "magfold_env policy 1"
_POLICY = "policy"
_DAMAGED = (
    safetensors.SafetensorError,
    ValueError,
    KeyError,
    TypeError,
    AttributeError,
    RecursionError,
)
"""Errors that reading may raise if a file is damaged or not a policy."""

Algorithm = Literal["ppo", "maskable-ppo", "recurrent-ppo", "sac", "tqc"]
Features = Literal["chain", "mouth", "symmetric"]
Count = Annotated[int, Field(ge=1)]
Widths = Annotated[tuple[Count, ...], Field(max_length=16)]

_MAX = float(np.finfo(np.float32).max)
_Bound = Annotated[float, Field(ge=-_MAX, le=_MAX)]
_Choices = Annotated[int, Field(ge=1, lt=2**31)]


class ObservationForm(FrozenModel):
    """The form in which networks receive observations."""

    frames: Annotated[int, Field(ge=1, le=64)] = 1
    """Number of stacked observations, newest last; an episode's first observation pads the
    stack."""
    blind: bool = False
    """Whether motion is removed; see `magfold_env.scoring.observation_view.blind`."""
    view: Literal["own", "canonical"] = "own"
    """Whether given chains are shown as they are, or in the view of
    `magfold_env.envs.wrappers.canonical`, which is the same for a chain and its images. In that
    view, older observations of a stack have zeros where the newest one states the task."""


class LSTMSettings(FrozenModel):
    """LSTM layers (long short-term memory) before the other layers of a network."""

    hidden: Count = 128
    """Width of every layer."""
    layers: Annotated[int, Field(ge=1, le=4)] = 1
    """Number of layers."""
    critic: Literal["own", "shared", "none"] = "own"
    """Whether the critic has its own LSTM layers, shares those of the actor, or has none."""


class Box(FrozenModel):
    """A space of numbers between bounds."""

    low: Annotated[tuple[_Bound, ...], Field(min_length=1, max_length=10_000)]
    high: tuple[_Bound, ...]

    @model_validator(mode="after")
    def _of_one_length(self) -> Self:
        if len(self.high) != len(self.low):
            allowed = f"must have {len(self.low)} entries, as low has"
            refuse([Problem("high", len(self.high), allowed)])
        return self

    @property
    def size(self) -> int:
        """Number of entries."""
        return len(self.low)

    def space(self) -> spaces.Box:
        """Return the space in Gymnasium's form."""
        low, high = (np.array(each, dtype=np.float32) for each in (self.low, self.high))
        return spaces.Box(low, high, dtype=np.float32)


class Boxes(FrozenModel):
    """A space of several named boxes."""

    boxes: Annotated[dict[str, Box], Field(min_length=1)]

    @property
    def size(self) -> int:
        """Total number of entries."""
        return sum(box.size for box in self.boxes.values())

    def space(self) -> spaces.Dict:
        """Return the space in Gymnasium's form."""
        return spaces.Dict([(name, box.space()) for name, box in self.boxes.items()])


class Discrete(FrozenModel):
    """A space of one choice among several."""

    n: _Choices

    @property
    def size(self) -> int:
        """Number of choices."""
        return self.n

    def space(self) -> spaces.Discrete:
        """Return the space in Gymnasium's form."""
        return spaces.Discrete(self.n)


class MultiDiscrete(FrozenModel):
    """A space of several simultaneous choices."""

    nvec: Annotated[tuple[_Choices, ...], Field(min_length=1)]

    @property
    def size(self) -> int:
        """Total number of choices."""
        return sum(self.nvec)

    def space(self) -> spaces.MultiDiscrete:
        """Return the space in Gymnasium's form."""
        return spaces.MultiDiscrete(list(self.nvec))


def _kind(value: Any) -> str | None:
    """Return the tag of the space that `value` describes, or None if it is unknown."""
    kinds = {"low": "<box>", "boxes": "<dict>", "n": "<discrete>", "nvec": "<multidiscrete>"}
    own: Any = getattr(value, "__dict__", {})
    given = cast("dict[str, Any]", value) if isinstance(value, dict) else own
    return next((kind for key, kind in kinds.items() if key in given), None)


def _one_of(allowed: str) -> Discriminator:
    return Discriminator(
        _kind, custom_error_type="space", custom_error_message=f"must be {allowed}"
    )


_Observations = Annotated[
    Annotated[Box, Tag("<box>")] | Annotated[Boxes, Tag("<dict>")],
    _one_of("a box (low, high) or some by name (boxes)"),
]
_Actions = Annotated[
    Annotated[Box, Tag("<box>")]
    | Annotated[Discrete, Tag("<discrete>")]
    | Annotated[MultiDiscrete, Tag("<multidiscrete>")],
    _one_of("a box (low, high), discrete (n) or multidiscrete (nvec)"),
]


class PolicySettings(ObservationForm):
    """Everything about a policy except its weights."""

    algorithm: Algorithm
    """Training algorithm."""
    features: Features
    """Kind of features, as in `agents.settings.LearnerSettings`."""
    backward: bool = False
    """Whether the last component leaves the tube first, for features that count from the mouth."""
    actor: Widths
    """Widths of the hidden layers of the actor."""
    critic: Widths
    """Widths of the hidden layers of the critics."""
    lstm: LSTMSettings | None = None
    """LSTM layers before the hidden layers, if any."""
    activation: Literal["tanh", "relu"]
    """Activation after each hidden layer."""
    observations: _Observations
    """Space of a single observation."""
    actions: _Actions
    """Space of the actions."""
    steps: Annotated[int, Field(ge=0)]
    """Number of environment steps in training."""

    @model_validator(mode="after")
    def _fits(self) -> Self:
        recurrent, box = self.algorithm == "recurrent-ppo", isinstance(self.actions, Box)
        if recurrent != (self.lstm is not None):
            told = f"must {'' if recurrent else 'not '}be given with {self.algorithm}"
            refuse([Problem("lstm", self.lstm, told)])
        any_actions = self.algorithm in ("ppo", "recurrent-ppo")
        if not any_actions and box == (self.algorithm == "maskable-ppo"):
            allowed = "discrete or multidiscrete" if box else "a box"
            told = f"must be {allowed} with {self.algorithm}"
            refuse([Problem("actions", self.actions.model_dump(), told)])
        return self

    @property
    def least_bytes(self) -> int:
        """Approximate minimum size of the weights [bytes], checked before a network is made."""
        layers = (self.actor, self.actions.size), (self.critic, 1)
        seen = self.frames * self.observations.size
        widths = [(seen, *hidden, last) for hidden, last in layers]
        if self.lstm is not None:
            wide = self.lstm.hidden
            widths = [(wide, *hidden, last) for hidden, last in layers]
            widths.append((seen + wide, 4 * wide))
        return 2 * sum(a * b for each in widths for a, b in itertools.pairwise(each))


@dataclass(frozen=True)
class PolicyFile:
    """A policy that was read from a file; `weights` decodes its weights on demand."""

    settings: PolicySettings
    """Everything except the weights."""
    tensors: Mapping[str, Mapping[str, Any]]
    """Arrays of weights by name, each with the keys ``dtype``, ``shape`` and ``data``."""

    def weights(self, shapes: Mapping[str, Sequence[int]]) -> dict[str, NDArray[np.float32]]:
        """Return finite weights with the given names and shapes, or raise a ValueError."""
        found: dict[str, NDArray[np.float32]] = {}
        for name, each in shapes.items():
            shape, tensor = list(each), self.tensors.get(name, {})
            given = tensor.get("dtype"), tensor.get("shape")
            if given != ("F32", shape):
                raise ValueError(f"{name}: {given} is not allowed; must be F32 numbers, {shape}")
            numbers = np.frombuffer(tensor["data"], "<f4").astype(np.float32)
            if not np.isfinite(numbers).all():
                raise ValueError(f"{name}: has numbers that are not finite")
            found[name] = numbers.reshape(shape)
        return found


def write(
    path: str | Path, settings: PolicySettings, weights: Mapping[str, NDArray[np.float32]]
) -> None:
    """Write a policy to `path` through a temporary file."""
    text = settings.model_dump_json()
    tensors = {name: np.asarray(each, np.float32, order="C") for name, each in weights.items()}
    told = {"format": FORMAT, "settings": text, "sha256": _digest(text, _data(save(tensors)))}
    # A single entry, because safetensors writes several in an order that varies between processes.
    content = save(tensors, {_POLICY: json.dumps(told)})
    with replacing(path) as temporary:
        temporary.write_bytes(content)


def is_zip(path: Path) -> bool:
    """Return whether an existing file is a zip file, the format of Stable-Baselines3's models."""
    if not path.is_file():
        raise ValueError(f"{path}: no such file; must be a policy (.safetensors)")
    with path.open("rb") as file:
        return file.read(4) == b"PK\x03\x04"


def read(path: str | Path) -> PolicyFile:
    """Read a policy that `write` wrote.

    Raises
    ------
    ValueError
        If the file does not exist, is damaged, or is a model of Stable-Baselines3.
    """
    path = Path(path)
    if is_zip(path):
        raise ValueError(
            f"{path}: is a zip file, as Stable-Baselines3 saves models, and holds pickles, which "
            "can run any code; must be a policy of agents.train (.safetensors), or, if the model "
            "is your own, what agents.training.policy_files.save(model, path) writes"
        )
    content = path.read_bytes()
    data = _data(content)
    try:
        tensors = dict(cast("Any", safetensors).deserialize(content))
        told = json.loads(content[8 : len(content) - len(data)])["__metadata__"]
        told = json.loads(told[_POLICY]) if _POLICY in told else told
        if told["format"] != FORMAT:
            raise ValueError(f"format: {told['format']!r} is not {FORMAT!r}")
        text = told["settings"]
        if told["sha256"] != _digest(text, data):
            raise ValueError("sha256: the weights or settings differ from those saved")
        given = json.loads(text)
    except _DAMAGED as error:
        raise ValueError(f"{path}: is not a policy, or is damaged: {error}") from None
    try:
        settings = PolicySettings.model_validate(given)
    except ValidationError as error:
        raise SceneError(problems_of(error, PolicySettings), str(path)) from None
    if settings.least_bytes > len(data):
        allowed = f"must be those of the weights, {len(data)} bytes"
        widths = [*settings.actor, *settings.critic]
        raise SceneError([Problem("actor, critic", widths, allowed)], str(path))
    return PolicyFile(settings, tensors)


def _data(content: bytes) -> bytes:
    """Return the part of a file after its header."""
    return content[8 + int.from_bytes(content[:8], "little") :]


def _digest(text: str, data: bytes) -> str:
    return hashlib.sha256(text.encode() + data).hexdigest()
