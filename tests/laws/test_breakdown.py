"""Tests that breakdowns end with a suitable status, without endless loops or silent NaN."""

import numpy as np
import pytest

import magfold_env as mf
from magfold_bench.laws.overlap import deepest_overlap
from magfold_bench.laws.random_scenes import designed_sequence
from magfold_env.engine import indices as ix
from magfold_env.engine import outcomes
from magfold_env.engine.stepping import integrator
from magfold_env.simulation.session import Session

pytestmark = pytest.mark.laws

MAX_STEPS = 1000
TOO_DEEP = 1e-3  # overlap, share of the side


def hopeless_scenes() -> dict[str, mf.Scene]:
    """Return unreasonable scenes by name."""
    n = 8
    rng = np.random.default_rng(0)
    plain = mf.Scene(sequence=designed_sequence(rng, n)).draw(rng)
    plain = plain.replace(solver={"max_steps": MAX_STEPS})
    tube = plain.replace(mount="tube", start_angles=None).draw(rng)
    straight = np.zeros(n - 1)
    closed = np.full(n - 1, np.pi / 2.0)
    return {
        "tolerance out of reach": plain.replace(solver={"tolerance": 1e-12}),
        "tolerance out of reach, tube": tube.replace(solver={"tolerance": 1e-12}),
        "masses of 1 ng and 1 t": plain.replace(casing={"mass": (1e-12, 1e3) * (n // 2)}),
        "no mass to speak of": plain.replace(casing={"mass": 1e-300}),
        "masses beyond squaring": plain.replace(casing={"mass": 1e300}),
        "inertia without mass": plain.replace(casing={"inertia": 1e12}),
        # As of a thousand tesla, which a remanence may not be.
        "magnets beyond all steel": plain.replace(magnets={"pole_charge": 3e4}),
        "charges beyond squaring": plain.replace(magnets={"pole_charge": 1e200}),
        "squares in one another": plain.replace(start_angles=closed),
        "squares in one another, friction 10": plain.replace(start_angles=closed, friction=10.0),
        "feed at 20 m/s": tube.replace(feed={"speed": 20.0}),
        "feed at 1e-9 m/s": tube.replace(feed={"speed": 1e-9}),
        "gravity of a neutron star": plain.replace(gravity={"in_plane": (1e12, 0.0)}),
        "friction of 1e12": plain.replace(friction=1e12),
        "perfectly straight": plain.replace(start_angles=straight, friction=0.0),
    }


SCENES = hopeless_scenes()


@pytest.mark.parametrize("scene", SCENES.values(), ids=[name.replace(" ", "-") for name in SCENES])
def test_a_hopeless_scene_ends_and_says_how(scene):
    fold = mf.simulate(scene)
    assert fold.message
    assert fold.steps <= MAX_STEPS
    if fold.steps == MAX_STEPS:
        assert fold.status is mf.FoldStatus.UNSETTLED
        assert "steps are the limit" in fold.message
    assert np.isfinite(fold.joint_angles).all()
    if fold.status in {mf.FoldStatus.FOLDED, mf.FoldStatus.MISFOLDED}:
        angles = np.concatenate([[0.0], np.cumsum(fold.joint_angles)])
        deep = deepest_overlap(scene.alone(), angles, np.zeros(2), scene.n)
        assert deep <= TOO_DEEP * scene.casing.side


def test_a_run_goes_on_after_a_step_that_a_time_limit_cut_to_nothing():
    scene = mf.load_scene("paper/sequence-3").replace(mount="free", friction=0.0)
    session = Session(scene.draw(np.random.default_rng(0)))
    model, state, record = session._model, session._state, session._chains.frames.record
    state.clock[ix.STEP] = 4e-16
    outcome = integrator.advance(model, state, session._work, record, 1e-3, 10**9)
    assert outcome == outcomes.REACHED
