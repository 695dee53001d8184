"""PPO's actor and critic with the same hidden layers, which halves the work of an update.

Stable-Baselines3 gives each its own. Its classes stay in use, and policy files contain the layers
under both names, so everything that plays a policy also plays these.

The stored state of training runs contains this module's name, so the module must not move.
"""

from typing import Any

import torch
from sb3_contrib.common.maskable.policies import MaskableActorCriticPolicy
from stable_baselines3.common import policies, torch_layers


class SharedLayers(torch_layers.MlpExtractor):
    """Hidden layers of the actor, which are also those of the critic."""

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self.value_net = self.policy_net

    def forward(self, features: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Return the last hidden layer, (batch, width), for the actor and for the critic."""
        latent = self.forward_actor(features)
        return latent, latent


class _Shared(policies.BasePolicy):
    """A mixin that gives actor and critic `SharedLayers`."""

    def _build_mlp_extractor(self) -> None:
        own: Any = self
        own.mlp_extractor = SharedLayers(
            own.features_dim, own.net_arch, own.activation_fn, own.device
        )


class SharedPolicy(_Shared, policies.ActorCriticPolicy):
    """Actor and critic of PPO with the same hidden layers."""


class MaskableSharedPolicy(_Shared, MaskableActorCriticPolicy):  # pyright: ignore[reportIncompatibleMethodOverride, reportIncompatibleVariableOverride]
    """Actor and critic of MaskablePPO with the same hidden layers."""
