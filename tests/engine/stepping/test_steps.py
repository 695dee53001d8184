"""After and inside every step of random scenes: squares apart, joints within stops."""

import pytest

from magfold_bench.laws.along_folds import SteppedSession, follow
from magfold_bench.laws.dense import look_inside
from magfold_bench.laws.random_scenes import random_scene
from magfold_env.fold import FoldStatus
from magfold_env.simulation.simulate import simulate

DEEPEST = 1e-3  # share of the side


def check(seed):
    scene = random_scene(seed)
    motion, session = follow(scene)
    assert motion.finite, session.message
    inside, _ = look_inside(scene)
    assert max(inside.casings, inside.solids) <= DEEPEST
    assert inside.past_stop <= scene.solver.tolerance
    return session


@pytest.mark.parametrize("seed", [3, 8, 10, 13, 14])
def test_every_step_keeps_its_limits(seed):
    check(seed)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(100, 150))
def test_every_step_keeps_its_limits_and_the_fold_goes_through(seed):
    session = check(seed)
    assert session.status is not FoldStatus.FAILED, session.message


@pytest.mark.parametrize("seed", [1, 8, 10, 14])
def test_looking_at_every_step_changes_no_bit(seed):
    scene = random_scene(seed)
    times = []
    session = SteppedSession(scene, lambda s: times.append(s.time))
    session.run()
    fold, other = session.fold(), simulate(scene)
    assert (fold.angles == other.angles).all()
    assert (fold.base == other.base).all()
    assert (fold.time, fold.steps, fold.message) == (other.time, other.steps, other.message)
    # Steps that were tried and rejected count, but are not seen.
    assert 0.5 * fold.steps < len(times) <= fold.steps + session.n + 1
    assert times == sorted(times)


def test_the_work_cap_holds_when_steps_are_watched():
    scene = random_scene(14).replace(solver={"max_steps": 20})
    session = SteppedSession(scene)
    session.run()
    assert session.steps == 20
    assert session.message == simulate(scene).message


def test_a_second_of_simulated_time_has_a_work_cap_of_its_own():
    tube = {"mount": "tube", "feed": {"speed": 0.02}}
    scene = random_scene(14).replace(friction=0.35, start_angles=None, **tube)
    whole = simulate(scene)
    assert whole.time > 3.0
    busiest = whole.steps / whole.time
    capped = simulate(scene.replace(solver={"max_steps_per_second": int(busiest)}))
    assert capped.status is FoldStatus.UNSETTLED
    assert f"{int(busiest)} steps a second are the limit" in capped.message
    assert capped.steps < whole.steps
    roomy = simulate(scene.replace(solver={"max_steps_per_second": whole.steps}))
    assert (roomy.status, roomy.steps) == (whole.status, whole.steps)
