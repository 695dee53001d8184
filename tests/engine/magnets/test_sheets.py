"""Tests of pole faces down to contact: closed forms, the bound, the limit, and whole folds."""

from typing import Any

import numpy as np
import pytest
from scipy import integrate

import magfold_env as mf
from magfold_env.engine.magnets import sheets
from tests.engine import reference
from tests.engine.magnets.test_chain import Chain
from tests.engine.magnets.test_pairs import Casings, random_sequence
from tests.reference import touching_faces
from tests.simulation.test_account import imbalance

SIDE = 0.0125
BOUNDS = [1e-2, 1e-3, 1e-4, 1e-5]
FEW_OR_MANY = [pytest.param(10, id="few"), pytest.param(500, id="many", marks=pytest.mark.slow)]
# What two 5 mm x 5 mm x 2 mm magnets of 1.3 T do in contact, by Akoun and Yonnet's closed form.
BLOCK: dict[str, Any] = {"width": 0.005, "height": 0.005, "thickness": 0.002, "remanence": 1.3}
BLOCK["inset"] = 0.0
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
    """Return two casings with random sizes, strengths and insets of magnets, and empty faces."""
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
            return mf.Scene(sequence=tuple(map("".join, letters)), magnets=mf.Magnets(**magnets))
        except mf.SceneError:
            continue  # they overlap


def side_by_side(rng):
    """Place a casing in contact with another or up to 20 mm away, turned and shifted at random."""
    near = rng.choice([0.0, 10 ** rng.uniform(-7.0, -1.7)])
    gap = near if rng.random() < 0.7 else rng.uniform(0.0, 0.02)
    slight = rng.uniform(-1.0, 1.0) * 10 ** rng.uniform(-5.0, 0.0)
    tilt = rng.choice([0.0, slight, rng.uniform(-np.pi / 4, np.pi / 4)])
    reach = SIDE / 2.0 * (1.0 + abs(np.sin(tilt)) + abs(np.cos(tilt)))
    places = np.array([[0.0, 0.0], [rng.uniform(-1.2, 1.2) * SIDE, reach + gap]])
    return places, np.pi / 4 + np.array([0.0, rng.integers(4) * np.pi / 2 + tilt])


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
        worst = max(
            worst, (max(np.hypot(*(found[0] - force)), *errors)) / touching_faces.flush_force(scene)
        )
    assert worst <= bound


def blocks(bound, sequence=("N---", "S---")):
    magnets = mf.Magnets(accuracy=bound, **BLOCK)
    return Casings(mf.Scene(sequence=sequence, casing=mf.Casing(side=0.01), magnets=magnets))


def facing(gap, aside=0.0, turn=0.0):
    """Place a casing in front of another one's front-left face, at a gap [m]."""
    places = np.array([[0.0, 0.0], [aside, 0.01 + gap]])
    return places, np.pi / 4 + np.array([0.0, np.pi + turn])


@pytest.mark.parametrize("bound", BOUNDS)
def test_contact_force_and_energy_are_those_of_the_closed_form(bound):
    casings = blocks(bound)
    force = np.hypot(*casings.forces(*facing(0.0))[0][0])
    assert force == pytest.approx(CONTACT_FORCE, rel=bound / 5.0)
    rise = casings.energy(*facing(1e-3)) - casings.energy(*facing(0.0))
    assert rise == pytest.approx(CONTACT_ENERGY, rel=bound / 5.0)


def test_overlapping_faces_feel_the_limit_from_outside_also_beyond_a_stop() -> None:
    casings = blocks(1e-4)
    (_, touch), _ = casings.forces(*facing(0.0))[0]
    for overlap in (1e-12, 1e-8, 1e-6):
        (_, pull), _ = casings.forces(*facing(-overlap))[0]
        assert pull == pytest.approx(touch, rel=1e-3)
    force, torque = casings.forces(*facing(-1e-3, 1e-4, 0.1))
    assert np.isfinite(force).all()
    assert np.isfinite(torque).all()
    rng = np.random.default_rng(65)
    chain = Chain(mf.Scene(sequence=random_sequence(rng, 2), magnets=mf.Magnets(inset=0.0)))
    at = chain.forces([0.0, np.pi / 2])[1]
    for past in (1e-6, 1e-3, 0.3):
        assert chain.forces([0.0, np.pi / 2 + past])[1] == at
        rise = chain.energy([0.0, np.pi / 2 + past]) - chain.energy([0.0, np.pi / 2])
        assert rise == pytest.approx(-at * past, rel=1e-6)


def opening(turn):
    """Turn a casing that faces another about a corner that they share."""
    c, s = np.cos(turn), np.sin(turn)
    return facing(0.005 * (s + c - 1.0), 0.005 * (c - s - 1.0), turn)


PATHS = {
    "apart": lambda u: facing(1e-3 * u**3), "through": lambda u: facing(2e-6 * (u - 0.5)),
    "open": lambda u: opening(0.5 * u**3), "away": lambda u: facing(0.02 * u, 0.01 * u, 0.3 * u),
    "slide": lambda u: facing(1e-5, 0.004 * u + 5e-4),
}  # fmt: skip


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


@pytest.mark.parametrize("bound", [1e-2, 1e-3, 1e-5])
def test_a_chain_of_flush_magnets_folds_and_keeps_its_energy(bound):
    sequence = ("SNNS", "NNSN", "SSSN", "NNNS", "SSSS", "NNSN")
    casing, magnets = mf.Casing(side=0.01, mass=0.0021), mf.Magnets(accuracy=bound, **BLOCK)
    scene = mf.Scene(sequence=sequence, casing=casing, magnets=magnets)
    left, session = imbalance(scene.replace(friction=0.0).draw(np.random.default_rng(0)))
    assert session.fold().status == "folded"
    assert left <= 1e-4
    # No face pulls harder than in contact, at a lever of half a side or so.
    opens = mf.holding(mf.simulate(scene.replace(friction=0.2))).opens
    assert 0.5 * CONTACT_FORCE * 0.005 < np.abs(opens).min() < 1.5 * CONTACT_FORCE * 0.005
