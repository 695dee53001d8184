"""``MagFold/SequenceDesign-v0``: choose the whole chain and its speed, then watch one fold."""

from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from magfold_env.envs.fold_env import FoldEnv
from magfold_env.envs.vector_env import ChainVectorEnv


class SequenceDesignEnv(FoldEnv[NDArray[np.float32]]):
    """Choose the magnets of all ``n`` components and one feed speed; the chain folds once.

    An episode is a single step of a contextual bandit whose context is the target. In the default
    scene (``feed.loading`` ``preloaded``), magnets also act inside the tube. With ``at_mouth`` they
    act as in ``MagFold/TubeFeed-v0``.

    **Action**: ``MultiDiscrete([16] * n + [speeds])``: the pattern of each component, component 1
    first, then the speed level, as in `magfold_env.envs.tube_feed.TubeFeedEnv`.
    `magfold_env.envs.spaces.actions` lists the other forms. ``discrete`` is for chains of up to
    four.

    **Observation, reward, info**: as in `TubeFeedEnv`. The first observation shows the target and
    the chain in the tube, the last one the chain at rest. One step leaves nothing to shape.

    Arguments are those of `magfold_env.envs.fold_env.FoldEnv`.
    """

    action_scope: ClassVar[Literal["component", "chain"]] = "chain"
    default_scene: ClassVar[str] = "tube-built"


SequenceDesignVectorEnv = ChainVectorEnv[Any].of(SequenceDesignEnv)
