"""Tests of a uniform field and a fixed magnet against exact references and laws."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import magfold_env as mf
from magfold_env.engine.magnets import outer_field
from magfold_env.engine.state import Loads
from magfold_env.simulation.pack import pack
from tests.engine import reference
from tests.engine.magnets.test_pairs import Casings, assert_gradient, gradient, random_sequence
from tests.reference import touching_faces
from tests.simulation.test_account import imbalance

SIDE = 0.0125
THICKNESS = 0.0025
MAGNET = {"position": (0.03, 0.02), "heading": 0.7, "width": 0.02, "height": 0.01}
MAGNET |= {"thickness": 0.008, "remanence": 1.2}
EVEN = {"uniform": (0.02, -0.03)}
seeds = st.integers(0, 2**32 - 1)


class InField(Casings):
    """Casings in an external field, which alone exerts forces on them."""

    def forces(self, places, headings):
        super().forces(places, headings)  # turns the casings and spreads their charges
        pose, loads = self.pose(places, headings), Loads(*np.zeros((3, headings.size)))
        outer_field.add_field(0, self.model, pose, self.nodes, loads)
        return np.stack([loads.fx, loads.fy], axis=1), loads.torque

    def energy(self, places, headings):
        super().forces(places, headings)
        return outer_field.field_energy(0, self.model, self.pose(places, headings), self.nodes)


def in_field(sequence, field, **changes):
    return mf.Scene(sequence=sequence).replace(field=field, **changes)


def around(rng, least, most):
    """Place a casing outside the magnet, with a gap between the magnet and a bounding circle."""
    bearing, heading = rng.uniform(-np.pi, np.pi, 2)
    distance = np.hypot(0.010, 0.004) + SIDE / np.sqrt(2) + rng.uniform(least, most)
    place = np.array(MAGNET["position"]) + distance * np.array([np.cos(bearing), np.sin(bearing)])
    return place[None], np.array([heading])


def facing(rng, gap=5e-4, poles=(0.0,)):
    """Place a casing in front of one of the magnet's poles (0 or π), or shifted along it."""
    heading = MAGNET["heading"] + rng.choice(poles)
    along = np.array([np.cos(heading), np.sin(heading)])
    aside = rng.uniform(-0.012, 0.012) * np.array([-along[1], along[0]])
    place = np.array(MAGNET["position"]) + (0.004 + SIDE / 2 + gap) * along + aside
    return place[None], np.array([heading + np.pi / 4 + rng.integers(4) * np.pi / 2])


PLACES = {
    "touching": lambda rng: facing(rng, 0.0, (0.0, np.pi)), "flush": facing,
    "near": lambda rng: around(rng, 1e-4, 5e-3), "far": lambda rng: around(rng, 5e-3, 0.1),
}  # fmt: skip


@given(seed=seeds)
def test_an_even_field_turns_a_casing_by_its_moment(seed):
    rng = np.random.default_rng(seed)
    scene = in_field(random_sequence(rng, 1, "NS-"), EVEN)
    places, headings = rng.normal(size=(1, 2)), rng.uniform(-np.pi, np.pi, 1)
    force, torque = InField(scene).forces(places, headings)
    normals = headings[0] + np.array([0.25, 0.75, -0.75, -0.25]) * np.pi
    moment = THICKNESS * (scene.charges[0] @ np.stack([np.cos(normals), np.sin(normals)], 1))
    bx, by = EVEN["uniform"]
    scale = mf.Magnets().charge * THICKNESS * np.hypot(bx, by)
    assert torque[0] == pytest.approx(moment[0] * by - moment[1] * bx, abs=1e-12 * scale)
    assert not force.any()
    energy = InField(scene).energy(places, headings)
    assert energy == pytest.approx(-(moment[0] * bx + moment[1] * by), abs=1e-12 * scale)


def scene_of(rng, bound):
    scene = in_field(random_sequence(rng, 1, "NS-"), {"magnet": MAGNET, **EVEN})
    return scene.replace(magnets={"accuracy": bound})


@pytest.mark.parametrize("bound", [1e-2, 1e-3, 1e-4, 1e-5])
@pytest.mark.parametrize("inset", [0.0, 5e-4])
@pytest.mark.parametrize("gap", PLACES)
@pytest.mark.parametrize("count", [6, pytest.param(100, marks=pytest.mark.slow)])
def test_a_fixed_magnet_acts_within_the_bound(count, gap, inset, bound):
    rng = np.random.default_rng(51)
    worst = 0.0
    for _ in range(count):
        scene = scene_of(rng, bound).replace(magnets={"inset": inset})
        pose = PLACES[gap](rng)
        force, torque = InField(scene).forces(*pose)
        wanted, turning = touching_faces.in_field(scene, *pose)
        error = max(np.hypot(*(force - wanted)[0]), abs(torque - turning)[0] / SIDE)
        # A charge twice as dense as the chain's own makes twice the error.
        worst = max(worst, error / touching_faces.flush_force(scene) / 2.0)
    assert worst <= bound


@pytest.mark.laws
@pytest.mark.parametrize("near", [False, True])
@pytest.mark.parametrize("seed", range(20))
def test_force_and_torque_are_the_energys_gradient(seed, near):
    rng = np.random.default_rng(seed)
    casings = InField(scene_of(rng, 1e-3))
    pose = facing(rng) if near else around(rng, 0.0, 0.02)
    assert_gradient(casings, *pose, gradient(casings, *pose, step=2e-6), weak=1e-3)


