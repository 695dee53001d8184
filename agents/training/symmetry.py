"""A network that treats a chain, its mirror image, and both with swapped poles alike.

The mirror image of a chain folds into the mirror image of its fold, and swapping N and S everywhere
changes no force. The network sees one of these four chains, selected by the target and the
components outside the tube, and its choice is transformed back. What it learns from one of them
therefore applies exactly to all.

The stored state of training runs contains this module's name, so the module must not move.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from gymnasium import Space, spaces
from numpy.typing import NDArray
from sb3_contrib.common.maskable.policies import MaskableActorCriticPolicy
from stable_baselines3.common import policies, torch_layers
from torch import nn

from agents.training.features import FromTheMouth
from magfold_env.envs.spaces import actions, observation
from magfold_env.scene import Scene

VIEWS = 2
"""Number of features that describe the transformed view: mirrored or not, poles swapped or not."""

_FACE_WEIGHTS = (8.0, 4.0, 2.0, 1.0)
"""Weights with which the poles of a component's faces never sum to zero."""


def is_symmetric(scene: Scene) -> bool:
    """Return whether the scene is its own mirror image, apart from its poles."""
    sizes = ("width", "height", "thickness", "inset", "remanence")
    faces = [np.atleast_1d(getattr(scene.magnets, name)) for name in sizes]
    even = all(np.array_equal(each, each[..., ::-1]) for each in faces)
    return even and scene.field == type(scene.field)() and scene.gravity.in_plane[1] == 0.0


