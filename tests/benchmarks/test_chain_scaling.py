"""Tests that the scaling benchmark's methods agree, and that it works without peers."""

import numpy as np
import pytest

from magfold_bench import scaling
from magfold_bench.scaling import BUILDS, missing, random_problem


def silent(share: float, what: str) -> None:
    pass


@pytest.mark.parametrize("n", [1, 2, 6, 60])
@pytest.mark.parametrize("name", BUILDS)
def test_contenders_find_the_same_accelerations(name, n):
    if name in missing():
        pytest.skip(f"{name} is not installed")
    problem = random_problem(n)
    expected = scaling.dense(problem).accelerations
    contender = BUILDS[name](problem)
    bound = 1e-9 * np.abs(expected).max()
    np.testing.assert_allclose(contender.accelerations, expected, rtol=0, atol=bound)


def test_motors_turn_back_what_they_stand_on():
    problem = random_problem(5)
    # Motors in the hinges push nothing else: their power is torque times joint rate.
    assert problem.forces @ problem.rates == pytest.approx(problem.torques @ problem.joint_rates)


def test_contenders_that_disagree_are_not_timed(monkeypatch):
    def wrong(problem):
        found = scaling.dense(problem)
        return scaling.Contender(1.001 * found.accelerations, found.work, 1)

    monkeypatch.setitem(BUILDS, scaling.DENSE, wrong)
    with pytest.raises(ArithmeticError, match="dense"):
        scaling.run(quick=True, progress=silent)
