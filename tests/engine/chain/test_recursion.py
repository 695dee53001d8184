"""Tests of chains in vector lanes, and of the fused recursion."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import magfold_env as mf
from magfold_env.engine.chain import recursion
from magfold_env.engine.state import Bodies
from tests.engine import reference
from tests.engine.chain.test_articulated import assert_agree, random_scene, random_state


def random_states(rng, chains, n):
    angles, rates = zip(*(random_state(rng, n) for _ in range(chains)), strict=True)
    return np.array(angles), np.array(rates)


def random_bodies(rng, n):
    """Return bodies that differ in all properties."""
    scales = 10 ** rng.uniform(-0.5, 0.5, (4, n))
    return Bodies(*(scales * np.array([[0.0037], [1e-7], [0.0088], [0.0177]])))


def scalar(bodies, base, heading, rate, force):
    n = heading.size
    out = np.zeros(n)
    scratch = np.zeros((recursion.ROWS, n))
    recursion.accelerate(bodies, base[0], base[1], heading, rate, force, scratch, out)
    return out


@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 40))
def test_the_scalar_kernel_and_the_lanes_agree(seed, n):
    rng = np.random.default_rng(seed)
    bodies, base = random_bodies(rng, n), tuple(rng.normal(0.0, 10.0, 2))
    angles, rates = random_states(rng, 3, n)
    force = rng.normal(0.0, 1e-4, (3, n))
    found = recursion.accelerate_many(bodies, base, angles, rates, force)
    for k in range(3):
        expected = scalar(bodies, base, angles[k], rates[k], force[k])
        assert_agree(found[k], expected, rates)


@pytest.mark.parametrize("inertia", [1e-10, 1e-16, 0.0])
def test_accuracy_does_not_fade_with_the_inertia(inertia):
    """M α = Q holds to rounding, even for point masses on rods."""
    rng = np.random.default_rng(3)
    n = 20
    bodies = Bodies(*(np.full(n, x) for x in (0.0037, inertia, 0.0088, 0.0176)))
    angles, rates = random_state(rng, n)
    found = recursion.accelerate_many(bodies, (0.0, 9.81), angles[None], rates[None])[0]
    q, v = np.append(angles, [0.0, 0.0]), np.append(rates, [0.0, 0.0])
    side = 0.0176 / np.sqrt(2)
    jacobian = reference.velocity_map(q, side)[:, :, :n]
    pull = -reference.velocity_accelerations(q, v, side) - [0.0, 9.81]
    force = np.einsum("idk,id->k", jacobian, 0.0037 * pull)
    mass = reference.mass_matrix(q, side, bodies.mass, bodies.inertia)[:n, :n]
    residual = mass @ found - force
    assert np.abs(residual).max() < 1e-13 * (np.abs(mass) @ np.abs(found)).max()


def test_a_chain_gives_the_same_bits_alone_and_in_any_batch():
    rng = np.random.default_rng(8)
    scene = random_scene(rng, 7, magnets=True, gravity=(0.5, -1.0))
    angles, rates = random_states(rng, 75, 7)
    together = mf.accelerations(scene, angles, rates)
    order = rng.permutation(75)
    shuffled = mf.accelerations(scene, angles[order], rates[order])
    assert shuffled.tobytes() == together[order].tobytes()
    for k in (0, 31, 32, 74):
        assert mf.accelerations(scene, angles[k], rates[k]).tobytes() == together[k].tobytes()
    stacked = mf.accelerations(scene, angles.reshape(3, 25, 7), rates.reshape(3, 25, 7))
    assert stacked.shape == (3, 25, 7)
    assert stacked.tobytes() == together.tobytes()
