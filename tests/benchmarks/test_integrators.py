"""Tests of the reference integrators: order of convergence, and agreement with a library."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from magfold_bench.laws.integrators import EULER, FIXED, MIDPOINT, VERLET
from magfold_bench.laws.mechanics import pinned_accelerations
from magfold_bench.paper import pendulum
from magfold_env.engine.workspace import new_work
from magfold_env.scene import Scene
from magfold_env.simulation.pack import pack

SHORT = 0.1  # [s] of the pendulum's swing


# Python takes less time for what little is done here than it takes to compile the loops.
@pytest.fixture(params=["interpreted", pytest.param("compiled", marks=pytest.mark.slow)])
def compiled(request) -> bool:
    return request.param == "compiled"


@pytest.fixture(scope="module")
def swing() -> Scene:
    return pendulum.problem()


@pytest.fixture(scope="module")
def exact(swing):
    """Headings by SciPy on equation 39 with dense matrices."""
    n = swing.n

    def slope(_, y):
        return np.concatenate([y[n:], pinned_accelerations(swing, y[:n], y[n:])])

    # From rest on a horizontal line, where all headings are 0.
    run = solve_ivp(slope, (0.0, SHORT), np.zeros(2 * n), "DOP853", rtol=1e-13, atol=1e-13)
    assert run.success
    return run.y[:n, -1]


@pytest.mark.medium
@pytest.mark.parametrize(("name", "order"), [(EULER, 1), (VERLET, 2), (MIDPOINT, 2)])
def test_equal_steps_converge_at_their_order(name, order, swing, exact, compiled):
    errors = []
    for steps in (400, 800, 1600):
        model, y = pack(swing), np.zeros(2 * (swing.n + 2))
        method = FIXED[name] if compiled else getattr(FIXED[name], "py_func", FIXED[name])
        method(model, new_work(model), y, SHORT, steps)
        errors.append(np.abs(y[: swing.n] - exact).max())
    assert np.log2(np.divide(errors[:-1], errors[1:])) == pytest.approx(order, abs=0.1)
