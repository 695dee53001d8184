"""Tests of the chain that the benchmark of whole folds builds in pymunk."""

import math

import numpy as np
import pytest

from magfold_bench import fold_peers
from magfold_bench.folds import scene_of
from magfold_bench.laws.exact_magnets import cross
from magfold_bench.magnets import samples
from magfold_env.scene import Magnets, Scene
from magfold_env.shapes import angles_to_word, centres

POINTS = Magnets(model="points")


def state_of(world):
    masses = np.array([body.mass for body in world.bodies])
    places = np.array([body.position for body in world.bodies])
    speeds = np.array([body.velocity for body in world.bodies])
    spins = np.array([body.angular_velocity for body in world.bodies])
    inertias = np.array([body.moment for body in world.bodies])
    turning = inertias @ spins + masses @ cross(places, speeds)
    energy = 0.5 * (masses @ (speeds**2).sum(axis=1) + inertias @ spins**2)
    return masses @ speeds, turning, energy


def test_point_charges_act_as_the_engines_do():
    rng = np.random.default_rng(0)
    scene = samples.random_scene(rng, 6)
    angles = 0.3 + samples.random_shape(rng, 6, scene.casing.side)
    places = centres(angles, scene.casing.side)
    expected = samples.Sums(samples.sample_of([scene], [(places, angles)]), POINTS).loads()
    found = fold_peers.point_charges(scene.replace(magnets=POINTS))(np.c_[places, angles])
    for column, part in zip(found.T, expected, strict=True):
        np.testing.assert_allclose(column, part[0], rtol=1e-9, atol=1e-14)


def test_two_squares_on_a_hinge_keep_momentum_and_energy():
    pytest.importorskip("pymunk")
    scene = Scene(sequence=("NNNN", "NNNN"), magnets=None, friction=0.0, start_angles=(0.2,))
    world = fold_peers.World(scene, 1e-5)
    # Both turn about the hinge between them, which stays where it is.
    half = 0.5 * scene.casing.diagonal
    for body, spin, arm in zip(world.bodies, (-20.0, 20.0), (-half, half), strict=True):
        body.angular_velocity = spin
        body.velocity = spin * arm * -math.sin(body.angle), spin * arm * math.cos(body.angle)
    momentum, turning, energy = state_of(world)
    for _ in range(2000):
        world.advance()
    assert 0.8 < world.joint_angles[0] < 1.5
    after = state_of(world)
    np.testing.assert_allclose(after[0], momentum, atol=1e-9)
    assert after[1] == pytest.approx(turning, abs=1e-9)
    assert after[2] == pytest.approx(energy, rel=1e-3)


def test_friction_stops_a_square_after_the_right_time():
    pytest.importorskip("pymunk")
    scene = Scene(sequence=("NNNN",), magnets=None, friction=0.35, start_angles=())
    world = fold_peers.World(scene, 1e-4)
    body = world.bodies[0]
    body.velocity = 0.35 * scene.gravity.normal * 0.1, 0.0
    for _ in range(500):
        world.advance()
    assert np.hypot(*body.velocity) == pytest.approx(0.35 * scene.gravity.normal * 0.05, rel=1e-3)
    for _ in range(600):
        world.advance()
    assert np.hypot(*body.velocity) < 1e-9


@pytest.mark.medium
@pytest.mark.parametrize("kind", ["free, no friction", "free, friction 0.35"])
def test_small_steps_lead_to_the_engines_word(kind):
    pytest.importorskip("pymunk")
    scene = scene_of(kind, 0).replace(magnets=POINTS)
    world = fold_peers.World(scene, 1e-4)
    np.testing.assert_allclose(world.joint_angles, np.array(scene.start_angles))
    world.fold()
    assert angles_to_word(world.joint_angles) == fold_peers.sure_word(scene)
    np.testing.assert_allclose(np.abs(world.joint_angles), math.pi / 2, atol=0.05)