def test_public_forces_and_energy_contain_the_field():
    scene = in_field(("NSSN", "NN-S"), {"magnet": MAGNET, **EVEN})
    bare = scene.replace(field=None)
    angles = np.array([0.2, -0.4])
    places = reference.centres(np.append(angles, [0.0, 0.0]), SIDE)
    force, torque = mf.forces(scene, angles)
    own, turning = mf.forces(bare, angles)
    wanted, twist = touching_faces.in_field(scene, places, angles)
    unit = 1e-3 * touching_faces.flush_force(scene)
    np.testing.assert_allclose(force - own, wanted, rtol=0, atol=unit)
    np.testing.assert_allclose(torque - turning, twist, rtol=0, atol=unit * SIDE)
    outer = InField(scene).energy(places, angles)
    assert mf.energy(scene, angles) - mf.energy(bare, angles) == pytest.approx(outer, rel=1e-9)


@pytest.mark.laws
def test_energy_is_kept_in_the_field():
    # Beyond the chain's reach.
    magnet = {**MAGNET, "position": (0.056, 0.01)}
    scene = in_field(
        ("NSSN", "NNSS"), {"magnet": magnet, **EVEN}, mount="pinned", friction=0.0,
        start_angles=(0.5,), duration=0.3,
    )  # fmt: skip
    left, session = imbalance(scene)
    assert left <= 1e-4
    assert session.time > 0.1


def recorded(fold):
    assert fold.trajectory is not None
    return fold.trajectory


@pytest.mark.parametrize("end", [-1.0, 1.0])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_what_lies_beside_a_fixed_magnet_has_not_come_through_its_poles(side, end):
    magnet = {"position": (0.05, 0.0), "heading": 0.0, "width": 0.008, "height": 0.02}
    scene = mf.Scene(sequence=("SNNN",), magnets=mf.Magnets(inset=0.0, accuracy=1e-4))
    magnet |= {"thickness": 0.02, "remanence": 1.2}
    field = InField(scene.replace(field={"magnet": magnet}))

    def energy(overlap, turn):
        place = [[0.05 + end * 0.009, side * (0.004 + SIDE / 2.0 - overlap)]]
        return field.energy(np.array(place), np.array([np.pi / 4 + turn]))

    apart = energy(-1e-6, 0.0)
    for overlap in (1e-6, 1e-7, 1e-9, 0.0):
        for turn in (-1e-5, 0.0, 1e-5):
            assert energy(overlap, turn) == pytest.approx(apart, rel=2e-3)


@pytest.mark.parametrize("heading", [0.1, 1.2])
@pytest.mark.parametrize("friction", [0.0, 0.35])
def test_a_casing_runs_into_the_fixed_magnet_and_not_through_it(heading, friction):
    magnet = {**MAGNET, "position": (0.05, 0.004), "heading": heading}
    scene = in_field(("NSSN",), {"magnet": magnet}, mount="free", friction=friction, duration=1.0)
    fold = mf.simulate(scene, seed=3, frame_rate=500)
    assert fold.status in (mf.FoldStatus.FOLDED, mf.FoldStatus.MISFOLDED, mf.FoldStatus.UNSETTLED)
    block = reference.rectangle(magnet["position"], heading, 0.004, 0.01)
    path, gaps = recorded(fold), []
    for base, angle in zip(path.base, path.angles[:, 0], strict=True):
        centre = base + SIDE / np.sqrt(2) * np.array([np.cos(angle), np.sin(angle)])
        gaps.append(reference.separation(reference.square(centre, angle, SIDE / 2), block))
    # Corners are rounded: sharp ones would stick out by 0.41 of their radius.
    assert min(gaps) >= -2e-4 * SIDE - 0.42 * scene.casing.corner_radius
    assert min(gaps) <= 1e-3 * SIDE  # they have met
    if friction:
        assert fold.status is not mf.FoldStatus.UNSETTLED


@pytest.mark.parametrize("magnets", [None, {}])
def test_a_fixed_magnet_is_in_the_way_of_a_chain_without_magnets(magnets):
    # A pendulum swings down onto the magnet's upper side, 14 mm below its pin.
    magnet = {**MAGNET, "position": (0.003, -0.018), "heading": np.pi / 2}
    scene = in_field(
        ("----",), {"magnet": magnet}, magnets=magnets, friction=0.0, duration=0.2, mount="pinned",
        gravity={"in_plane": (0.0, -9.8)},
    )  # fmt: skip
    model = pack(scene)
    assert len(model.obstacles) == 1
    assert not model.field.present
    stopped, free = (
        recorded(mf.simulate(each, frame_rate=1000)) for each in (scene, scene.replace(field=None))
    )
    tip = SIDE * np.sqrt(2) * np.array([np.cos(stopped.angles[:, 0]), np.sin(stopped.angles[:, 0])])
    above = np.abs(tip[0] - 0.003) <= 0.010
    assert above.any()
    assert (tip[1, above] >= -0.014 - 1e-3 * SIDE).all()
    assert stopped.angles.min() > -np.pi / 2 > free.angles.min()
