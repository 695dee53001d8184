"""Conversion of Stable-Baselines3's networks to and from `magfold_env.scoring.policy_file`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from sb3_contrib.common.recurrent.policies import RecurrentActorCriticPolicy
from stable_baselines3.common import base_class, policies

from agents.settings import checked
from agents.training.models import CLASSES, FEATURES, SHARED, network
from magfold_env.checkpoint import difference
from magfold_env.scoring import policy_file
from magfold_env.scoring.observation_view import form_space
from magfold_env.scoring.policy_file import ObservationForm, PolicySettings

_ACTIVATIONS = {"tanh": torch.nn.Tanh, "relu": torch.nn.ReLU}
_WRITTEN = {"net_arch", "activation_fn", "features_extractor_class", "features_extractor_kwargs"}
_WRITTEN |= {"lstm_hidden_size", "n_lstm_layers", "shared_lstm", "enable_critic_lstm"}
"""Options of a policy that its settings contain; others have Stable-Baselines3's defaults."""


@dataclass(frozen=True)
class SavedPolicy:
    """A policy read from a file."""

    policy: policies.BasePolicy
    """The networks, ready to choose actions."""
    shown: ObservationForm
    """The form of the observations that they read."""
    steps: int
    """Number of environment steps in the policy's training."""


def _kind(settings: PolicySettings) -> tuple[type[policies.BasePolicy], dict[str, Any]]:
    """Return the class of a policy with these settings, and the options of its features."""
    boxes = isinstance(settings.observations, policy_file.Boxes)
    own = settings.algorithm, settings.features, boxes, settings.backward, settings.lstm
    return network(*own)


def make(settings: PolicySettings) -> policies.BasePolicy:
    """Return an untrained policy with these settings."""
    kind, options = _kind(settings)
    if settings.algorithm not in ("sac", "tqc"):
        options |= {"ortho_init": False}  # slow, and the weights are replaced anyway
    judge = "vf" if "ortho_init" in options else "qf"
    return kind(
        form_space(settings, settings.observations.space()),
        settings.actions.space(),
        lambda _: 0.0,
        net_arch={"pi": list(settings.actor), judge: list(settings.critic)},
        activation_fn=_ACTIVATIONS[settings.activation],
        **options,
    )


def save(
    model: base_class.BaseAlgorithm,
    path: str | Path,
    shown: ObservationForm | None = None,
    before: int = 0,
) -> None:
    """Write the policy of `model` to `path` under a temporary name and move it into place.

    `shown` is the form of the observations; None means unchanged observations. `before` is the
    number of the policy's training steps before the model was created.

    Raises
    ------
    ValueError
        If `load` could not restore the policy.
    """
    settings = _settings_of(model, shown or ObservationForm())
    settings = settings.model_copy(update={"steps": settings.steps + before})
    tensors = model.policy.state_dict()
    numbers = {name: each.detach().cpu().numpy() for name, each in tensors.items()}
    policy_file.write(path, settings, numbers)


def begin_with(path: str | Path, model: base_class.BaseAlgorithm, shown: ObservationForm) -> int:
    """Set the networks of `model` to the weights of a policy that `save` wrote.

    Nothing but the weights is used; optimisers start fresh. Returns the number of the policy's
    training steps.

    Raises
    ------
    ValueError
        If there is no such file, or it is damaged or has other networks, actions or observations.
    """
    saved, aside = load(path), {"steps", "blind"}
    both = saved.shown, _settings_of(model, shown)
    theirs, own = (settings.model_dump(exclude=aside) for settings in both)
    if where := difference(theirs, own):
        raise ValueError(f"{path}: holds another policy, {where}; must have the same networks")
    model.policy.load_state_dict(saved.policy.state_dict())
    return saved.steps


def load(path: str | Path) -> SavedPolicy:
    """Read a policy that `save` wrote.

    Raises
    ------
    ValueError
        If there is no such file, it is damaged, or it is a model that Stable-Baselines3 wrote.
    """
    file = policy_file.read(path)
    try:
        policy = make(file.settings)
    except Exception as error:
        raise ValueError(f"{path}: its networks cannot be made: {error}") from None
    shapes = {name: tuple(tensor.shape) for name, tensor in policy.state_dict().items()}
    try:
        if unknown := file.tensors.keys() - shapes.keys():
            raise ValueError(f"{min(unknown)}: is not a weight of the networks")
        weights = file.weights(shapes)
    except ValueError as error:
        raise ValueError(f"{path}: weights: {error}") from None
    policy.load_state_dict({name: torch.from_numpy(each) for name, each in weights.items()})
    policy.set_training_mode(False)
    return SavedPolicy(policy, file.settings, file.settings.steps)


def _settings_of(model: base_class.BaseAlgorithm, shown: ObservationForm) -> PolicySettings:
    """Return the settings from which `load` can restore the policy of `model`."""
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
        "view": shown.view,
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
    same = form_space(shown, settings.observations.space()) == model.observation_space
    same = same and settings.actions.space() == model.action_space
    lost = [name for name, value in model.policy_kwargs.items() if value and name not in _WRITTEN]
    kinds = _kind(settings)[0], SHARED.get(settings.algorithm)
    if lost or model.use_sde or not same or type(policy) not in kinds:
        raise ValueError(
            f"policy: {type(policy).__name__} with its options {lost} or its spaces cannot be "
            "written; must be one that agents.train makes"
        )
    return settings


def _described(space: spaces.Space[Any], stacked: bool = False) -> dict[str, Any]:
    """Return the description of a space as JSON values; if `stacked`, of one of its frames."""
    if isinstance(space, spaces.Dict):
        return {"boxes": {name: _described(each) for name, each in space.items()}}
    names = ("low", "high", "n", "nvec")
    values = {name: getattr(space, name) for name in names if hasattr(space, name)}
    return {
        name: np.asarray(value[-1] if stacked else value).tolist() for name, value in values.items()
    }
