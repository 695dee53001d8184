"""The contenders of the scaling benchmark solve the same problem; absent peers are no error."""

import numpy as np
import pytest

from magfold_env.benchmarks.dynamics import chain_contenders, chain_figure, chain_scaling
from magfold_env.benchmarks.dynamics.chain_contenders import BUILDS, LANES, SCALAR, missing
from magfold_env.benchmarks.dynamics.chain_problem import random_problem


def silent(share: float, what: str) -> None:
    pass


@pytest.mark.parametrize("n", [1, 2, 6, 60])
@pytest.mark.parametrize("name", BUILDS)
def test_contenders_find_the_same_accelerations(name, n):
    if name in missing():
        pytest.skip(f"{name} is not installed")
    problem = random_problem(n)
    expected = chain_contenders.dense(problem).accelerations
    contender = BUILDS[name](problem)
    bound = 1e-9 * np.abs(expected).max()
    np.testing.assert_allclose(contender.accelerations, expected, rtol=0, atol=bound)


def test_motors_turn_back_what_they_stand_on():
    problem = random_problem(5)
    # Motors in the hinges push nothing else: their power is torque times joint rate.
    assert problem.forces @ problem.rates == pytest.approx(problem.torques @ problem.joint_rates)


def test_the_slope_is_that_of_a_power_law():
    rows = [{"contender": SCALAR, "n": n, "time [µs]": 0.3 * n**1.25} for n in (1, 60, 450, 10_000)]
    assert chain_scaling.slope(rows, SCALAR) == pytest.approx(1.25)
    assert np.isnan(chain_scaling.slope(rows[:2], SCALAR))


def test_absent_peers_are_reported(monkeypatch):
    monkeypatch.setattr(chain_scaling, "missing", lambda: ["Pinocchio aba", "MuJoCo mj_step"])
    monkeypatch.setattr(chain_scaling, "QUICK_LENGTHS", (1, 3))
    part = chain_scaling.run(quick=True, progress=silent)
    assert {row["contender"] for row in part.rows} == {SCALAR, LANES, chain_contenders.DENSE}
    assert [text for text in part.findings if "absent" in text] == [
        "Pinocchio aba is absent",
        "MuJoCo mj_step is absent",
    ]


def test_contenders_that_disagree_are_not_timed(monkeypatch):
    def wrong(problem):
        found = chain_contenders.dense(problem)
        return chain_contenders.Contender(1.001 * found.accelerations, found.work, 1)

    monkeypatch.setitem(BUILDS, chain_contenders.DENSE, wrong)
    with pytest.raises(ArithmeticError, match="dense"):
        chain_scaling.run(quick=True, progress=silent)


def test_the_figure_has_a_line_a_contender(monkeypatch):
    figures = pytest.importorskip("matplotlib.figure")
    monkeypatch.setattr(chain_scaling, "QUICK_LENGTHS", (1, 3))
    rows = chain_scaling.run(quick=True, progress=silent).rows
    figure = figures.Figure()
    chain_figure.draw_scaling(rows, figure)
    drawn = {row["contender"] for row in rows} - {chain_scaling.OVERHEAD}
    assert {line.get_label() for line in figure.axes[0].lines} == drawn
