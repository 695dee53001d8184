"""How good a fold is, judged against the word that was wanted."""

import numpy as np
from numpy.typing import NDArray

from magfold_env.fold import FoldStatus
from magfold_env.shapes import similarity, word_to_angles

SUCCESS_TOLERANCE = 0.05
"""Largest deviation of a joint from its target angle in a success [rad]."""


def is_success(status: FoldStatus | None, joint_angles: NDArray[np.float64], target: str) -> bool:
    """Return whether the chain settled as `target`, every joint within `SUCCESS_TOLERANCE`.

    Parameters
    ----------
    status : FoldStatus or None
        How the fold ended.
    joint_angles : array, shape (n - 1,)
        Relative angles at the end [rad].
    target : str
        Word over L, S and R, one letter a joint.
    """
    if status is not FoldStatus.FOLDED:
        return False
    deviation = np.abs(joint_angles - word_to_angles(target))
    return bool(np.all(deviation <= SUCCESS_TOLERANCE))


def score(status: FoldStatus | None, joint_angles: NDArray[np.float64], target: str) -> float:
    """Return 1 for a success, 0 for a failed simulation, else half the similarity to `target`.

    The parameters are those of `is_success`. A miss scores at most one half, so no amount of
    similarity is worth as much as the fold itself.
    """
    if status is FoldStatus.FAILED:
        return 0.0
    if is_success(status, joint_angles, target):
        return 1.0
    return potential(joint_angles, target)


def potential(joint_angles: NDArray[np.float64], target: str) -> float:
    """Return Φ for potential-based shaping: half the similarity of the chain as it is now.

    Joints that are still in the tube count as straight. This is what the score would be if the
    episode ended here without a success.
    """
    return 0.5 * similarity(joint_angles, word_to_angles(target))
