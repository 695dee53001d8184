"""Tests of a three-link pendulum: energy, order of convergence, and agreement with scipy."""

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import magfold_env as mf
from magfold_bench.laws.mechanics import kinetic_energy, pinned_accelerations, weight_energy
from magfold_env.engine import indices as ix
from magfold_env.engine.outcomes import REACHED
from magfold_env.engine.stepping import integrator, stages
from magfold_env.engine.workspace import new_state, new_work
from magfold_env.simulation.session import Session

pytestmark = pytest.mark.laws

END = 0.3  # [s] several swings of a 5 cm chain, before it turns chaotic


def swing(tolerance):
    scene = mf.load_scene("pendulum-3").replace(solver={"tolerance": tolerance}, duration=END)
    fold: Any = mf.simulate(scene, frame_rate=500.0)
    return scene, fold


def drift(tolerance):
    """Return the largest change of the energy, relative to its range."""
    scene, fold = swing(tolerance)
    run: Any = fold.trajectory
    still = np.zeros((len(run.angles), 2))
    moving = kinetic_energy(scene, run.angles, run.rates, still)
    total = moving + weight_energy(scene, run.angles, still)
    return np.abs(total - total[0]).max() / moving.max()


def test_energy_is_kept_better_the_finer_the_tolerance():
    tolerances = 10.0 ** -np.arange(3, 10)
    drifts = np.array([drift(t) for t in tolerances])
    assert (drifts < 3.0 * tolerances).all()
    # Error control on local errors: the error follows the tolerance's power 5/5 to 6/5.
    slope = np.polyfit(np.log(tolerances), np.log(drifts), 1)[0]
    assert 0.8 < slope < 1.3


def test_the_fixed_step_converges_with_fifth_order():
    scene = mf.load_scene("pendulum-3").draw(np.random.default_rng(0))
    exact = reference(scene, 0.1)
    steps = np.array([40, 80, 160])
    errors = np.array([np.abs(fixed_steps(scene, 0.1, int(n)) - exact).max() for n in steps])
    orders = np.log2(errors[:-1] / errors[1:])
    assert (orders > stages.ORDER - 0.4).all()
    assert (orders < stages.ORDER + 1.0).all()


def test_it_agrees_with_scipy_on_the_dense_equation():
    scene, fold = swing(1e-11)
    exact = reference(scene, END)
    assert fold.angles == pytest.approx(exact[:3], abs=1e-8)
    assert fold.trajectory is not None
    assert fold.time == END


def reference(scene, until):
    """Return headings and rates (6,) at the end, by an eighth-order method of another family."""

    def slope(_, y):
        return np.concatenate([y[3:], pinned_accelerations(scene, y[:3], y[3:])])

    start = np.zeros(6)
    run = solve_ivp(slope, (0.0, until), start, "DOP853", rtol=1e-13, atol=1e-13)
    assert run.success
    return run.y[:, -1]


def fixed_steps(scene, until, count):
    """Return headings and rates (6,) after ``count`` equal steps of the engine's method."""
    session = Session(scene)
    model = session._model._replace(tolerance=0.01)  # accepts every step
    state, work = new_state(model, np.zeros(3)), new_work(model)
    record = session._chains.frames.record
    for end in np.linspace(0.0, until, count + 1)[1:]:
        state.clock[ix.STEP] = until
        assert integrator.advance(model, state, work, record, end, 10**9) == REACHED
    assert state.counter[ix.STEPS] == count
    return np.concatenate([state.q[:3], state.v[:3]])
