"""Pole faces down to contact: closed forms, the bound, the limit from outside, and whole folds."""

from typing import Any

import numpy as np
import pytest
from scipy import integrate

import magfold_env as mf
from magfold_bench.laws import exact_magnets as exact
from magfold_env.engine.magnets import sheets
from magfold_env.scene import Magnets, Scene
from magfold_env.shapes import word_to_angles
from tests.engine import reference
from tests.engine.magnets.test_chain import Chain
from tests.engine.magnets.test_outer_field import InField
from tests.engine.magnets.test_pairs import Casings, random_sequence
from tests.reference import touching_faces
from tests.simulation.test_account import imbalance

SIDE = 0.0125
BOUNDS = [1e-2, 1e-3, 1e-4, 1e-5]
FEW_OR_MANY = [pytest.param(10, id="few"), pytest.param(500, id="many", marks=pytest.mark.slow)]
# What two 5 mm x 5 mm x 2 mm magnets of 1.3 T do in contact, by Akoun and Yonnet's closed form.
BLOCK: dict[str, Any] = {
    "width": 0.005,
    "height": 0.005,
    "thickness": 0.002,
    "remanence": 1.3,
    "inset": 0.0,
}
CONTACT_FORCE, CONTACT_ENERGY = 8.66214, 5.06971e-3  # [N], and to 1 mm [J]


@pytest.mark.parametrize("heights", [(1.0, 1.0), (0.4, 1.7), (1.0, 1.0 + 1e-5)])
@pytest.mark.parametrize("d", [1.0, 0.1, 1e-3])
def test_a_face_acts_on_a_line_as_quadrature_says(d, heights):
    half, (tall, other) = 0.35, np.array(heights) / 2.0
    for s in (-0.9, -0.1, 0.2, 0.36):
        found = sheets.potential(s, d, half, tall, other)

        def laws(t, s=s):
            # The energy of two lines and its slopes.
            rho = np.hypot(s - t, d)
            slope = -2.0 / (rho**2 * (np.hypot(rho, tall + other) + np.hypot(rho, tall - other)))
            energy = reference.upright_energy(rho, 2.0 * tall, 2.0 * other)
            return np.array([energy, slope * (s - t), slope * d])

        nearest = [np.clip(s, -half, half)]
        whole, _ = integrate.quad_vec(laws, -half, half, points=nearest, epsabs=1e-12, limit=2000)
        np.testing.assert_allclose(found, whole / (2.0 * half), rtol=1e-8, atol=1e-8)


def unequal(rng):
    """Return two casings with magnets of any sizes, strengths and insets, some left out."""
    while True:
        magnets: dict[str, Any] = {
            "width": tuple(rng.uniform(0.003, 0.008, 4)),
            "height": tuple(rng.uniform(0.003, 0.012, 4)),
            "thickness": tuple(rng.uniform(0.001, 0.003, 4)),
            "inset": tuple(rng.uniform(0.0, 1e-3, 4)) if rng.random() < 0.5 else 0.0,
            "remanence": tuple(rng.uniform(0.3, 1.3, 4)),
        }
        letters = rng.choice(list("NS-"), (2, 4), p=[0.42, 0.42, 0.16])
        try:
            return Scene(sequence=tuple(map("".join, letters)), magnets=Magnets(**magnets))
        except mf.SceneError:
            continue  # they overlap


def side_by_side(rng):
    """Place a casing in touch with another, or up to 20 mm away, turned and slid at will."""
    near = rng.choice([0.0, 10 ** rng.uniform(-7.0, -1.7)])
    gap = near if rng.random() < 0.7 else rng.uniform(0.0, 0.02)
    slight = rng.uniform(-1.0, 1.0) * 10 ** rng.uniform(-5.0, 0.0)
    tilt = rng.choice([0.0, slight, rng.uniform(-np.pi / 4, np.pi / 4)])
    reach = SIDE / 2.0 * (1.0 + abs(np.sin(tilt)) + abs(np.cos(tilt)))
    places = np.array([[0.0, 0.0], [rng.uniform(-1.2, 1.2) * SIDE, reach + gap]])
    return places, np.pi / 4 + np.array([0.0, rng.integers(4) * np.pi / 2 + tilt])


def flush_force(scene):
    """Force [N] between the hardest pulling of opposite flush faces: the unit of errors."""
    found = []
    for face, inset in enumerate(scene.magnets.by_face("inset")):
        size = [scene.magnets.by_face(name)[face] for name in ("width", "height")]
        _, force, _ = touching_faces.face_pair(np.array([0.0, -2.0 * inset]), np.pi, size, size)
        charge = scene.magnets.charges(scene.n)[:, face].max()
        found.append(exact.COULOMB * charge**2 * np.hypot(*force))
    return max(found)


