"""Tests of the arrays made from scenes, and of their typical rates."""

import math

import numpy as np
import pytest
from hypothesis import strategies as st

import magfold_env as mf
from magfold_env.engine.magnets import multipoles
from magfold_env.scene import Casing, Field, FixedMagnet, Magnets, Rectangle, Scene
from magfold_env.simulation.pack import charges, pack, pack_magnets, reversed_inside
from tests.engine import reference

SCENE = mf.load_scene("paper/sequence-3").replace(mount="free")
faces = st.text("NS", min_size=4, max_size=4)


def faces_of(count):
    """Return the index of each node's charge, with `count` nodes per pole face."""
    return np.repeat(np.tile(np.arange(4), 2), count)


@pytest.mark.parametrize("model", ["points", "strips"])
def test_nodes_lie_where_the_reference_puts_them(model):
    scene = Scene(sequence=("NSSN",), magnets=Magnets(model=model, nodes=4))
    rule = pack_magnets(scene)
    nodes = reference.pole_nodes(np.zeros((1, 2)), np.zeros(1), scene, 4)
    places, strengths, _ = (each[0] for each in nodes)
    mine = np.stack(
        [rule.node_x[0], rule.node_y[0], rule.node_weight[0] * charges(scene)[0][faces_of(4)]]
    )
    theirs = np.stack([*places.T, strengths])
    keys = [np.lexsort(np.round(table * [[1e9], [1e9], [1.0]])) for table in (mine, theirs)]
    np.testing.assert_allclose(mine[:, keys[0]], theirs[:, keys[1]], rtol=1e-12, atol=1e-15)


def test_forward_feed_is_packed_from_its_held_end():
    masses = (0.001, 0.002, 0.003)
    scene = Scene(sequence=("NSSN", "NNSS", "NNNS"), casing=Casing(mass=masses))
    forward = scene.replace(mount="tube", feed={"direction": "forward"})
    backward = scene.replace(mount="tube", feed={"direction": "backward"})
    assert reversed_inside(forward)
    assert not reversed_inside(backward)
    assert not reversed_inside(scene)
    np.testing.assert_array_equal(pack(forward).bodies.mass, masses[::-1])
    np.testing.assert_array_equal(pack(backward).bodies.mass, masses)
    np.testing.assert_array_equal(charges(backward), charges(scene))
    # Half a turn permutes the faces [2, 3, 0, 1].
    expected = scene.replace(sequence=("NSNN", "SSNN", "SNNS")).charges
    np.testing.assert_array_equal(charges(forward), expected)


def test_faces_of_a_turned_casing_keep_their_sizes():
    sizes = {"width": (0.003, 0.004, 0.005, 0.006), "inset": (0.0002, 0.0004, 0.0006, 0.0008)}
    scene = Scene(sequence=("NSSN", "NNNN"), mount="tube").replace(magnets=sizes)
    backward, forward = (
        pack_magnets(scene.replace(feed={"direction": direction}))
        for direction in ("backward", "forward")
    )
    order = np.array([2, 3, 0, 1, 6, 7, 4, 5])
    width, turned = (np.hypot(rule.face_tx, rule.face_ty) for rule in (backward, forward))
    np.testing.assert_allclose(width[order], turned, rtol=1e-14)
    # A face keeps its place on the casing that is seen from its other end.
    np.testing.assert_allclose(forward.face_x, -backward.face_x[order], rtol=1e-14)
    parity = np.array([(-1.0) ** (a + b) for a, b in multipoles.TERMS])
    np.testing.assert_allclose(
        forward.face_moment, parity * backward.face_moment[order[:4]], rtol=1e-7, atol=1e-30
    )


def test_what_a_scene_lacks_is_switched_off():
    scene = Scene(sequence=("NSNS",) * 2, magnets=None, friction=0.0, contact=False)
    model = pack(scene)
    assert (model.magnetic, model.frictional, model.contact, model.tube) == (False,) * 4
    assert not model.charge.any()
    weightless = pack(scene.replace(friction=0.3, gravity={"normal": 0.0}))
    assert not weightless.frictional


def test_grip_and_lengths_follow_the_casing():
    casing = Casing(side=0.02, mass=(0.001, 0.004))
    scene = Scene(sequence=("NSNS",) * 2, casing=casing, friction=(0.25, 0.5), mount="tube")
    model = pack(scene.replace(gravity={"normal": 3.7}))
    # Forward feed: the last component comes first.
    np.testing.assert_allclose(model.friction_limit, 3.7 * np.array([0.5 * 0.004, 0.25 * 0.001]))
    np.testing.assert_allclose(model.bodies.inertia, np.array([0.004, 0.001]) * 0.02**2 / 6)
    np.testing.assert_allclose(model.bodies.length, 0.02 * np.sqrt(2))
    np.testing.assert_allclose(model.bodies.reach, 0.01 * np.sqrt(2))


def test_what_does_not_move_is_one_array():
    magnet = FixedMagnet(position=(0.2, 0.1), heading=0.5, width=0.02, height=0.01, thickness=0.03)
    post = Rectangle(position=(0.1, -0.1), size=(0.002, 0.03), heading=0.3)
    scene = Scene(
        sequence=("NSNS",) * 3, mount="tube", field=Field(magnet=magnet), obstacles=(post,)
    )
    bore, wall, round_ = scene.bore, scene.feed.wall, scene.casing.corner_radius
    assert bore == pytest.approx(1.05 * scene.casing.diagonal)
    length, middle = 6 * scene.casing.diagonal, 0.5 * (bore + wall)
    # A magnet's thickness lies along its heading. The longer side comes first.
    expected = [
        (-length / 2, middle, 1.0, 0.0, length / 2, wall / 2, wall / 4),
        (-length / 2, -middle, 1.0, 0.0, length / 2, wall / 2, wall / 4),
        (0.2, 0.1, np.cos(0.5), np.sin(0.5), 0.015, 0.01, 0.005),
        (0.1, -0.1, -np.sin(0.3), np.cos(0.3), 0.015, 0.001, 0.0005),
    ]
    for row, (*place, along, across, quarter) in zip(pack(scene).obstacles, expected, strict=True):
        radius = min(round_, quarter)
        np.testing.assert_allclose(
            row, [*place, along - radius, across - radius, radius], atol=1e-15
        )


def rate_of(scene, mass=0.0037):
    return pack(scene.replace(casing={"mass": mass})).fastest_rate


def test_rates_are_those_of_pendulums_of_touching_faces_and_of_light_components() -> None:
    scene = SCENE.replace(magnets=None, gravity={"in_plane": (3.0, -4.0)})
    expected = math.sqrt(5.0 / scene.casing.diagonal)
    assert rate_of(scene) == pytest.approx(expected, rel=1e-12)
    assert rate_of(scene, mass=1e-6) == pytest.approx(expected, rel=1e-12)
    angles = np.zeros(SCENE.n)
    angles[1:] = np.pi / 2.0
    push = np.abs(mf.forces(SCENE, angles)[0]).max() / SCENE.casing.mass
    assert 0.1 < rate_of(SCENE) / math.sqrt(push / SCENE.casing.diagonal) < 10.0
    mass = [1e-5] + [0.01] * (SCENE.n - 1)
    model = pack(SCENE.replace(casing={"mass": mass}))
    assert model.fastest_rate == rate_of(SCENE, mass=1e-5)
    assert model.typical_rate == rate_of(SCENE, mass=float(np.mean(mass)))
    even = pack(SCENE)
    assert even.fastest_rate == pytest.approx(even.typical_rate, rel=1e-12)
