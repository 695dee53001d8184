"""The symmetric network of `agents.training.symmetry` for MaskablePPO.

The resume state of training runs names this module: it loads only while it is found here.
"""

from sb3_contrib.common.maskable.policies import MaskableActorCriticPolicy

from agents.training.symmetry import Symmetric


class MaskableSymmetricPolicy(Symmetric, MaskableActorCriticPolicy):  # pyright: ignore[reportIncompatibleMethodOverride, reportIncompatibleVariableOverride]
    """Actor and critic of MaskablePPO that see chains as `FromOneSide` does."""
