"""Tests of steps: limits, error estimates, the scheme for slow motion, and work caps."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import magfold_env as mf
from magfold_bench.laws.along_folds import SteppedSession
from magfold_bench.laws.random_scenes import random_scene
from magfold_env.designer.annealing import sequence_of_signs, stable_signs
from magfold_env.engine.chain import articulated, tube
from magfold_env.engine.stepping import chebyshev, stages
from magfold_env.engine.workspace import new_state, new_work
from magfold_env.ensembles.releases import generator, release
from magfold_env.simulation.pack import pack
from tests.engine import reference


@pytest.mark.parametrize("seed", [1, 8, 10, 14])
def test_looking_at_every_step_changes_no_bit(seed):
    scene = random_scene(seed)
    times = []
    session = SteppedSession(scene, lambda s: times.append(s.time))
    session.settle()
    fold, other = session.fold(), mf.simulate(scene)
    assert (fold.angles == other.angles).all()
    assert (fold.base == other.base).all()
    assert (fold.time, fold.steps, fold.message) == (other.time, other.steps, other.message)
    # Steps that were tried and rejected count, but are not seen.
    assert 0.5 * fold.steps < len(times) <= fold.steps + session.n + 1
    assert times == sorted(times)


def test_a_second_of_simulated_time_has_a_work_cap_of_its_own():
    tube = {"mount": "tube", "feed": {"speed": 0.02}}
    scene = random_scene(14).replace(friction=0.35, start_angles=None, **tube)
    whole = mf.simulate(scene)
    assert whole.time > 3.0
    busiest = whole.steps / whole.time
    capped = mf.simulate(scene.replace(solver={"max_steps_per_second": int(busiest)}))
    assert capped.status is mf.FoldStatus.UNSETTLED
    assert f"{int(busiest)} steps a second are the limit" in capped.message
    assert capped.steps < whole.steps
    roomy = mf.simulate(scene.replace(solver={"max_steps_per_second": whole.steps}))
    assert (roomy.status, roomy.steps) == (whole.status, whole.steps)


@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 8))
def test_errors_are_measured_by_the_kinetic_energy(seed, n):
    rng = np.random.default_rng(seed)
    masses = (10.0 ** rng.uniform(-6.0, 0.0, n)).tolist()
    scene = mf.Scene(sequence=("NNSS",) * n, casing=mf.Casing(mass=tuple(masses)), friction=0.0)
    model = pack(scene)
    state, work = new_state(model, rng.uniform(-3.0, 3.0, n)), new_work(model)
    work.stages.new_v[:] = rng.normal(0.0, 50.0, n + 2)
    work.stages.v[:] = off = rng.normal(0.0, 10.0, n + 2)
    tube.place_all(0, model, state.q, work.pose)
    articulated.centre_velocities(
        0, model.bodies, work.pose, work.stages.new_v, work.centres.vx, work.centres.vy
    )
    matrix = reference.mass_matrix(state.q, scene.casing.side, scene.masses, scene.inertias)
    slow = stages.SLOW * model.typical_rate * scene.casing.diagonal
    usual = max(work.stages.new_v @ matrix @ work.stages.new_v, scene.masses.mean() * slow**2)
    expected = np.sqrt(off @ matrix @ off / usual) / (stages.LOCAL * model.tolerance)
    assert stages.kinetic_error(0, model, work) == pytest.approx(expected, rel=1e-6)


SLIDING = mf.Scene(
    sequence=("NNSS", "SSNN", "NNNS", "NSSS", "NSNS", "NNSS"), mount="tube", friction=0.35,
    start_angle_spread=0.03,
)  # fmt: skip


def growth(stages: int, z: np.ndarray) -> np.ndarray:
    """Return the result of a step for y' = λ y from y = 1, with z = h λ."""
    scheme = chebyshev.SCHEME[stages]
    before, last = np.ones_like(z), 1.0 + scheme[1, 3] * z
    for a, b, c, d in scheme[2 : stages + 1]:
        following = 1.0 + a * (last - 1.0) + b * (before - 1.0) + z * (c * last + d)
        before, last = last, following
    return last


@pytest.mark.parametrize("stages", range(2, chebyshev.MOST_STAGES + 1))
def test_stages_are_stable_as_far_as_they_are_trusted(stages):
    z = np.linspace(-0.65 * (stages**2 - 1.0), 0.0, 5001)
    assert np.abs(growth(stages, z)).max() <= 1.0
    assert np.abs(growth(stages, z[z < -1.0])).max() < 0.97


@pytest.mark.parametrize("stages", range(2, chebyshev.MOST_STAGES + 1))
def test_steps_are_of_second_order(stages):
    z = np.array([-1e-2, -1e-3])
    error = np.abs(growth(stages, z) - np.exp(z))
    assert np.log10(error[0] / error[1]) == pytest.approx(3.0, abs=0.05)


def fold(speed: float, tolerance: float, seed: int) -> mf.Fold:
    scene = SLIDING.replace(feed={"speed": speed}, solver={"tolerance": tolerance})
    return mf.simulate(scene, seed)


@pytest.mark.parametrize("seed", range(3))
def test_slow_slides_end_as_exact_ones_do(seed):
    exact = fold(0.012, 1e-8, seed)
    for tolerance in (1e-3, 1e-4):
        found = fold(0.012, tolerance, seed)
        assert found.word == exact.word
        np.testing.assert_allclose(found.angles, exact.angles, rtol=0, atol=20.0 * tolerance)


def test_a_feed_ten_times_as_slow_takes_no_ten_times_as_much_work():
    # An explicit pair takes 5,080 evaluations at the lower speed.
    slow, fast = (
        np.mean([fold(speed, 1e-3, seed).evaluations for seed in range(6)]) for speed in (0.01, 0.1)
    )
    assert slow < 2.6 * fast


WORD = "LLLRLLRLRLR"


def test_a_chain_whose_loops_push_each_other_open_comes_to_rest():
    # Step after step one joint touched its stop and was moved off it to close a loop of squares:
    # 50,000 steps in a simulated second, the scene's work cap.
    sequence = sequence_of_signs(stable_signs(WORD, np.random.default_rng(7))[0])
    scene = mf.load_scene("design-long").replace(sequence=sequence)
    fold = mf.simulate(release(scene, "forward", 0.2), generator(3, 0))
    assert fold.status in {"folded", "misfolded"}
    assert fold.steps < 5000
