"""Chebyshev's steps: their stability and order, the cubic between their ends, what they save."""

import numpy as np
import pytest

import magfold_env as mf
from magfold_env.engine.stepping import chebyshev
from magfold_env.engine.stepping.stages import DENSE, WEIGHT
from magfold_env.scene import Scene

SLIDING = Scene(
    sequence=("NNSS", "SSNN", "NNNS", "NSSS", "NSNS", "NNSS"),
    mount="tube",
    friction=0.35,
    start_angle_spread=0.03,
)


def growth(stages: int, z: np.ndarray) -> np.ndarray:
    """What a step makes of y' = λ y at y = 1, z = h λ."""
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


def test_a_step_is_a_cubic_between_its_ends():
    y, new, first, last, h = 0.3, 0.9, -2.0, 5.0, 0.4
    slopes = np.zeros(7)
    slopes[0], slopes[6] = first, last
    slopes[2:4] = chebyshev.CUBIC @ ((new - y) / h, first, last)
    assert y + h * WEIGHT[6] @ slopes[:6] == pytest.approx(new)
    powers = np.append(y, h * slopes @ DENSE)
    assert powers[4] == pytest.approx(0.0, abs=1e-13)
    assert np.polynomial.polynomial.polyval(1.0, powers) == pytest.approx(new)
    slope = np.polynomial.polynomial.polyder(powers)
    assert slope[0] == pytest.approx(h * first)
    assert np.polynomial.polynomial.polyval(1.0, slope) == pytest.approx(h * last)


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
