"""What the end of a run is called."""

import math

import pytest

from magfold_env.engine import outcomes
from magfold_env.fold import FoldStatus
from magfold_env.simulation.endings import ending


@pytest.mark.parametrize("sign", [-1.0, 1.0])
@pytest.mark.parametrize("off", [-0.051, -0.049, 0.0, 0.049, 0.051])
def test_a_fold_has_every_joint_within_a_twentieth_of_a_right_angle(
    sign: float, off: float
) -> None:
    joints = [math.pi / 2, sign * (math.pi / 2 + off), -math.pi / 2]
    status, words = ending(outcomes.RESTED, 0.5, joints, "")
    assert (status == FoldStatus.FOLDED) == (abs(off) < 0.05)
    assert status == FoldStatus.FOLDED or words == "at rest at t = 0.5 s with joint 2 open"


@pytest.mark.parametrize(
    ("joints", "told"),
    [
        ([*range(1, 30)], "joints 1 to 29"),
        ([3], "joint 3"),
        ([3, 4], "joints 3, 4"),
        ([1, 3, 4, 5, 8, 10, 11, 13, 14, 15], "joints 1, 3 to 5, 8, 10, 11, 13 to 15"),
    ],
)
def test_open_joints_are_told_in_ranges(joints: list[int], told: str) -> None:
    angles = [0.0 if joint in joints else math.pi / 2 for joint in range(1, max(joints) + 1)]
    _, message = ending(outcomes.RESTED, 0.25, angles, "")
    assert message == f"at rest at t = 0.25 s with {told} open"
