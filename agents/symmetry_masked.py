"""The symmetric network of `agents.symmetry` for MaskablePPO.

Saved policies name this module, by which they are told from PPO's: they load only while it is
found here.
"""

from sb3_contrib.common.maskable.policies import MaskableActorCriticPolicy

from agents.symmetry import Symmetric


class MaskableSymmetricPolicy(Symmetric, MaskableActorCriticPolicy):  # pyright: ignore[reportIncompatibleMethodOverride, reportIncompatibleVariableOverride]
    """Actor and critic of MaskablePPO that see chains as `agents.symmetry.FromOneSide` does."""
