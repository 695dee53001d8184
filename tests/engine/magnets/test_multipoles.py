"""Expansions of segments: moments that turn, shifts to other centres, what derivatives give."""

import numpy as np
import pytest
from hypothesis import given

from magfold_env.engine.magnets import expansions, multipoles
from magfold_env.engine.workspace import new_segments
from tests.engine.magnets.test_expansions import SIZE, Cloud, seeds


def moments(cloud, turn=0.0, about=0j):
    return multipoles.moments(cloud.z * np.exp(1j * turn) - about, cloud.charge, cloud.height)


@given(seed=seeds)
def test_moments_shift_to_what_they_are_about_another_centre(seed):
    rng = np.random.default_rng(seed)
    cloud = Cloud(rng)
    away = 3 * SIZE * (rng.normal() + 1j * rng.normal())
    rows = np.array([moments(cloud), np.zeros(multipoles.PARTS)])
    multipoles.add_shifted_moments(rows, 0, 1, away.real, away.imag)
    expected = moments(cloud, about=-away)
    np.testing.assert_allclose(rows[1], expected, rtol=0, atol=1e-13 * np.abs(expected).max())


@given(seed=seeds)
def test_turned_moments_are_those_of_what_is_turned(seed):
    rng = np.random.default_rng(seed)
    cloud, turn = Cloud(rng), rng.uniform(-np.pi, np.pi)
    out = np.zeros((1, multipoles.PARTS))
    multipoles.turn_row(moments(cloud)[None], 0, np.cos(turn), np.sin(turn), out)
    expected = moments(cloud, turn)
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
    rows = np.array([moments(a), moments(b)])
    pieces = new_segments(2)
    local = pieces.local
    pieces.moment[:], pieces.x[0], pieces.y[0] = rows, offset.real, offset.imag
    way = multipoles.direction(offset.real, offset.imag)
    energy, fx, fy, torque = multipoles.act_on_each_other(5, rows, 0, 1, *way, pieces.turned)
    assert multipoles.expand(5, pieces, 0, 1, 1.0) == energy
    np.testing.assert_array_equal(pieces.push, [[fx, fy], [-fx, -fy]])
    # Pairs of casings take the same terms, but leave out products of too high an order.
    wide, room = np.array([a.moments(), b.moments()]), np.zeros(expansions.SCRATCH)
    pair = expansions.expansion(3, wide, 0, 1, offset.real, offset.imag, room)
    assert energy == pytest.approx(pair[0], abs=2e-2 * np.hypot(fx, fy) * SIZE)
    for k in range(2):
        assert product(rows[k], local[k]) == pytest.approx(energy, rel=1e-11)
    assert multipoles.torque_of(rows, local, 0) == pytest.approx(torque, rel=1e-10, abs=1e-18)
    # Derivatives up to octupoles leave out the force on the highest moments.
    force = multipoles.force_of(rows, local, 0)
    np.testing.assert_allclose(force, [fx, fy], rtol=0, atol=0.05 * np.hypot(fx, fy))
