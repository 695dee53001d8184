"""Magnets that differ from face to face, and faces without any, against the exact reference."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from magfold_bench.laws import exact_magnets as exact
from magfold_bench.magnets.samples import folded, random_pair, unfolded
from magfold_env.scene import Scene
from magfold_env.shapes import centres
from magfold_env.simulation.pack import pack
from tests.engine import reference
from tests.engine.magnets.test_chain import Chain, open_joints
from tests.engine.magnets.test_pairs import Casings, gradient, scatter

SIDE = 0.0125
BOUNDS = [5e-2, 1e-2, 1e-3, 1e-4]
SHAPES = {
    "sizes": {
        "width": (0.006, 0.004, 0.005, 0.003),
        "height": (0.006, 0.003, 0.008, 0.004),
        "thickness": (0.0025, 0.002, 0.003, 0.0015),
        "inset": (0.0005, 0.0008, 0.0003, 0.001),
    },
    "heights": {"height": (0.003, 0.006, 0.009, 0.012)},
    "strengths": {"remanence": (0.3, 0.6, 1.2, 0.9)},
}
seeds = st.integers(0, 2**32 - 1)


def scene_of(rng, n, shape, bound=1e-3):
    sequence = tuple("".join(rng.choice(list("NS-"), 4, p=[0.4, 0.4, 0.2])) for _ in range(n))
    if all(faces == "----" for faces in sequence):
        sequence = ("N---", *sequence[1:])
    return Scene(sequence=sequence).replace(magnets={"accuracy": bound, **SHAPES[shape]})


def error(scene, found, wanted):
    force = np.hypot(*(found[0] - wanted[0]).T).max()
    return max(force, np.abs(found[1] - wanted[1]).max() / SIDE) / exact.flush_force(scene)


@pytest.mark.parametrize("bound", BOUNDS)
@pytest.mark.parametrize("shape", sorted(SHAPES))
@pytest.mark.parametrize("count", [15, pytest.param(100, marks=pytest.mark.slow)])
def test_bound_holds_for_pairs(count, shape, bound):
    rng = np.random.default_rng(61)
    worst = 0.0
    for _ in range(count):
        scene = scene_of(rng, 2, shape, bound)
        pose = random_pair(rng, SIDE)
        worst = max(worst, error(scene, Casings(scene).forces(*pose), exact.forces(scene, *pose)))
    assert worst <= bound


@pytest.mark.parametrize("bound", BOUNDS)
@pytest.mark.parametrize("shape", sorted(SHAPES))
@pytest.mark.parametrize("form", [unfolded, folded])
def test_bound_holds_for_chains(form, shape, bound):
    rng = np.random.default_rng(62)
    scene, headings = scene_of(rng, 30, shape, bound), form(30)
    places = centres(headings, SIDE)
    found = Casings(scene).forces(places, headings)
    assert error(scene, found, exact.forces(scene, places, headings)) <= bound


@pytest.mark.laws
@pytest.mark.parametrize("shape", sorted(SHAPES))
def test_force_and_torque_are_the_energys_gradient(shape):
    rng = np.random.default_rng(63)
    checked = 0
    while checked < 12:
        casings = Casings(scene_of(rng, 3, shape))
        places, headings = scatter(rng, 3, 0.001)
        expected = gradient(casings, places, headings)
        if expected is None:
            continue
        force, torque = casings.forces(places, headings)
        size = max(np.abs(force).max(), 1e-3)
        np.testing.assert_allclose(force, expected[0], rtol=0, atol=1e-8 * size)
        np.testing.assert_allclose(torque, expected[1], rtol=0, atol=1e-8 * size * SIDE)
        checked += 1


@pytest.mark.parametrize("shape", sorted(SHAPES))
def test_looked_up_torques_are_those_of_the_sums(shape):
    rng = np.random.default_rng(64)
    for _ in range(5):
        scene = scene_of(rng, 5, shape).replace(mount="pinned", friction=0.0)
        assert pack(scene).magnets.tables.end > 0.0
        joints = open_joints(rng, 5)
        headings = np.cumsum(joints)
        places = reference.centres(np.append(headings, [0.0, 0.0]), SIDE)
        force, torque = exact.forces(scene, places, headings)
        jacobian = reference.velocity_map(np.append(headings, [0.0, 0.0]), SIDE)[:, :, :5]
        wanted = np.einsum("idk,id->k", jacobian, force) + torque
        off = np.cumsum((Chain(scene).forces(joints)[:5] - wanted)[::-1])
        assert np.abs(off).max() <= 3e-3 * SIDE * exact.flush_force(scene)


@given(seed=seeds)
def test_an_empty_face_is_a_face_of_no_strength(seed):
    rng = np.random.default_rng(seed)
    scene = scene_of(rng, 3, "sizes")
    weak = 1e-30
    strength = np.where(scene.charges != 0.0, 0.6, weak)
    letters = tuple(faces.replace("-", "N") for faces in scene.sequence)
    same = scene.replace(sequence=letters, magnets={"remanence": strength.tolist()})
    pose = scatter(rng, 3, 0.001)
    force, torque = Casings(scene).forces(*pose)
    other, turning = Casings(same).forces(*pose)
    size = max(np.abs(other).max(), 1e-9)
    np.testing.assert_allclose(force, other, rtol=0, atol=1e-12 * size)
    np.testing.assert_allclose(torque, turning, rtol=0, atol=1e-12 * size * SIDE)


def test_four_equal_lengths_are_one_length():
    rng = np.random.default_rng(65)
    sequence = tuple("".join(rng.choice(["N", "S"], 4)) for _ in range(3))
    four = {"width": 4 * (0.006,), "height": 4 * (0.006,), "inset": 4 * (0.0005,)}
    pose = scatter(rng, 3, 0.001)
    one, other = (
        Casings(Scene(sequence=sequence).replace(magnets=given)).forces(*pose)
        for given in ({}, four)
    )
    np.testing.assert_array_equal(one[0], other[0])
    np.testing.assert_array_equal(one[1], other[1])
