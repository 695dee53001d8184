"""Tests of the magnets benchmark's exact reference in an external field."""

import numpy as np
import pytest

from magfold_bench.laws import exact_magnets
from magfold_env.scene import Field, FixedMagnet, Scene
from magfold_env.scene.base import MU0
from tests.benchmarks.magnet_pairs import SIDE, unequal
from tests.reference import touching_faces

FIXED = FixedMagnet(
    position=(0.03, -0.05), heading=0.7, width=0.02, height=0.03, thickness=0.01, remanence=1.3
)


def in_field(seed, **field):
    scene, pose = unequal(seed)
    return scene.replace(field=Field(**field)), pose


def density(points, z, faces):
    """Flux density (m, 2) [T] of the fixed magnet at m points: its faces as sums of charges."""
    node, weight = np.polynomial.legendre.leggauss(24)
    total = np.zeros((len(points), 2))
    for centre, along, size, charge in zip(
        faces.centre, faces.along, faces.size, faces.charge, strict=True
    ):
        s, height = node * size[0] / 2, node * size[1] / 2
        away = points[:, None] - centre - s[:, None] * along
        r2 = np.sum(away**2, axis=2)[:, :, None] + (z[:, None, None] - height) ** 2
        share = charge * np.outer(weight, weight) / 4
        total += MU0 / (4 * np.pi) * np.einsum("msh,msd->md", share / r2**1.5, away)
    return total


@pytest.mark.parametrize("seed", range(3))
def test_magpylib_agrees_about_the_field_of_a_fixed_magnet(seed):
    magpylib = pytest.importorskip("magpylib")
    rng = np.random.default_rng(seed)
    cuboid = magpylib.magnet.Cuboid(
        dimension=(FIXED.thickness, FIXED.width, FIXED.height),
        polarization=(FIXED.remanence, 0.0, 0.0),
        position=(*FIXED.position, 0.0),
    )
    cuboid.rotate_from_angax(np.degrees(FIXED.heading), "z")
    points, z = rng.uniform(-0.02, 0.02, (5, 2)), rng.uniform(-0.003, 0.003, 5)
    expected = cuboid.getB(np.column_stack([points, z]))[:, :2]
    found = density(points, z, touching_faces.faces_of_fixed(FIXED))
    np.testing.assert_allclose(found, expected, rtol=1e-6)


@pytest.mark.parametrize("seed", range(4))
def test_a_fixed_magnet_acts_as_two_more_pole_faces(seed):
    scene, (places, headings) = in_field(seed, magnet=FIXED)
    force, torque = touching_faces.in_field(scene, places, headings)
    here = exact_magnets.faces_of(scene, places, headings)
    there = touching_faces.faces_of_fixed(FIXED)
    expected, turning = np.zeros((2, 2)), np.zeros(2)
    node, weight = np.polynomial.legendre.leggauss(12)
    for centre, along, size, charge, casing in zip(
        here.centre, here.along, here.size, here.charge, np.arange(16) // 8, strict=True
    ):
        s, z = np.meshgrid(node * size[0] / 2, node * size[1] / 2, indexing="ij")
        points = centre + s.ravel()[:, None] * along
        q = charge * np.outer(weight, weight).ravel() / 4
        pull = q[:, None] * density(points, z.ravel(), there)
        expected[casing] += pull.sum(axis=0)
        arm = points - places[casing]
        turning[casing] += np.sum(arm[:, 0] * pull[:, 1] - arm[:, 1] * pull[:, 0])
    scale = np.abs(expected).max()
    np.testing.assert_allclose(force, expected, rtol=0, atol=1e-9 * scale)
    np.testing.assert_allclose(torque, turning, rtol=0, atol=1e-9 * scale * SIDE)


def test_the_fixed_magnets_north_pole_lies_ahead():
    """Behind a casing with south poles at its back, it attracts by its north pole."""
    scene = Scene(sequence=("NSSN",))
    pulls = []
    for heading in (0.0, np.pi):
        size = {"width": 0.02, "height": 0.02, "thickness": 0.01}
        magnet = FixedMagnet(position=(-0.06, 0.0), heading=heading, **size)
        behind = scene.replace(field=Field(magnet=magnet))
        force, _ = touching_faces.in_field(behind, np.zeros((1, 2)), np.zeros(1))
        pulls.append(force[0, 0])
    assert pulls[0] < 0 < pulls[1]
    assert pulls[0] == pytest.approx(-pulls[1])
