"""The laws that the dynamics must hold, over random scenes: none is broken."""

import numpy as np
import pytest

from magfold_bench.laws.along_folds import follow
from magfold_bench.laws.dense import look_inside
from magfold_bench.laws.random_scenes import random_scene
from magfold_env.fold import FoldStatus
from tests.laws.free_motion import creep, momentum_errors, reversal_error
from tests.laws.impacts import impact_error

pytestmark = pytest.mark.laws


@pytest.mark.parametrize("tolerance", [1e-3, 1e-6, 1e-9, 1e-11])
@pytest.mark.parametrize("seed", range(3))
def test_a_free_chain_keeps_its_momenta(seed, tolerance):
    assert max(momentum_errors(seed, tolerance, contact=False)) <= 10 * tolerance


@pytest.mark.parametrize("seed", range(3))
def test_momenta_are_exact_to_ten_digits_at_the_tightest_tolerance(seed):
    assert max(momentum_errors(seed, 1e-12, contact=False)) <= 1e-10


@pytest.mark.parametrize("kind", ["thrown", "pendulum"])
@pytest.mark.parametrize("tolerance", [1e-3, 1e-6, 1e-9])
@pytest.mark.parametrize("seed", range(3))
def test_a_film_run_backwards_ends_at_its_start(seed, tolerance, kind):
    assert reversal_error(kind, seed, tolerance) <= tolerance


@pytest.mark.parametrize("seed", [3, 5, 11, 16, 21])
def test_what_friction_holds_does_not_move_by_a_bit(seed):
    assert creep(seed) == 0.0


@pytest.mark.parametrize("seed", range(0, 60, 2))
def test_impacts_are_projections(seed):
    error = impact_error(seed)
    assert error is None or error <= 1e-8


MANY = range(40)
MISSED = 500.0
"""Times what is allowed, where some scenes miss a law; docs/dynamics.md names those laws."""


@pytest.mark.weekly
@pytest.mark.parametrize(
    ("tolerance", "contact", "allowed", "missed"),
    [
        (1e-3, False, 1e-2, 1.0),
        (1e-6, False, 1e-5, 1.0),
        (1e-12, False, 1e-10, 1.0),
        (1e-3, True, 1e-2, MISSED),
        (1e-4, True, 1e-3, 1.0),
    ],
)
def test_many_chains_keep_their_momenta(tolerance, contact, allowed, missed):
    errors = [momentum_errors(seed, tolerance, contact=contact) for seed in MANY]
    linear, angular = np.max(errors, axis=0)
    assert linear <= allowed
    assert angular <= allowed * missed


@pytest.mark.weekly
@pytest.mark.parametrize("tolerance", [1e-3, 1e-6, 1e-9])
@pytest.mark.parametrize("kind", ["thrown", "pendulum", "magnetic"])
def test_many_films_run_backwards_end_at_their_start(kind, tolerance):
    missed = kind == "magnetic" or (kind, tolerance) == ("thrown", 1e-3)
    worst = np.max([reversal_error(kind, seed, tolerance) for seed in MANY])
    assert worst <= tolerance * (MISSED if missed else 1.0)


@pytest.mark.weekly
@pytest.mark.parametrize("seed", MANY)
def test_every_step_of_many_folds_keeps_all_limits(seed):
    scene = random_scene(seed)
    (motion, session), (inside, _) = follow(scene), look_inside(scene)
    assert motion.finite
    assert session.status is not FoldStatus.FAILED
    assert max(inside.casings, inside.solids) <= 1e-3
    assert inside.past_stop <= 1e-3
    assert motion.rise <= (1e-5 if scene.frictions.any() else 1e-4)


@pytest.mark.weekly
def test_many_chains_do_not_creep_and_many_impacts_are_projections():
    assert {creep(seed) for seed in MANY} <= {0.0, None}
    errors = [impact_error(seed) for seed in range(400)]
    assert np.max([error for error in errors if error is not None]) <= 1e-8
