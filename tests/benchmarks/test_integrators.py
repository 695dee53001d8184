"""The reference integrators: orders of convergence, and agreement with another library."""

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from magfold_bench.laws import integrators
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


def run(method: Any, scene: Scene, setting: float, *, compiled: bool) -> tuple[Any, int]:
    """Return headings at the end, and the evaluations."""
    model, y = pack(scene), np.zeros(2 * (scene.n + 2))
    advance = method if compiled else getattr(method, "py_func", method)
    count = advance(model, new_work(model), y, SHORT, setting)
    return y[: scene.n], count


@pytest.mark.medium
@pytest.mark.parametrize(("name", "order"), [(EULER, 1), (VERLET, 2), (MIDPOINT, 2)])
def test_equal_steps_converge_at_their_order(name, order, swing, exact, compiled):
    errors = []
    for steps in (400, 800, 1600):
        found, _ = run(FIXED[name], swing, steps, compiled=compiled)
        errors.append(np.abs(found - exact).max())
    assert np.log2(np.divide(errors[:-1], errors[1:])) == pytest.approx(order, abs=0.1)


def test_error_control_follows_the_tolerance(swing, exact, compiled):
    tolerances = 10.0 ** -np.arange(3, 11)
    runs = [run(integrators.dormand_prince, swing, t, compiled=compiled) for t in tolerances]
    errors = np.array([np.abs(found - exact).max() for found, _ in runs])
    assert (errors < 10.0 * tolerances).all()
    slope = np.polyfit(np.log(tolerances), np.log(errors), 1)[0]
    assert 0.8 < slope < 1.3
    # Work of a method of order 5 at tolerance ε: ε^(-1/5).
    loose, tight = (
        run(integrators.dormand_prince, swing, t, compiled=compiled)[1] for t in (1e-6, 1e-11)
    )
    assert np.log(tight / loose) / np.log(1e5) == pytest.approx(0.2, abs=0.03)


def test_a_tolerance_out_of_reach_is_told(swing, compiled):
    assert run(integrators.dormand_prince, swing, 1e-40, compiled=compiled)[1] == -1
