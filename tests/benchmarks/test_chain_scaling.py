"""The contenders of the scaling benchmark solve the same problem; absent peers are no error."""

import numpy as np
import pytest

from magfold_bench import scaling
from magfold_bench.scaling import BUILDS, LANES, LONG, SCALAR, missing, random_problem
from magfold_bench.tables import growth, select


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


def test_the_slope_is_that_of_a_power_law():
    rows = [{"contender": SCALAR, "n": n, "time [µs]": 0.3 * n**1.25} for n in (1, 60, 450, 10_000)]
    assert growth(select(rows, contender=SCALAR), LONG) == pytest.approx(1.25)
    assert np.isnan(growth(rows[:2], LONG))


def test_absent_peers_are_reported(monkeypatch):
    absent = ["Pinocchio aba", "MuJoCo mj_step"]
    monkeypatch.setattr(scaling, "missing", lambda: absent)
    monkeypatch.setattr(scaling, "QUICK_LENGTHS", (1, 3))
    part = scaling.run(quick=True, progress=silent)
    assert {row["contender"] for row in part.rows} == {SCALAR, LANES, scaling.DENSE}
    said = [text for text in part.findings if "absent" in text]
    assert said == [f"{name} is absent" for name in absent]


def test_contenders_that_disagree_are_not_timed(monkeypatch):
    def wrong(problem):
        found = scaling.dense(problem)
        return scaling.Contender(1.001 * found.accelerations, found.work, 1)

    monkeypatch.setitem(BUILDS, scaling.DENSE, wrong)
    with pytest.raises(ArithmeticError, match="dense"):
        scaling.run(quick=True, progress=silent)


def test_the_figure_has_a_line_a_contender(monkeypatch):
    pytest.importorskip("matplotlib.figure")
    monkeypatch.setattr(scaling, "QUICK_LENGTHS", (1, 3))
    rows = scaling.run(quick=True, progress=silent).rows
    figure = scaling.draw(rows)
    drawn = {row["contender"] for row in rows} - {scaling.OVERHEAD}
    assert {line.get_label() for line in figure.axes[0].lines} == drawn
