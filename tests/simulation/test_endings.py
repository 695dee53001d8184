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