@pytest.mark.parametrize("bound", BOUNDS)
@pytest.mark.parametrize("times", FEW_OR_MANY)
def test_bound_holds_for_casings_down_to_contact(times, bound):
    rng = np.random.default_rng(62)
    worst = 0.0
    for _ in range(times):
        scene, pose = unequal(rng), side_by_side(rng)
        energy, force, torque = touching_faces.pair(scene, *pose)
        casings = Casings(scene.replace(magnets={"accuracy": bound}))
        found, moment = casings.forces(*pose)
        errors = abs(casings.energy(*pose) - energy) / SIDE, abs(moment[0] - torque) / SIDE
        worst = max(worst, (max(np.hypot(*(found[0] - force)), *errors)) / flush_force(scene))
    assert worst <= bound


def blocks(bound, sequence=("N---", "S---")):
    magnets = Magnets(accuracy=bound, **BLOCK)
    return Casings(Scene(sequence=sequence, casing=mf.Casing(side=0.01), magnets=magnets))


def facing(gap, aside=0.0, turn=0.0):
    """Place a casing before the front-left face of another, a gap [m] away."""
    places = np.array([[0.0, 0.0], [aside, 0.01 + gap]])
    return places, np.pi / 4 + np.array([0.0, np.pi + turn])


@pytest.mark.parametrize("bound", BOUNDS)
def test_contact_force_and_energy_are_those_of_the_closed_form(bound):
    casings = blocks(bound)
    force = np.hypot(*casings.forces(*facing(0.0))[0][0])
    assert force == pytest.approx(CONTACT_FORCE, rel=bound / 5.0)
    rise = casings.energy(*facing(1e-3)) - casings.energy(*facing(0.0))
    assert rise == pytest.approx(CONTACT_ENERGY, rel=bound / 5.0)


def test_overlapping_faces_feel_the_limit_from_outside():
    casings = blocks(1e-4)
    (_, touch), _ = casings.forces(*facing(0.0))[0]
    for overlap in (1e-12, 1e-8, 1e-6):
        (_, pull), _ = casings.forces(*facing(-overlap))[0]
        assert pull == pytest.approx(touch, rel=1e-3)
    force, torque = casings.forces(*facing(-1e-3, 1e-4, 0.1))
    assert np.isfinite(force).all()
    assert np.isfinite(torque).all()


def opening(turn):
    """Turn a casing that faces another about a corner that they share."""
    c, s = np.cos(turn), np.sin(turn)
    return facing(0.005 * (s + c - 1.0), 0.005 * (c - s - 1.0), turn)


PATHS = {
    "apart": lambda u: facing(1e-3 * u**3),
    "through": lambda u: facing(2e-6 * (u - 0.5)),
    "open": lambda u: opening(0.5 * u**3),
    "away": lambda u: facing(0.02 * u, 0.01 * u, 0.3 * u),
    "slide": lambda u: facing(1e-5, 0.004 * u + 5e-4),
}


@pytest.mark.laws
@pytest.mark.parametrize("path", PATHS)
@pytest.mark.parametrize("bound", BOUNDS)
def test_work_along_a_path_is_the_energys_difference(bound, path):
    casings, along = blocks(bound), PATHS[path]
    work, h = 0.0, 1e-6
    node, weight = np.polynomial.legendre.leggauss(100)
    for u, share in zip((node + 1.0) / 2.0, weight / 2.0, strict=True):
        (before, one), (after, other) = along(u - h), along(u + h)
        force, torque = casings.forces(*along(u))
        work += share * np.sum(force * (after - before)) / (2.0 * h)
        work += share * np.sum(torque * (other - one)) / (2.0 * h)
    lost = casings.energy(*along(0.0)) - casings.energy(*along(1.0))
    assert work == pytest.approx(lost, abs=0.1 * bound * CONTACT_ENERGY + 2e-6 * abs(lost))


@pytest.mark.parametrize("bound", BOUNDS)
@pytest.mark.parametrize("inset", [0.0, 5e-4])
def test_a_fixed_magnet_acts_within_the_bound_in_touch(inset, bound):
    rng = np.random.default_rng(63)
    magnet = {"position": (0.03, 0.02), "heading": 0.7, "width": 0.02, "height": 0.01}
    magnet |= {"thickness": 0.008, "remanence": 1.2}
    worst = 0.0
    for north in (True, False) * 3:
        scene = Scene(sequence=("NSNS",), magnets=Magnets(accuracy=bound, inset=inset))
        scene = scene.replace(field={"magnet": magnet})
        heading = magnet["heading"] + (0.0 if north else np.pi)
        axis = np.array([np.cos(heading), np.sin(heading)])
        aside = rng.uniform(-0.012, 0.012) * np.array([-axis[1], axis[0]])
        place = np.array(magnet["position"]) + (0.004 + SIDE / 2) * axis + aside
        pose = place[None], np.array([heading + np.pi / 4 + rng.integers(4) * np.pi / 2])
        force, torque = InField(scene).forces(*pose)
        _, wanted, turning = touching_faces.in_field(scene, *pose)
        error = max(np.hypot(*(force[0] - wanted)), abs(torque[0] - turning) / SIDE)
        # Its poles are twice as dense as the chain's.
        worst = max(worst, error / flush_force(scene) / 2.0)
    assert worst <= bound


