"""The laws that the dynamics must hold, over random scenes: none is broken."""

import pytest

from tests.laws import limits
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


# Laws and tolerances that some scenes miss; docs/dynamics.md names them.
MISSED = {
    ("angular momentum at 1e-03, contact", 1e-2),
    ("reversed film, thrown [rad]", 1e-3),
    ("reversed film, magnetic [rad]", 1e-3),
    ("reversed film, magnetic [rad]", 1e-6),
    ("reversed film, magnetic [rad]", 1e-9),
}


@pytest.mark.weekly
def test_no_law_is_broken_but_those_that_are_named():
    seeds = range(40)
    laws = [
        *limits.along_folds(seeds),
        *limits.free_motion(seeds),
        limits.single("creep", 0.0, seeds, creep),
        limits.single("impact law", 1e-8, range(400), impact_error),
    ]
    broken = [law for law in laws if law.broken]
    assert [law for law in broken if (law.name, law.allowed) not in MISSED] == []
    assert max((law.worst / law.allowed for law in broken), default=0.0) < 500.0
