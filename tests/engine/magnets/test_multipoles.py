"""Tests of expansions of far casings: their moments, order and gradient."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from magfold_bench.laws.exact_magnets import COULOMB
from magfold_env.engine.magnets import multipoles
from magfold_env.engine.workspace import new_nodes
from tests.engine import reference

SIZE = 0.006
seeds = st.integers(0, 2**32 - 1)


class Cloud:
    """Random lines of charge of equal height within a casing, without net charge."""

    def __init__(self, rng, count=7, height=0.006):
        self.z = SIZE * (rng.uniform(-1, 1, count) + 1j * rng.uniform(-1, 1, count)) / np.sqrt(2)
        self.charge = rng.normal(size=count)
        self.charge -= self.charge.mean()
        self.height = height

    def moments(self):
        out = np.zeros((2, multipoles.MOST))
        powers = np.zeros((4, multipoles.HIGHEST + 1, self.z.size))
        x, y = self.z.real.copy(), self.z.imag.copy()
        multipoles.moments(x, y, self.charge, self.height, powers, out)
        return out


def exact_energy(a, b, offset, turn=0.0):
    """Return the energy of a, turned and at an `offset` from b, by the law between equal lines."""
    r = np.abs(offset + a.z[:, None] * np.exp(1j * turn) - b.z[None, :])
    h = a.height
    law = 2 / h**2 * (h * np.arcsinh(h / r) - np.sqrt(r**2 + h**2) + r)
    return COULOMB * a.charge @ law @ b.charge


def expand(order, a, b, offset, turn=0.0):
    """Return the energy, and the force and torque on a."""
    rows = new_nodes(None, 2).segments
    rows.body[:] = a.moments(), b.moments()
    multipoles.turn_moments(order, 0, np.cos(turn), np.sin(turn), rows)
    multipoles.turn_moments(order, 1, 1.0, 0.0, rows)
    return multipoles.expansion(order, rows.moment, 0, 1, offset.real, offset.imag, rows.scratch)


@pytest.mark.parametrize("order", [1, 2, 3, 4, 5])
def test_errors_fall_with_the_order_of_the_expansion(order):
    rng = np.random.default_rng(1)
    ratios = []
    for _ in range(40):
        a, b = Cloud(rng), Cloud(rng)
        direction = np.exp(1j * rng.uniform(-np.pi, np.pi))
        errors = []
        for distance in (20 * SIZE, 40 * SIZE):
            error = exact_energy(a, b, distance * direction)
            error -= expand(order, a, b, distance * direction)[0]
            errors.append(abs(error))
        ratios.append(errors[0] / errors[1])
    # The first term left out is that of a dipole and a multipole one order higher.
    assert np.median(ratios) == pytest.approx(2 ** (order + 3), rel=0.15)


@given(seed=seeds, order=st.integers(1, multipoles.HIGHEST))
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


def test_moments_of_height_are_those_of_charge_spread_over_it():
    # Out of the plane the potential's second derivative is minus that in it: four times ∂ ∂̄.
    rng = np.random.default_rng(7)
    tall = Cloud(rng, height=0.012)
    flat = Cloud(rng, height=1e-9)
    offset = 12 * SIZE * np.exp(0.4j)
    levels, shares = np.polynomial.legendre.leggauss(12)
    expected = 0.0
    for level, share in zip(0.5 * tall.height * levels, 0.5 * shares, strict=True):
        r = np.abs(offset + tall.z[:, None] - flat.z[None, :])
        expected += share * COULOMB * tall.charge @ (1.0 / np.hypot(r, level)) @ flat.charge
    found = expand(multipoles.HIGHEST, tall, flat, offset)[0]
    assert found == pytest.approx(expected, rel=1e-6)