class FromOneSide(FromTheMouth):
    """Transforms every chain so that the joint that folds next turns left, if it folds.

    The first pole of the component that left the tube last becomes N. The last two features state
    whether left and right, and N and S, were swapped.

    The parameters and errors are those of `agents.training.features.FromTheMouth`.
    """

    _mirror: torch.Tensor
    _mirror_signs: torch.Tensor
    _faces: torch.Tensor

    def __init__(self, observation_space: Space[object], backward: bool = False) -> None:
        super().__init__(observation_space, backward)
        self._features_dim += VIEWS
        self._backward = backward
        places, signs = _mirror_image(self._layout, self.width)
        self.register_buffer("_mirror", torch.from_numpy(places), persistent=False)
        self.register_buffer("_mirror_signs", torch.from_numpy(signs), persistent=False)
        self.register_buffer("_faces", torch.tensor(_FACE_WEIGHTS), persistent=False)

    def forward(self, observations: torch.Tensor | Mapping[str, torch.Tensor]) -> torch.Tensor:
        """Return the features, (batch, features_dim), of a batch of observations."""
        entries = self.entries(observations)
        step = self.step(entries)
        in_mirror = self._to_the_right(entries, step)
        image = entries[:, self._mirror] * self._mirror_signs
        entries = torch.where(in_mirror[:, None], image, entries)
        entries, exchanged = self._first_pole_north(entries, step)
        views = torch.stack((in_mirror, exchanged), dim=1).to(entries.dtype)
        return torch.cat((self.ordered(entries, step), views), dim=1)

    def _place(self, step: torch.Tensor, count: int) -> torch.Tensor:
        """Return the index of the joint or component that the feed has reached, (batch,)."""
        place = (step - 1).clamp(0, count - 1)
        return count - 1 - place if self._backward else place

    def _to_the_right(self, entries: torch.Tensor, step: torch.Tensor) -> torch.Tensor:
        """Return whether the joint that folds next must turn right, (batch,)."""
        joints, width = self._layout.n - 1, self.width
        wanted = entries[:, : width * joints].reshape(-1, joints, width)
        row = wanted[torch.arange(len(wanted)), self._place(step, joints)]
        # The letters are L, S, R; angles to the left are positive.
        return row[:, -1] > row[:, 0] if width > 1 else row[:, 0] < 0

    def _first_pole_north(
        self, entries: torch.Tensor, step: torch.Tensor
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """Return the entries, with poles swapped where needed, and where they were swapped."""
        n, start = self._layout.n, self.width * (self._layout.n - 1)
        span = self._layout.slices["magnets"]
        poles = entries[:, start + span.start : start + span.stop].reshape(-1, n, 4)
        last = poles[torch.arange(len(poles)), self._place(step, n)]
        exchanged = (last * self._faces).sum(dim=1) < 0
        signs = torch.ones_like(entries)
        signs[:, start + span.start : start + span.stop] -= 2.0 * exchanged[:, None]
        return entries * signs, exchanged


def _mirror_image(
    layout: observation.Layout, width: int
) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
    """Return the source and the sign of each entry of a mirror image.

    The target comes first, with `width` entries per joint, then the chain of `layout`.
    """
    start = width * (layout.n - 1)
    size = start + layout.size
    places, signs = np.arange(size), np.ones(size, dtype=np.float32)
    wanted = places[:start].reshape(-1, width)
    places[:start] = wanted[:, ::-1].ravel()
    if width == 1:
        signs[:start] = -1.0

    def group(name: str) -> slice:
        span = layout.slices[name]
        return slice(start + span.start, start + span.stop)

    # Front-left and front-right swap places, and so do back-left and back-right.
    places[group("magnets")] = places[group("magnets")].reshape(-1, 4)[:, ::-1].ravel()
    for name in ("joint", "rate"):
        signs[group(name)] = -1.0
    signs[group("heading")][0::2] = -1.0  # the sine
    for name in ("position", "velocity"):
        signs[group(name)][1::2] = -1.0
    return places, signs


class _Inner(nn.Module):
    """The hidden layers, which ignore the features of the view but pass them on to the actor."""

    def __init__(self, layers: torch_layers.MlpExtractor) -> None:
        super().__init__()
        self.layers = layers
        self.latent_dim_pi, self.latent_dim_vf = layers.latent_dim_pi, layers.latent_dim_vf

    def forward(self, features: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        return self.forward_actor(features), self.forward_critic(features)

    def forward_actor(self, features: torch.Tensor) -> torch.Tensor:
        seen, views = features[:, :-VIEWS], features[:, -VIEWS:]
        return torch.cat((self.layers.forward_actor(seen), views), dim=1)

    def forward_critic(self, features: torch.Tensor) -> torch.Tensor:
        return self.layers.forward_critic(features[:, :-VIEWS])


class _TurnedBack(nn.Module):
    """The last layer, which transforms the choice back to the environment's view."""

    _patterns: torch.Tensor

    def __init__(self, layer: nn.Module, other_choices: int) -> None:
        super().__init__()
        self.layer = layer
        rest = len(actions.SIGNS) + np.arange(other_choices)
        # The index of each pattern in every view: unchanged, swapped, mirrored, both.
        signs, mirrored = actions.SIGNS, actions.SIGNS[:, ::-1]
        views = [np.argmax(view @ signs.T, axis=1) for view in (signs, -signs, mirrored, -mirrored)]
        orders = [np.append(each, rest) for each in views]
        self.register_buffer("_patterns", torch.from_numpy(np.array(orders)), persistent=False)

    def forward(self, latent: torch.Tensor) -> torch.Tensor:
        views = latent[:, -VIEWS:].round().long()
        logits = self.layer(latent[:, :-VIEWS])
        return logits.gather(1, self._patterns[2 * views[:, 0] + views[:, 1]])


class Symmetric(policies.BasePolicy):
    """A mixin that gives actor and critic the features of `FromOneSide`.

    Raises
    ------
    ValueError
        If actions do not consist of one of the 16 patterns and a speed.
    """

    def __init__(
        self,
        observation_space: spaces.Space[Any],
        action_space: spaces.Space[Any],
        *arguments: Any,
        **options: Any,
    ) -> None:
        if (
            not isinstance(action_space, spaces.MultiDiscrete)
            or action_space.nvec.size != 2
            or action_space.nvec[0] != len(actions.SIGNS)
        ):
            raise ValueError(
                f"action_space: {action_space} is not allowed; "
                f"must be MultiDiscrete([{len(actions.SIGNS)}, speeds])"
            )
        self._speeds = int(action_space.nvec[1])
        super().__init__(observation_space, action_space, *arguments, **options)

    def _build_mlp_extractor(self) -> None:
        """Create the hidden layers."""
        own: Any = self
        width = own.features_dim - VIEWS
        layers = torch_layers.MlpExtractor(width, own.net_arch, own.activation_fn, self.device)
        self.mlp_extractor: Any = _Inner(layers)

    def _build(self, lr_schedule: Any) -> None:
        """Create the networks and the optimiser."""
        parent: Any = super()
        parent._build(lr_schedule)
        # The wrapped layer keeps its weights, which the optimiser already has.
        self.action_net: Any = _TurnedBack(self.action_net, self._speeds)


class SymmetricPolicy(Symmetric, policies.ActorCriticPolicy):
    """Actor and critic of PPO with the features of `FromOneSide`."""


class MaskableSymmetricPolicy(Symmetric, MaskableActorCriticPolicy):  # pyright: ignore[reportIncompatibleMethodOverride, reportIncompatibleVariableOverride]
    """Actor and critic of MaskablePPO with the features of `FromOneSide`."""
