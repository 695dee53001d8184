"""Tests of joints that stay at their stops after an impact, and of how fast gaps may close."""

import math

import numpy as np
import pytest

from magfold_env.engine import indices as ix
from magfold_env.engine.contact import constraints, events
from magfold_env.engine.friction.law import find_velocities
from magfold_env.engine.workspace import new_state, new_work
from magfold_env.scene import Scene
from magfold_env.simulation.pack import pack

MODEL = pack(Scene(sequence=("NNSS",) * 4))
PULL = 1e4  # [rad/s²], what magnets pull a joint shut with


def hopping(rate, joint=1, tolerance=1e-3):
    """Return a free chain; joint ``joint`` leaves its left stop at a rate and is pulled back."""
    scene = Scene(sequence=("NNNN",) * 3, magnets=None)
    scene = scene.replace(solver={"tolerance": tolerance})
    model = pack(scene)
    angles = np.zeros(3)
    angles[joint:] = math.pi / 2.0
    state, work = new_state(model, angles), new_work(model)
    state.v[:] = np.random.default_rng(0).normal(0.0, 5.0, 5) * [1.0, 1.0, 1.0, 0.01, 0.01]
    state.v[joint] = state.v[joint - 1] - rate
    acceleration = np.zeros(5)
    acceleration[joint] = PULL
    return model, state, work, acceleration


def momentum(model, state, work):
    """Return the linear momentum [kg m/s]."""
    find_velocities(0, model, state, work)
    return np.array([model.bodies.mass @ work.centres.vx, model.bodies.mass @ work.centres.vy])


def energy(model, state, work):
    """Return the kinetic energy [J]."""
    momentum(model, state, work)
    moving = model.bodies.mass @ (work.centres.vx**2 + work.centres.vy**2)
    return 0.5 * (moving + model.bodies.inertia @ state.v[: model.n] ** 2)


@pytest.mark.parametrize("joint", [1, 2])
@pytest.mark.parametrize("tolerance", [1e-2, 1e-3, 1e-5])
def test_a_hop_too_small_to_see_is_left_out(joint, tolerance):
    seen = math.sqrt(2.0 * PULL * events.HOP * tolerance)
    model, state, work, acceleration = hopping(0.9 * seen, joint, tolerance)
    before, power = momentum(model, state, work), energy(model, state, work)
    assert events.end_hops(model, state, work, acceleration) == constraints.IMPACT
    assert state.lock[joint] == 1
    assert state.v[joint] == state.v[joint - 1]
    assert work.rows.counts[ix.JOINT_STOPS] == 1
    # The joint is held from within the chain, and by a projection.
    np.testing.assert_allclose(momentum(model, state, work), before, rtol=1e-12)
    assert energy(model, state, work) < power


@pytest.mark.parametrize("joint", [1, 2])
def test_a_larger_hop_takes_place(joint):
    seen = math.sqrt(2.0 * PULL * events.HOP * 1e-3)
    model, state, work, acceleration = hopping(1.1 * seen, joint)
    before = state.v.copy()
    assert events.end_hops(model, state, work, acceleration) == constraints.OK
    assert (state.v == before).all()
    assert state.lock[joint] == 0


def test_a_joint_that_nothing_pulls_back_opens():
    model, state, work, acceleration = hopping(1e-3)
    assert events.end_hops(model, state, work, -acceleration) == constraints.OK
    assert state.lock[1] == 0


@pytest.mark.parametrize("time", [1e-9, 1e-5, 1e-2])
def test_a_gap_may_close_within_the_time_and_no_further(time):
    assert constraints.allowance(MODEL, 1e-6, time, MODEL.side) == pytest.approx(1e-6 / time)
    assert constraints.allowance(MODEL, 0.0, time, MODEL.side) == 0.0


def test_overlaps_open_slowly_and_no_faster_than_errors_of_rates_allow():
    slow = constraints.GENTLE * MODEL.tolerance * MODEL.typical_rate
    assert constraints.allowance(MODEL, -1e-12, 1e-2, MODEL.side) == pytest.approx(
        -constraints.PUSH_OUT * 1e-10
    )
    for time in (1e-9, 1e-5):
        assert constraints.allowance(MODEL, -1e-5, time, MODEL.side) == pytest.approx(
            -slow * MODEL.side
        )
        assert constraints.allowance(MODEL, -1e-5, time, 1.0) == pytest.approx(
            max(-slow, -2e-6 / time)
        )
