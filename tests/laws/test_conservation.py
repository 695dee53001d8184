"""A chain that nothing pushes keeps its momentum and its energy."""

import numpy as np
import pytest

from magfold_bench.laws.along_folds import SteppedSession
from magfold_bench.laws.mechanics import kinetic_energy, momenta
from magfold_env.scene import Casing, Scene, Solver
from magfold_env.shapes import centres

pytestmark = pytest.mark.laws


def thrown(scene, seed, rate):
    """A session whose chain begins with random rates and a drift."""
    rng = np.random.default_rng(seed)
    session = SteppedSession(scene.draw(rng), stride=10**9)
    session.throw(rng.uniform(-rate, rate, scene.n), rng.uniform(-0.3, 0.3, 2))
    return session


def momentum_of(session):
    return momenta(
        session.scene, session.angles, session.rates, session.base, session.base_velocity
    )


def own_momentum(session):
    """Linear momentum, and angular momentum about the centre of mass."""
    linear, angular = momentum_of(session)
    masses = session.scene.masses
    places = centres(session.angles[None], session.scene.casing.side, session.base[None])[0]
    x, y = masses @ places / masses.sum()
    return linear, angular - (x * linear[1] - y * linear[0])


@pytest.mark.parametrize("seed", range(3))
def test_a_thrown_chain_keeps_momentum_and_energy(seed):
    rng = np.random.default_rng(100 + seed)
    masses, inertias = rng.uniform(0.001, 0.01, 6), rng.uniform(2e-8, 2e-7, 6)
    scene = Scene(
        sequence=("NSNS",) * 6,
        casing=Casing(mass=tuple(masses.tolist()), inertia=tuple(inertias.tolist())),
        magnets=None,
        friction=0.0,
        contact=False,
        duration=0.5,
        solver=Solver(tolerance=1e-9),
    )
    session = thrown(scene, seed, 30.0)
    linear, angular = momentum_of(session)
    before = kinetic_energy(scene, session.angles, session.rates, session.base_velocity)
    session.settle()
    assert session.time == pytest.approx(0.5)
    after = kinetic_energy(scene, session.angles, session.rates, session.base_velocity)
    assert after == pytest.approx(before, rel=1e-7)
    linear_after, angular_after = momentum_of(session)
    size = scene.masses.sum() * 1.0  # a metre a second
    assert linear_after == pytest.approx(linear, abs=1e-8 * size)
    assert angular_after == pytest.approx(angular, abs=1e-8 * size * 0.1)


@pytest.mark.parametrize("contact", [False, True])
def test_momentum_is_kept_to_rounding_at_any_tolerance(contact):
    scene = Scene(
        sequence=("NSNS", "SNNS", "NNSS", "SSNS"),
        friction=0.0,
        contact=contact,
        duration=0.05,
        solver=Solver(tolerance=1e-2),
    )
    session = thrown(scene, 5, 30.0)
    linear, spin = own_momentum(session)
    session.settle()
    linear_after, spin_after = own_momentum(session)
    length = scene.n * scene.casing.diagonal
    size = scene.masses.sum() * 30.0 * length
    np.testing.assert_allclose(linear_after, linear, atol=1e-11 * size)
    assert spin_after == pytest.approx(spin, abs=1e-11 * size * length)


@pytest.mark.parametrize("heavy", [0, -1])
def test_a_component_a_million_times_heavier_is_not_carried_away(heavy):
    masses = np.full(4, 1e-6)
    masses[heavy] = 1.0
    scene = Scene(
        sequence=("NSNS", "SNNS", "NNSS", "SSNS"),
        casing=Casing(mass=tuple(masses.tolist())),
        magnets=None,
        friction=0.0,
        contact=False,
        duration=0.5,
    )
    session = thrown(scene, 6, 30.0)
    session.throw(session.rates)
    before = kinetic_energy(scene, session.angles, session.rates, session.base_velocity)
    session.settle()
    after = kinetic_energy(scene, session.angles, session.rates, session.base_velocity)
    assert after == pytest.approx(before, rel=1e-2)