@pytest.mark.parametrize("end", [-1.0, 1.0])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_what_lies_beside_a_fixed_magnet_has_not_come_through_its_poles(side, end):
    magnet = {"position": (0.05, 0.0), "heading": 0.0, "width": 0.008, "height": 0.02}
    scene = Scene(sequence=("SNNN",), magnets=Magnets(inset=0.0, accuracy=1e-4))
    magnet |= {"thickness": 0.02, "remanence": 1.2}
    field = InField(scene.replace(field={"magnet": magnet}))

    def energy(overlap, turn):
        place = [[0.05 + end * 0.009, side * (0.004 + SIDE / 2.0 - overlap)]]
        return field.energy(np.array(place), np.array([np.pi / 4 + turn]))

    apart = energy(-1e-6, 0.0)
    for overlap in (1e-6, 1e-7, 1e-9, 0.0):
        for turn in (-1e-5, 0.0, 1e-5):
            assert energy(overlap, turn) == pytest.approx(apart, rel=2e-3)


def jointed_and_summed(scene, joints):
    """Torques (n,) of the headings by the dynamics' kernels, and by fine sums over all pairs."""
    q = np.append(np.cumsum(joints), [0.0, 0.0])
    casings = Casings(scene.replace(magnets={"accuracy": 1e-7}))
    force, torque = casings.forces(reference.centres(q, SIDE), q[:-2])
    jacobian = reference.velocity_map(q, SIDE)[:, :, :-2]
    return Chain(scene).forces(joints)[:-2], np.einsum("idk,id->k", jacobian, force) + torque


@pytest.mark.parametrize("bound", BOUNDS)
@pytest.mark.parametrize("share", [1.0, 1.0 - 1e-6, 0.999, 0.97])
@pytest.mark.parametrize("inset", [0.0, 1e-4])
def test_torques_of_folded_chains_keep_the_bound_in_touch(inset, share, bound):
    rng = np.random.default_rng(66)
    for word in ("LLLRRR", "LLSRRL", "RRRSLL"):
        magnets = Magnets(inset=inset, accuracy=bound)
        scene = Scene(sequence=random_sequence(rng, 7), magnets=magnets)
        found, wanted = jointed_and_summed(scene, np.append(0.3, share * word_to_angles(word)))
        # A joint's torque is the sum of the headings' beyond it.
        error = np.abs(np.cumsum((found - wanted)[::-1])).max() / SIDE / flush_force(scene)
        assert error <= 3 * bound


def test_torque_beyond_a_stop_is_what_it_is_at_the_stop():
    rng = np.random.default_rng(65)
    chain = Chain(Scene(sequence=random_sequence(rng, 2), magnets=Magnets(inset=0.0)))
    at = chain.forces([0.0, np.pi / 2])[1]
    for past in (1e-6, 1e-3, 0.3):
        assert chain.forces([0.0, np.pi / 2 + past])[1] == at
        rise = chain.energy([0.0, np.pi / 2 + past]) - chain.energy([0.0, np.pi / 2])
        assert rise == pytest.approx(-at * past, rel=1e-6)


@pytest.mark.parametrize("bound", [1e-2, 1e-3, 1e-5])
def test_a_chain_of_flush_magnets_folds_and_keeps_its_energy(bound):
    sequence = ("SNNS", "NNSN", "SSSN", "NNNS", "SSSS", "NNSN")
    casing, magnets = mf.Casing(side=0.01, mass=0.0021), Magnets(accuracy=bound, **BLOCK)
    scene = Scene(sequence=sequence, casing=casing, magnets=magnets)
    left, session = imbalance(scene.replace(friction=0.0).draw(np.random.default_rng(0)))
    assert session.fold().status == "folded"
    assert left <= 1e-4
    # No face pulls harder than in contact, at a lever of half a side or so.
    opens = mf.holding(mf.simulate(scene.replace(friction=0.2))).opens
    assert 0.5 * CONTACT_FORCE * 0.005 < np.abs(opens).min() < 1.5 * CONTACT_FORCE * 0.005
