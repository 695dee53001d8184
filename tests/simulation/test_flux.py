"""Tests of the flux density around a chain against exact references and physical laws."""

import numpy as np
import pytest

import magfold_env as mf
from magfold_bench.laws import exact_magnets
from magfold_env.shapes import centres

ANCHOR = mf.load_scene("anchor")  # unequal faces, some of them empty
ANGLES = np.array([0.3, 0.9, 0.1, -0.6, 0.2, 1.1])
POINTS = mf.Scene(sequence=("NS-N", "SNNS", "NNSS"), magnets=mf.Magnets(model="points", nodes=5))


def exact(scene: mf.Scene, angles: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return µ0 H [T] of all pole faces, each by the closed form of a charged rectangle."""
    faces = exact_magnets.faces_of(scene, centres(angles, side=scene.casing.side), angles)
    total = np.zeros_like(points)
    for centre, along, size, charge in zip(*faces, strict=True):
        across = np.array([-along[1], along[0]])
        x, y = (points - centre) @ along, (points - centre) @ across
        u, v = exact_magnets.rectangle_field(x, y, np.zeros_like(x), size[0], size[1])
        share = exact_magnets.COULOMB * charge / size.prod()
        total += share * (u[:, None] * along + v[:, None] * across)
    return total


def around(scene: mf.Scene, angles: np.ndarray, far: float) -> np.ndarray:
    """Return points outside all casings, `far` [m] from the walls of one."""
    half = scene.casing.side / 2.0 + far
    along = np.linspace(-half, half, 23)
    wall = np.concatenate(
        [half + 1j * along, -half + 1j * along, along + 1j * half, along - 1j * half]
    )
    turned = wall * np.exp(1j * (angles[:, None] + np.pi / 4.0))
    middles = centres(angles, side=scene.casing.side)
    centre = middles[:, :1] + 1j * middles[:, 1:]
    places = (turned + centre).ravel()
    seen = (places - centre) * np.exp(-1j * (angles[:, None] + np.pi / 4.0))
    inside = np.maximum(abs(seen.real), abs(seen.imag)) < scene.casing.side / 2.0 - 1e-9
    places = places[~inside.any(axis=0)]
    return np.stack([places.real, places.imag], axis=1)


@pytest.mark.parametrize("far", [0.0, 1e-3, 0.02])
def test_it_is_that_of_charged_rectangles(far: float) -> None:
    points = around(ANCHOR, ANGLES, far)
    found, wanted = mf.field(ANCHOR, ANGLES, points), exact(ANCHOR, ANGLES, points)
    scale = np.abs(wanted).max()
    assert scale > 1e-3
    np.testing.assert_allclose(found, wanted, rtol=0.0, atol=1e-7 * scale)


def test_it_has_no_curl_outside_magnets() -> None:
    middle = centres(ANGLES, side=ANCHOR.casing.side).mean(axis=0)
    turn = np.linspace(0.0, 2.0 * np.pi, 400, endpoint=False)
    ring = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    found = mf.field(ANCHOR, ANGLES, middle + 0.07 * ring)
    tangent = np.stack([-ring[:, 1], ring[:, 0]], axis=1)
    flow = np.sum(found * tangent, axis=1)
    assert abs(flow.mean()) < 1e-9 * np.abs(flow).max()


def test_no_flux_begins_or_ends_at_a_pole_face() -> None:
    scene = mf.Scene(sequence=("N---",))
    magnets = scene.magnets
    assert magnets is not None
    normal = np.array([1.0, 1.0]) / np.sqrt(2.0)
    across = np.array([-1.0, 1.0]) / np.sqrt(2.0)
    middle = centres(np.zeros(1), side=scene.casing.side)[0]
    offsets = np.linspace(-0.4, 0.4, 7)[:, None] * 0.006 * across
    for depth in (0.0005, 0.003):  # the outer pole face and the inner one
        face = middle + (scene.casing.side / 2.0 - depth) * normal + offsets
        outside, inside = (mf.field(scene, [0.0], face + way * 3e-6 * normal) for way in (1, -1))
        np.testing.assert_allclose(outside @ normal, inside @ normal, atol=1e-3)
        assert (outside @ normal > 0.05).all()  # out of the north pole
        # µ0 H jumps by the density of the charge.
        jump = (
            exact(scene, np.zeros(1), face + 3e-6 * normal)
            - exact(scene, np.zeros(1), face - 3e-6 * normal)
        ) @ normal
        np.testing.assert_allclose(np.abs(jump), 0.6, atol=2e-3)


def test_what_it_does_to_charges_is_the_force_on_them() -> None:
    angles = np.array([0.2, 1.0, 0.4])
    force, torque = mf.forces(POINTS, angles)
    middles = centres(angles, side=POINTS.casing.side)
    faces = exact_magnets.faces_of(POINTS, middles, angles)
    for k in range(POINTS.n):
        others = [s if j != k else "----" for j, s in enumerate(POINTS.sequence)]
        own = slice(8 * k, 8 * k + 8)
        node = np.linspace(-0.5, 0.5, 5)[:, None, None] * 0.006 * faces.along[own]
        places = (faces.centre[own] + node).reshape(-1, 2)
        flux = mf.field(POINTS.replace(sequence=others), angles, places)
        acting = np.tile(faces.charge[own] / 5.0, 5)[:, None] * flux
        np.testing.assert_allclose(
            acting.sum(axis=0), force[k], atol=1e-12 + 1e-9 * np.abs(force).max()
        )
        arm = places - middles[k]
        assert exact_magnets.cross(arm, acting).sum() == pytest.approx(torque[k], rel=1e-8)


def test_torques_about_any_point_balance() -> None:
    for point in ([0.0, 0.0], [0.03, -0.02]):
        force, torque = mf.forces(POINTS, [0.2, 1.0, 0.4], about=point)
        assert abs(torque.sum()) < 1e-9 * np.abs(torque).max()
    alone = mf.forces(POINTS, [0.2, 1.0, 0.4])
    arm = centres([0.2, 1.0, 0.4], side=POINTS.casing.side) - [0.03, -0.02]
    np.testing.assert_allclose(torque, alone[1] + exact_magnets.cross(arm, force))
    np.testing.assert_array_equal(force, alone[0])


@pytest.mark.parametrize("points", [[0.0, 1.0], [[0.0]], [[np.nan, 0.0]], "here"])
def test_places_are_pairs_of_finite_numbers(points: object) -> None:
    with pytest.raises(
        mf.SceneError, match=r"^points: .* must be finite numbers, two for each point"
    ):
        mf.field(POINTS, [0.0, 0.0, 0.0], points)  # pyright: ignore
    with pytest.raises(mf.SceneError, match=r"^about: .* must be finite numbers, two for x and y"):
        mf.forces(POINTS, [0.0, 0.0, 0.0], about=[np.inf, 0.0])


def test_a_chain_without_magnets_has_no_field() -> None:
    bare = mf.Scene(sequence=("NNNN",), magnets=None)
    assert not mf.field(bare, [0.0], [[0.0, 0.0]]).any()


def test_steel_pulls_like_a_mirror_image() -> None:
    """The force on a mirror equals that between two magnets at twice the distance."""
    pair = mf.Scene(sequence=("N---", "-S--"), casing=mf.Casing(side=0.016))
    gap = 0.003
    pair = pair.replace(magnets={"inset": gap / 2})
    angles = [0.0, np.pi / 2.0]
    force, _ = mf.forces(pair, angles)
    # On the plane halfway the field is normal: tension B²/2µ0, strongest in its middle.
    middle = centres(angles, side=0.016).mean(axis=0)
    pull = force[0] / np.linalg.norm(force[0])
    along = np.array([-pull[1], pull[0]])
    flux = mf.field(pair, angles, middle + np.linspace(-0.01, 0.01, 9)[:, None] * along)
    assert np.abs(flux @ along).max() < 1e-9 * np.abs(flux @ pull).max()
    single = pair.replace(sequence=("N---", "----"))
    alone = mf.field(single, angles, [middle])
    np.testing.assert_allclose(flux[4], 2.0 * alone[0], rtol=1e-9)
