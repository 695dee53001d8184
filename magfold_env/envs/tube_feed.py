"""``MagFold/TubeFeed-v0``: choose each component's magnets and feed speed as it leaves the tube."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from magfold_env.envs.fold_env import FoldEnv
from magfold_env.envs.vector_env import ChainVectorEnv


class TubeFeedEnv(FoldEnv[NDArray[np.float32]]):
    """Feed a chain of ``n`` components out of a tube so that it folds into a target.

    Step ``k`` sets the four magnets and the feed speed of the ``k``-th component to leave the
    tube (component ``k`` in forward feed, ``n + 1 − k`` in backward feed), and feeds it out. With
    the last component the chain also settles and the episode terminates: the horizon is ``n``,
    and there is no time limit. The episode ends early if the simulation breaks down, or if every
    letter of a quasistatic chain's next joint causes an overlap.

    **Action**: ``MultiDiscrete([16, speeds])``. The first number is the magnet pattern, four bits:
    front-left (most significant), back-left, back-right, front-right, with N = 0 and S = 1 (0 is
    NNNN, 8 is SNNN, 15 is SSSS). The second is the speed level, log-spaced from 0.01 to 0.6 m/s,
    both included. `magfold_env.envs.spaces.actions` lists the other forms.

    **Observation**: a flat ``Box(−1, 1)`` of ``17 n − 4`` entries, component 1 first.

    ======== ========= ========================================================= =============
    group    entries   meaning and unit                                          range
    ======== ========= ========================================================= =============
    target   3 (n − 1) letter of each joint of the target, one-hot over L, S, R  0, 1
    released n         1 once a component is out; the sum is the step index      0, 1
    magnets  4 n       front-left, back-left, back-right, front-right:           −1, 0, 1
                       1 for N, −1 for S, 0 if not set yet
    speed    n         requested feed speed, log scale: −1 is 0.01 m/s,          [−1, 1]
                       1 is 0.6 m/s; 0 if not set yet
    joint    n − 1     relative angle, in units of π rad                         [−1, 1]
    heading  2 n       sine and cosine of the heading                            [−1, 1]
    rate     n         angular rate of the heading, in units of 100 rad/s        (−1, 1) *
    position 2 n       centre relative to the tube's mouth, in chain lengths     (−1, 1) *
    velocity 2 n       velocity of the centre, in m/s                            (−1, 1) *
    ======== ========= ========================================================= =============

    Entries marked * are squashed by ``x / (1 + |x|)``, so nothing is clipped. Without
    randomisation, these entries and the action determine the next state: the task is a Markov
    decision process. With ``randomisation`` it is partially observed, because observations do not
    contain the drawn friction, remanence, masses and speed errors.

    **Reward**: ``score − b(target)`` at the end; `magfold_env.envs.tasks.reward` explains both.

    **Info**: ``target``, ``word``, ``step``; at the end also ``status``, ``message``, ``energy``
    [J] (NaN if the simulation failed), ``score``, ``baseline``, ``baseline_missing`` (true if no
    design is known and b is 0) and ``is_success``.

    Arguments are those of `magfold_env.envs.fold_env.FoldEnv`. In the scene, ``feed.loading``
    must be ``at_mouth``. With an external field, ``baseline`` must be None.
    """


TubeFeedVectorEnv = ChainVectorEnv[Any].of(TubeFeedEnv)
