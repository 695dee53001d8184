"""The error of a step in the metric of the masses, against the dense mass matrix."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from magfold_env.engine.chain import articulated, feed
from magfold_env.engine.stepping import stages
from magfold_env.engine.workspace import new_state, new_work
from magfold_env.scene import Casing, Scene
from magfold_env.simulation.pack import pack
from tests.engine import reference


def stepped(seed, masses):
    """A free chain and its work after the stages of a step, all drawn at random.

    The estimated errors of its velocities are in ``stages.v``.
    """
    rng = np.random.default_rng(seed)
    n = len(masses)
    scene = Scene(sequence=("NNSS",) * n, casing=Casing(mass=tuple(masses)), friction=0.0)
    model = pack(scene)
    state, work = new_state(model, rng.uniform(-3.0, 3.0, n)), new_work(model)
    work.stages.new_v[:] = rng.normal(0.0, 50.0, n + 2)
    work.stages.v[:] = rng.normal(0.0, 10.0, n + 2)
    feed.place_all(0, model, state.q, work.pose)
    articulated.centre_velocities(
        0, model.bodies, work.pose, work.stages.new_v, work.centres.vx, work.centres.vy
    )
    return scene, model, state, work


@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 8))
def test_errors_are_measured_by_the_kinetic_energy(seed, n):
    masses = (10.0 ** np.random.default_rng(seed).uniform(-6.0, 0.0, n)).tolist()
    scene, model, state, work = stepped(seed, masses)
    matrix = reference.mass_matrix(state.q, scene.casing.side, scene.masses, scene.inertias)
    off = work.stages.v.copy()
    slow = stages.SLOW * model.rate_scale * scene.casing.diagonal
    usual = max(work.stages.new_v @ matrix @ work.stages.new_v, scene.masses.mean() * slow**2)
    expected = np.sqrt(off @ matrix @ off / usual) / (stages.LOCAL * model.tolerance)
    assert stages.kinetic_error(0, model, work) == pytest.approx(expected, rel=1e-6)


def test_only_uneven_chains_are_judged_by_it():
    for masses, judged in (([0.01, 0.01, 0.01], False), ([1.0, 1e-5, 1.0], True)):
        _, model, state, work = stepped(1, masses)
        # The whole chain at rest is wrong by one velocity: all masses together by more than one.
        for wrong in (
            work.stages.q,
            work.stages.v,
            work.stages.new_v,
            work.centres.vx,
            work.centres.vy,
        ):
            wrong[:] = 0.0
        work.stages.v[model.n] = 1e-4
        kinetic = stages.kinetic_error(0, model, work)
        error = stages.step_error(model, state, work)
        assert error == kinetic if judged else error < kinetic
        assert (model.light_rate > stages.UNEVEN * model.rate_scale) is judged
