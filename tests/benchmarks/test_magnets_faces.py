"""The exact reference with unequal faces, empty ones and an external field."""

import numpy as np
import pytest

from magfold_env.benchmarks.dynamics import dense
from magfold_env.benchmarks.magnets import poses, reference
from magfold_env.benchmarks.magnets.casings import sample_of
from magfold_env.benchmarks.magnets.magpylib_peer import Peer
from magfold_env.scene import Scene
from magfold_env.scene_parts import MU0, Field, FixedMagnet, Magnets
from magfold_env.shapes import centres
from tests.engine import reference as engine_reference

SIDE = 0.0125
FIXED = FixedMagnet(
    position=(0.03, -0.05), heading=0.7, width=0.02, height=0.03, thickness=0.01, remanence=1.3
)


def unequal(seed):
    """Two components of random magnets, some faces empty, and where they are."""
    rng = np.random.default_rng(seed)
    magnets = {
        "remanence": rng.uniform(0.2, 1.4, (2, 4)),
        "width": rng.uniform(0.003, 0.006, 4),
        "height": rng.uniform(0.003, 0.008, 4),
        "thickness": rng.uniform(0.001, 0.002, 4),
        "inset": rng.uniform(0.0004, 0.001, 4),
    }
    sequence = tuple("".join(row) for row in rng.choice([*"NNSS-"], (2, 4)))
    return Scene(sequence=sequence).replace(magnets=magnets), poses.random_pair(rng, SIDE)


@pytest.mark.parametrize("seed", range(12))
def test_more_nodes_do_not_change_the_reference(seed, monkeypatch):
    scene, pose = unequal(seed)
    before = reference.forces(scene, *pose)
    finer = tuple((start, 2 * m, 2 * k) for start, m, k in reference.RULES)
    monkeypatch.setattr(reference, "RULES", finer)
    after = reference.forces(scene, *pose)
    unit = reference.flush_force(scene)
    np.testing.assert_allclose(before[0], after[0], rtol=0, atol=1e-9 * unit)
    np.testing.assert_allclose(before[1], after[1], rtol=0, atol=1e-9 * unit * SIDE)


@pytest.mark.parametrize("seed", range(6))
def test_the_reference_is_what_many_strips_converge_to(seed):
    scene, pose = unequal(seed)
    force, torque = reference.forces(scene, *pose)
    summed, turning, _ = engine_reference.magnet_forces(*pose, scene, 60)
    unit = reference.flush_force(scene)
    np.testing.assert_allclose(force, summed, rtol=0, atol=1e-8 * unit)
    np.testing.assert_allclose(torque, turning, rtol=0, atol=1e-8 * unit * SIDE)


def test_two_unequal_faces_meet_a_sum_over_point_charges():
    """Both rectangles as Gauss nodes in both directions: Coulomb's law and nothing else."""
    size, source = np.array([[0.004, 0.007]]), np.array([[0.006, 0.003]])
    offset, turn = np.array([[0.001, 0.003]]), np.array([0.4])
    pull, moment = reference.rectangle_pull(offset, turn, size, source, 40, 20)

    def charges(size, centre, angle):
        node, weight = np.polynomial.legendre.leggauss(40)
        s, z = np.meshgrid(node * size[0] / 2, node * size[1] / 2, indexing="ij")
        places = np.stack([centre[0] + np.cos(angle) * s, centre[1] + np.sin(angle) * s, z], -1)
        return places.reshape(-1, 3), np.outer(weight, weight).ravel() / 4

    here, q = charges(size[0], offset[0], turn[0])
    there, p = charges(source[0], np.zeros(2), 0.0)
    apart = here[:, None] - there
    forces = np.einsum("k,l,kld->kd", q, p, apart / np.linalg.norm(apart, axis=2)[..., None] ** 3)
    arm = here - np.append(offset[0], 0.0)
    np.testing.assert_allclose(pull[0], forces.sum(axis=0)[:2], rtol=1e-9)
    assert moment[0] == pytest.approx(np.cross(arm, forces).sum(axis=0)[2], rel=1e-9)


@pytest.mark.parametrize("seed", range(2))
def test_the_dense_equations_sum_over_the_same_unequal_strips(seed):
    scene, _ = unequal(seed)
    scene = scene.replace(magnets={"nodes": 5})
    angles = np.array([0.2, -0.3])
    found = dense.magnet_forces(scene, angles)
    expected = engine_reference.magnet_forces(centres(angles, SIDE), angles, scene, 5)
    for mine, theirs in zip(found, expected, strict=False):
        np.testing.assert_allclose(mine, theirs, rtol=0, atol=1e-12 * np.abs(theirs).max())


def test_the_flush_force_is_the_strongest_faces():
    def flush(**changes):
        return reference.flush_force(Scene(sequence=("NNNN", "SSSS"), magnets=Magnets(**changes)))

    unit = flush()
    assert flush(remanence=(0.6, 0.6, 1.2, 0.6)) == pytest.approx(4 * unit)
    rows = ((0.6, 0.6, 0.6, 0.6), (0.6, 1.8, 0.6, 0.6))
    assert flush(remanence=rows) == pytest.approx(9 * unit)
    deep = {"inset": (0.0005, 0.001, 0.001, 0.001), "thickness": 0.002}
    assert flush(**deep) == pytest.approx(unit)
    assert flush(inset=0.001, thickness=0.002) < 0.9 * unit
    scene, _ = unequal(4)
    assert reference.flush_force(scene) == pytest.approx(engine_reference.flush_force(scene))


