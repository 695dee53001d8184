"""Why folds miss: how they ended, and which joints stood in the way."""

from collections import Counter
from collections.abc import Sequence

import numpy as np

from agents.evaluation.episodes import Outcome
from magfold_env.envs.tasks.goals import SUCCESS_TOLERANCE
from magfold_env.shapes import word_to_angles

ENDS = ("target", "other fold", "misfolded", "unsettled", "failed")
"""How an episode may end: in the target, at rest in another fold, at rest with a joint open,
not at rest when time or work ran out, or with numbers that broke down."""


def end_of(outcome: Outcome) -> str:
    """Return which of `ENDS` an episode came to."""
    if outcome.success:
        return "target"
    return "other fold" if outcome.status == "folded" else outcome.status


def ends(outcomes: Sequence[Outcome]) -> dict[str, int]:
    """Return how many episodes came to each end."""
    counts = Counter(map(end_of, outcomes))
    return {end: counts[end] for end in ENDS}


def open_joints(outcome: Outcome) -> list[int]:
    """Return the numbers of the joints that are not fully folded, to either side."""
    apart = np.abs(np.abs(np.array(outcome.joints)) - 0.5 * np.pi)
    return (np.flatnonzero(apart > SUCCESS_TOLERANCE) + 1).tolist()


def wrong_joints(outcome: Outcome) -> list[int]:
    """Return the numbers of the joints that are fully folded to the wrong side."""
    wanted = word_to_angles(outcome.target)
    apart = np.abs(np.array(outcome.joints) + wanted)
    return (np.flatnonzero(apart <= SUCCESS_TOLERANCE) + 1).tolist()


def joints_in_the_way(outcomes: Sequence[Outcome]) -> dict[str, list[int]]:
    """Return how often each joint stayed ``open`` or folded ``wrong`` in episodes that missed.

    Joint 1 comes first. Simulations that failed, and chains that were not all fed, do not count.
    """
    joints = max((len(outcome.joints) for outcome in outcomes), default=0)
    counts = {"open": np.zeros(joints, dtype=np.int64), "wrong": np.zeros(joints, dtype=np.int64)}
    for outcome in outcomes:
        if outcome.success or outcome.status == "failed":
            continue
        for kind, found in (("open", open_joints(outcome)), ("wrong", wrong_joints(outcome))):
            counts[kind][[joint - 1 for joint in found]] += 1
    return {kind: numbers.tolist() for kind, numbers in counts.items()}
