"""The reference integrators: orders of convergence, and agreement with others."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from magfold_bench.laws import integrators
from magfold_bench.laws.mechanics import pinned_accelerations
from magfold_bench.laws.smooth_motion import (
    ADAMS,
    DOP853,
    DP54,
    EULER,
    MIDPOINT,
    VERLET,
    Integrator,
    SmoothProblem,
    Unreached,
    pendulum,
)

SHORT = 0.1  # [s] of the pendulum's swing


def interpreted(method: Integrator) -> Integrator:
    """The same method as Python runs it: compiling takes seconds, the runs here less."""
    kernels: dict[str, Any] = {"fixed": method.fixed, "adaptive": method.adaptive}
    plain = {kind: getattr(each, "py_func", each) for kind, each in kernels.items()}
    return replace(method, **plain)


@pytest.fixture(
    scope="module",
    autouse=True,
    params=["interpreted", pytest.param("compiled", marks=pytest.mark.slow)],
)
def pairs(request):
    with pytest.MonkeyPatch.context() as patch:
        if request.param == "interpreted":
            plain = getattr(integrators.runge_kutta, "py_func", integrators.runge_kutta)
            patch.setattr(integrators, "runge_kutta", plain)
        yield


ADAPTIVE = (DP54, DOP853, interpreted(ADAMS))
FIXED = ((EULER, 1), (VERLET, 2), (MIDPOINT, 2))


@pytest.fixture(scope="module")
def swing():
    problem = pendulum(3)
    return SmoothProblem("short", problem.scene.replace(duration=SHORT))


@pytest.fixture(scope="module")
def exact(swing):
    """Headings by SciPy on equation 39 with dense matrices."""
    scene, n = swing.scene, swing.scene.n

    def slope(_, y):
        return np.concatenate([y[n:], pinned_accelerations(scene, y[:n], y[n:])])

    # From rest on a horizontal line, where all headings are 0.
    run = solve_ivp(slope, (0.0, SHORT), np.zeros(2 * n), "DOP853", rtol=1e-13, atol=1e-13)
    assert run.success
    return run.y[:n, -1]


def error(method: Integrator, problem, setting, exact):
    return np.abs(method.prepare(problem, setting)().angles - exact).max()


@pytest.mark.medium
@pytest.mark.parametrize(
    ("method", "order"),
    [
        *((interpreted(method), order) for method, order in FIXED),
        *(pytest.param(*each, marks=pytest.mark.slow) for each in FIXED),
    ],
)
def test_equal_steps_converge_at_their_order(method, order, swing, exact):
    errors = np.array([error(method, swing, steps, exact) for steps in (400, 800, 1600)])
    assert np.log2(errors[:-1] / errors[1:]) == pytest.approx(order, abs=0.1)


@pytest.mark.parametrize(
    "method",
    [*ADAPTIVE, pytest.param(ADAMS, marks=pytest.mark.slow)],
    ids=lambda method: method.name,
)
def test_error_control_follows_the_tolerance(method, swing, exact):
    tolerances = 10.0 ** -np.arange(3, 11)
    errors = np.array([error(method, swing, t, exact) for t in tolerances])
    assert (errors < 10.0 * tolerances).all()
    slope = np.polyfit(np.log(tolerances), np.log(errors), 1)[0]
    assert 0.8 < slope < 1.3


def test_higher_order_needs_fewer_evaluations_for_small_errors(swing):
    at = {method.name: method.prepare(swing, 1e-10)().evaluations for method in ADAPTIVE}
    assert at["Adams PECE"] < at["DOP853"] < at["DP5(4)"]


def test_evaluations_grow_with_the_order_of_the_pair(swing):
    # Work of a method of order p at tolerance ε: ε^(-1/p).
    for method, order in ((ADAPTIVE[0], 5), (DOP853, 8)):
        loose, tight = (method.prepare(swing, t)().evaluations for t in (1e-6, 1e-11))
        assert np.log(tight / loose) / np.log(1e5) == pytest.approx(1 / order, abs=0.03)


def test_a_tolerance_out_of_reach_is_told(swing):
    with pytest.raises(Unreached, match="DOP853"):
        DOP853.prepare(swing, 1e-40)()


def test_adams_is_as_exact_as_it_is_asked_for(swing, exact):
    assert error(ADAPTIVE[2], swing, 1e-12, exact) < 1e-11
