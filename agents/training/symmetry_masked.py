"""The symmetric network of `agents.training.symmetry` for MaskablePPO.

The resume state of training runs contains the name of this module, so the module must not move.
"""

from sb3_contrib.common.maskable.policies import MaskableActorCriticPolicy

from agents.training.symmetry import Symmetric


class MaskableSymmetricPolicy(Symmetric, MaskableActorCriticPolicy):  # pyright: ignore[reportIncompatibleMethodOverride, reportIncompatibleVariableOverride]
    """Actor and critic of MaskablePPO with the features of `FromOneSide`."""
