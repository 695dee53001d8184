"""Expansions of far magnets: their order, their gradient, and shifts to other centres."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from magfold_env.engine import multipoles
from magfold_env.engine.magnet_laws import COULOMB
from tests.engine import reference

SIZE = 0.006
seeds = st.integers(0, 2**32 - 1)


class Cloud:
    """Lines of charge of one height, without net charge, anywhere within a casing's size."""

    def __init__(self, rng, count=7, height=0.006):
        self.z = SIZE * (rng.uniform(-1, 1, count) + 1j * rng.uniform(-1, 1, count)) / np.sqrt(2)
        self.charge = rng.normal(size=count)
        self.charge -= self.charge.mean()
        self.height = height

    def moments(self, turn=0.0, about=0j):
        return multipoles.moments(self.z * np.exp(1j * turn) - about, self.charge, self.height)


def exact_energy(a, b, offset, turn=0.0):
    """Energy of a, its centre `offset` from b's and turned, by the law between equal lines."""
    r = np.abs(offset + a.z[:, None] * np.exp(1j * turn) - b.z[None, :])
    h = a.height
    law = 2 / h**2 * (h * np.arcsinh(h / r) - np.sqrt(r**2 + h**2) + r)
    return COULOMB * a.charge @ law @ b.charge


def expand(order, a, b, offset, turn=0.0):
    """Energy, force on a and its torque."""
    rows = np.array([a.moments(turn), b.moments()])
    terms = multipoles.COUNTS[order]
    scratch = np.zeros((4, multipoles.PAIR_PARTS))
    return multipoles.expansion(terms, rows, 0, 1, offset.real, offset.imag, scratch)


@pytest.mark.parametrize("order", [1, 2, 3])
def test_errors_fall_with_the_order_of_the_expansion(order):
    rng = np.random.default_rng(1)
    ratios = []
    for _ in range(40):
        a, b = Cloud(rng), Cloud(rng)
        direction = np.exp(1j * rng.uniform(-np.pi, np.pi))
        errors = []
        for distance in (40 * SIZE, 80 * SIZE):
            error = exact_energy(a, b, distance * direction)
            error -= expand(order, a, b, distance * direction)[0]
            errors.append(abs(error))
        ratios.append(errors[0] / errors[1])
    # The first term left out is that of a dipole and a multipole one order higher.
    assert np.median(ratios) == pytest.approx(2 ** (order + 3), rel=0.1)


@given(seed=seeds, order=st.integers(1, 3))
def test_force_and_torque_are_the_energys_gradient(seed, order):
    rng = np.random.default_rng(seed)
    a, b = Cloud(rng), Cloud(rng)
    offset = 5 * SIZE * np.exp(1j * rng.uniform(-np.pi, np.pi))
    _, fx, fy, torque = expand(order, a, b, offset)
    step = 1e-3 * SIZE
    slopes = [
        -reference.derivative(lambda t, d=d: expand(order, a, b, offset + t * d)[0], step)
        for d in (1.0, 1.0j)
    ]
    size = np.hypot(fx, fy)
    np.testing.assert_allclose([fx, fy], slopes, rtol=0, atol=1e-8 * size)
    twist = -reference.derivative(lambda t: expand(order, a, b, offset, t)[0], 1e-3)
    assert torque == pytest.approx(twist, abs=1e-8 * size * 5 * SIZE)


@given(seed=seeds)
def test_moments_shift_to_what_they_are_about_another_centre(seed):
    rng = np.random.default_rng(seed)
    cloud = Cloud(rng)
    away = 3 * SIZE * (rng.normal() + 1j * rng.normal())
    rows = np.array([cloud.moments(), np.zeros(multipoles.PARTS)])
    multipoles.add_shifted_moments(rows, 0, 1, away.real, away.imag)
    expected = cloud.moments(about=-away)
    np.testing.assert_allclose(rows[1], expected, rtol=0, atol=1e-13 * np.abs(expected).max())


@given(seed=seeds)
def test_turned_moments_are_those_of_what_is_turned(seed):
    rng = np.random.default_rng(seed)
    cloud, turn = Cloud(rng), rng.uniform(-np.pi, np.pi)
    out = np.zeros((1, multipoles.PARTS))
    multipoles.turn_row(cloud.moments()[None], 0, np.cos(turn), np.sin(turn), out)
    expected = cloud.moments(turn)
    np.testing.assert_allclose(out[0], expected, rtol=0, atol=1e-13 * np.abs(expected).max())


def product(moment, local):
    """Energy of moments in a potential with given derivatives: conjugate terms count twice."""
    real = [multipoles.X10, multipoles.X20, multipoles.X21, multipoles.X30]
    total = moment[multipoles.X11] * local[multipoles.X11]
    for k in real:
        total += 2 * (moment[k] * local[k] - moment[k + 1] * local[k + 1])
    return total


@given(seed=seeds)
def test_derivatives_shift_so_that_the_energy_stays(seed):
    rng = np.random.default_rng(seed)
    scale = SIZE ** np.array([1, 1, 2, 2, 2, 3, 3, 3, 3])
    moment = np.array([rng.normal(size=multipoles.PARTS) * scale, np.zeros(multipoles.PARTS)])
    local = np.array([rng.normal(size=multipoles.PARTS) / scale, np.zeros(multipoles.PARTS)])
    dx, dy = SIZE * rng.normal(size=2)
    multipoles.add_shifted_moments(moment, 0, 1, dx, dy)
    multipoles.add_shifted_derivatives(local, 0, 1, dx, dy)
    # Moments of a part act in the whole's derivatives as the shifted ones do.
    ours, theirs = product(moment[1], local[0]), product(moment[0], local[1])
    assert ours == pytest.approx(theirs, rel=1e-11, abs=1e-11)


@given(seed=seeds)
def test_derivatives_give_the_energy_the_force_and_the_torque_of_a_pair(seed):
    rng = np.random.default_rng(seed)
    a, b = Cloud(rng), Cloud(rng)
    offset = 20 * SIZE * np.exp(1j * rng.uniform(-np.pi, np.pi))
    rows = np.array([a.moments(), b.moments()])
    scratch, local, push = np.zeros((4, multipoles.PAIR_PARTS)), *np.zeros((2, 2, multipoles.PARTS))
    x, y = np.array([offset.real, 0.0]), np.array([offset.imag, 0.0])
    energy, fx, fy, torque = multipoles.expansion(5, rows, 0, 1, x[0], y[0], scratch)
    found = multipoles.expand(5, rows, x, y, 0, 1, 1.0, local, push, scratch)
    assert found == energy
    np.testing.assert_array_equal(push[:, :2], [[fx, fy], [-fx, -fy]])
    for k in range(2):
        assert product(rows[k], local[k]) == pytest.approx(energy, rel=1e-11)
    assert multipoles.torque_of(rows, local, 0) == pytest.approx(torque, rel=1e-10, abs=1e-18)
    # Derivatives up to octupoles leave out the force on the highest moments.
    force = multipoles.force_of(rows, local, 0)
    np.testing.assert_allclose(force, [fx, fy], rtol=0, atol=0.05 * np.hypot(fx, fy))