def test_empty_faces_are_not_there():
    scene, pose = unequal(3)
    none = scene.replace(sequence=("----", "NSNS"))
    force, torque = reference.forces(none, *pose)
    assert not force.any()
    assert not torque.any()
    # Letter by letter: forces are bilinear in the charges of two components.
    whole = reference.forces(scene.replace(sequence=("NS--", "SSNS")), *pose)
    parts = [
        reference.forces(scene.replace(sequence=(faces, "SSNS")), *pose)
        for faces in ("N---", "-S--")
    ]
    for k in range(2):
        np.testing.assert_allclose(whole[k], parts[0][k] + parts[1][k], rtol=1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_magpylib_converges_to_the_reference(seed):
    pytest.importorskip("magpylib")
    scene, pose = unequal(seed)
    sample = sample_of([scene], [pose])
    peer = Peer(scene, *pose)
    coarse, fine = (sample.errors(peer.loads(mesh))[0] for mesh in ((2, 4, 4), (6, 12, 12)))
    # Cells are a third as wide: of second order the error is a ninth.
    assert fine < 0.16 * coarse
    assert fine < 5e-3


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
    for point, z in zip(
        rng.uniform(-0.02, 0.02, (5, 2)), rng.uniform(-0.003, 0.003, 5), strict=True
    ):
        expected = cuboid.getB((*point, z))[:2]
        found = density(point, z, reference.faces_of_fixed(FIXED))
        np.testing.assert_allclose(found, expected, rtol=1e-6)


# --- external fields --------------------------------------------------------------------------


def in_field(seed, **field):
    scene, pose = unequal(seed)
    return scene.replace(field=Field(**field)), pose


def test_no_field_no_force():
    scene, pose = unequal(0)
    for changed in (scene, scene.replace(field={})):
        force, torque = reference.field_forces(changed, *pose)
        assert not force.any()
        assert not torque.any()


@pytest.mark.parametrize("seed", range(4))
def test_an_even_field_turns_the_moments_of_the_magnets(seed):
    field = np.array([0.02, -0.05])
    scene, (places, headings) = in_field(seed, uniform=tuple(field))
    force, torque = reference.field_forces(scene, places, headings)
    assert not force.any()
    assert scene.magnets is not None
    moment = scene.charges * scene.magnets.by_face("thickness")  # outwards
    angle = headings[:, None] + reference.FACE_NORMALS
    x, y = (moment * np.cos(angle)).sum(axis=1), (moment * np.sin(angle)).sum(axis=1)
    np.testing.assert_allclose(torque, x * field[1] - y * field[0], rtol=1e-10)


@pytest.mark.parametrize("seed", range(4))
def test_a_fixed_magnet_acts_as_two_more_pole_faces(seed):
    scene, (places, headings) = in_field(seed, magnet=FIXED)
    force, torque = reference.field_forces(scene, places, headings)
    here = reference.faces_of(scene, places, headings)
    there = reference.faces_of_fixed(FIXED)
    expected, turning = np.zeros((2, 2)), np.zeros(2)
    for centre, along, size, charge, casing in zip(
        here.centre, here.along, here.size, here.charge, np.arange(16) // 8, strict=True
    ):
        node, weight = np.polynomial.legendre.leggauss(12)
        for k, s in enumerate(node * size[0] / 2):
            for m, z in enumerate(node * size[1] / 2):
                q = charge * weight[k] * weight[m] / 4
                point = centre + s * along
                pull = q * density(point, z, there)
                expected[casing] += pull
                arm = point - places[casing]
                turning[casing] += arm[0] * pull[1] - arm[1] * pull[0]
    scale = np.abs(expected).max()
    np.testing.assert_allclose(force, expected, rtol=0, atol=1e-9 * scale)
    np.testing.assert_allclose(torque, turning, rtol=0, atol=1e-9 * scale * SIDE)


def density(point, z, faces):
    """Flux density (2,) [T] of the fixed magnet at a point: its faces as sums of charges."""
    node, weight = np.polynomial.legendre.leggauss(24)
    total = np.zeros(2)
    for centre, along, size, charge in zip(
        faces.centre, faces.along, faces.size, faces.charge, strict=True
    ):
        s, height = node * size[0] / 2, node * size[1] / 2
        away = point - centre - s[:, None] * along
        r2 = np.sum(away**2, axis=1)[:, None] + (z - height) ** 2
        share = charge * np.outer(weight, weight) / 4
        total += MU0 / (4 * np.pi) * np.sum((share / r2**1.5)[..., None] * away[:, None], (0, 1))
    return total


def test_a_far_fixed_magnet_is_a_dipole():
    far = FIXED.model_copy(update={"position": (2.0, 0.0), "heading": 0.0})
    scene, (places, headings) = in_field(1, magnet=far)
    moment = FIXED.charge * FIXED.thickness
    even = MU0 / (4 * np.pi) * 2 * moment / 2.0**3  # on its axis
    _, torque = reference.field_forces(scene, places, headings)
    alike = scene.replace(field=Field(uniform=(even, 0.0)))
    _, expected = reference.field_forces(alike, places, headings)
    np.testing.assert_allclose(torque, expected, rtol=0, atol=0.05 * np.abs(expected).max())


def test_the_fixed_magnets_north_pole_lies_ahead():
    """Behind a casing with south poles at its back, it attracts by its north pole."""
    scene = Scene(sequence=("NSSN",))
    pulls = []
    for heading in (0.0, np.pi):
        size = {"width": 0.02, "height": 0.02, "thickness": 0.01}
        magnet = FixedMagnet(position=(-0.06, 0.0), heading=heading, **size)
        behind = scene.replace(field=Field(magnet=magnet))
        force, _ = reference.field_forces(behind, np.zeros((1, 2)), np.zeros(1))
        pulls.append(force[0, 0])
    assert pulls[0] < 0 < pulls[1]
    assert pulls[0] == pytest.approx(-pulls[1])
