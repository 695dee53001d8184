"""``MagFold/SequenceDesign-v0``: choose all magnets and the feed speed in a single step."""

from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from magfold_env.envs.fold_env import FoldEnv
from magfold_env.envs.vector_env import ChainVectorEnv


class SequenceDesignEnv(FoldEnv[NDArray[np.float32]]):
    """Choose the magnets of all ``n`` components and one feed speed in a single step.

    An episode is a single step of a contextual bandit whose context is the target. In the default
    scene (``feed.loading: preloaded``), magnets also act inside the tube. With ``at_mouth``
    they act only outside, as in ``MagFold/TubeFeed-v0``.

    **Action**: ``MultiDiscrete([16] * n + [speeds])``: the pattern of each component, component 1
    first, then the speed level, as in `magfold_env.envs.tube_feed.TubeFeedEnv`.
    `magfold_env.envs.spaces.actions` lists the other forms. ``discrete`` allows chains of up to
    four components.

    **Observation, reward, info**: as in `TubeFeedEnv`. The first observation shows the target and
    the chain in the tube; the last one shows the chain at rest. Shaping is of no use here.

    Arguments are those of `magfold_env.envs.fold_env.FoldEnv`.
    """

    action_scope: ClassVar[Literal["component", "chain"]] = "chain"
    default_scene: ClassVar[str] = "tube-built"


SequenceDesignVectorEnv = ChainVectorEnv[Any].of(SequenceDesignEnv)
