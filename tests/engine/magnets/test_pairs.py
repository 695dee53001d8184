"""Tests of magnets: the gradient of the energy, Newton's third law and sums over nodes."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import magfold_env as mf
from magfold_bench.laws import exact_magnets
from magfold_env.engine.magnets import laws, pairs
from magfold_env.engine.state import Loads, Pose
from magfold_env.engine.workspace import new_work
from magfold_env.simulation.pack import pack
from tests.engine import reference

SIDE = 0.0125
MODELS = {
    "points": mf.Magnets(model="points", pole_charge=8.5946),
    "strips": mf.Magnets(),
    "coarse strips": mf.Magnets(accuracy=1e-2),
    "fine strips": mf.Magnets(accuracy=1e-4),
    "one rule": mf.Magnets(nodes=5),
    "unequal sizes": mf.Magnets(
        width=(0.006, 0.004, 0.005, 0.003), height=(0.006, 0.003, 0.008, 0.004),
        thickness=(0.0025, 0.002, 0.003, 0.0015), inset=(0.0005, 0.0008, 0.0003, 0.001),
    ),
    "unequal heights": mf.Magnets(height=(0.003, 0.006, 0.009, 0.012)),
    "unequal strengths": mf.Magnets(remanence=(0.3, 0.6, 1.2, 0.9)),
}  # fmt: skip
models = st.sampled_from(sorted(MODELS))
seeds = st.integers(0, 2**32 - 1)


class Casings:
    """Separate casings anywhere in the plane, which the engine's kernels evaluate."""

    first = 0  # what comes before it is left out

    def __init__(self, scene):
        self.model = pack(scene.replace(friction=0.0, contact=False))
        self.work = new_work(self.model)

    def pose(self, places, headings):
        return Pose(np.cos(headings), np.sin(headings), places[:, 0].copy(), places[:, 1].copy())

    @property
    def nodes(self):
        return self.work.nodes

    def forces(self, places, headings):
        loads, pose = Loads(*np.zeros((3, headings.size))), self.pose(places, headings)
        pairs.add_forces(self.first, self.model.magnets, self.model.charge, pose, self.nodes, loads)
        return np.stack([loads.fx, loads.fy], axis=1), loads.torque

    def energy(self, places, headings):
        pose = self.pose(places, headings)
        return pairs.energy(0, self.model.magnets, self.model.charge, pose, self.nodes)

    def face_distances(self, places, headings):
        """Return the distances of the centres of all pairs of pole faces; 0 within a casing."""
        rule = self.model.magnets
        turn = np.exp(1j * headings)[:, None]
        faces = (places[:, :1] + 1j * places[:, 1:]) + turn * (rule.face_x + 1j * rule.face_y)
        faces = faces.ravel()
        between = np.kron(1 - np.eye(headings.size), np.ones((8, 8)))
        return between * np.abs(faces[:, None] - faces[None, :])

    def blended(self, places, headings):
        """Return the number of pairs of different casings' pole faces between two levels."""
        near = self.face_distances(places, headings)
        radii = self.model.magnets.level_radius[1:]
        return sum(int(((near > r) & (near < pairs.BLEND * r)).sum()) // 2 for r in radii)

    def crosses_an_edge(self, first, second):
        """Return whether a blend begins or ends here; it is only twice differentiable there."""
        rule = self.model.magnets
        levels = np.outer(rule.level_radius[1:], [1.0, pairs.BLEND]).ravel()
        ranks = 2 * rule.depth + np.outer(rule.rank_radius[1:], [1.0, laws.SPREAD]).ravel()
        casings = np.append(ranks, rule.far_radius * np.array([1.0, laws.SPREAD]))
        return _crosses(
            levels, self.face_distances(*first), self.face_distances(*second)
        ) or _crosses(casings, _distances(first[0]), _distances(second[0]))


def _distances(places):
    return np.hypot(*(places[:, None] - places[None, :]).transpose(2, 0, 1))


def _crosses(edges, before, after):
    low, high = np.minimum(before, after) - 1e-7, np.maximum(before, after) + 1e-7
    return any(bool(((low < edge) & (edge < high)).any()) for edge in edges)


def random_sequence(rng, n, letters="NS"):
    return tuple("".join(rng.choice(list(letters), 4)) for _ in range(n))


def scene_of(rng, n, model):
    return mf.Scene(sequence=random_sequence(rng, n), magnets=MODELS[model])


def scatter(rng, n, gap):
    """Draw casings that do not overlap, each within a few gaps of the previous one."""
    places, headings = [np.zeros(2)], [rng.uniform(-np.pi, np.pi)]
    while len(places) < n:
        heading, bearing = rng.uniform(-np.pi, np.pi, 2)
        for reach in np.arange(SIDE, 2 * SIDE, gap / 4):
            place = places[-1] + reach * np.array([np.cos(bearing), np.sin(bearing)])
            body = reference.square(place, heading, SIDE / 2)
            others = [
                reference.square(p, h, SIDE / 2) for p, h in zip(places, headings, strict=True)
            ]
            if all(reference.separation(body, other) > 0 for other in others):
                places.append(place)
                headings.append(heading)
                break
    return np.array(places), np.array(headings)


def error(scene, found, exact):
    """Return the largest error of a force, or of a torque over the side, in flush forces."""
    force = np.hypot(*(found[0] - exact[0]).T).max()
    torque = np.abs(found[1] - exact[1]).max() / SIDE
    return max(force, torque) / exact_magnets.flush_force(scene)


def gradient(casings, places, headings, step=4e-6):
    """Return the energy's derivatives by x, y [N] and heading [N·m]; None across an edge.

    A step is ``step`` in metres, and a hundred times this number in radians.
    """
    n = headings.size
    found = np.zeros((3, n))
    for axis, i in np.ndindex(3, n):
        shift, turn = np.zeros((n, 2)), np.zeros(n)
        if axis < 2:
            shift[i, axis] = 1.0
        else:
            turn[i] = 100.0

        def along(t, shift=shift, turn=turn):
            return places + t * shift, headings + t * turn

        if casings.crosses_an_edge(along(-3 * step), along(3 * step)):
            return None
        found[axis, i] = -reference.derivative(lambda t, a=along: casings.energy(*a(t)), step)
    return found[:2].T, found[2] / 100.0


def assert_gradient(casings, places, headings, expected, within=1e-8, weak=0.0):
    force, torque = casings.forces(places, headings)
    size = within * (np.abs(force).max() + weak)
    np.testing.assert_allclose(force, expected[0], rtol=0, atol=size)
    np.testing.assert_allclose(torque, expected[1], rtol=0, atol=SIDE * size)


@pytest.mark.laws
@pytest.mark.parametrize("model", sorted(MODELS))
def test_force_and_torque_are_the_energys_gradient(model):
    rng = np.random.default_rng(5)
    levels = {"strips", "coarse strips"}
    checked, blended = 0, 0
    while checked < 25 or (model in levels and blended < 10):
        casings = Casings(scene_of(rng, 3, model))
        places, headings = scatter(rng, 3, 0.001)
        expected = gradient(casings, places, headings)
        if expected is None:
            continue
        assert_gradient(casings, places, headings, expected)
        checked += 1
        blended += casings.blended(places, headings) > 0


@pytest.mark.laws
@pytest.mark.parametrize("share", [0.1, 0.3, 0.5, 0.7, 0.9])
@pytest.mark.parametrize("number", [1, 2])
@pytest.mark.parametrize("between", ["levels", "ranks"])
def test_gradient_holds_where_two_rules_are_blended(between, number, share):
    rng = np.random.default_rng(9)
    casings = Casings(scene_of(rng, 2, "coarse strips" if between == "levels" else "fine strips"))
    rule, expected = casings.model.magnets, None
    places, headings = np.zeros((2, 2)), np.zeros(2)
    for _ in range(100):
        headings, bearing = rng.uniform(-np.pi, np.pi, 2), rng.uniform(-np.pi, np.pi)
        if between == "levels":  # of two faces that look at each other
            radius = rule.level_radius[number]
            distance = SIDE - 0.001 + radius * (1.0 + share * (pairs.BLEND - 1.0))
            headings, bearing = np.array([np.pi / 4, np.pi / 4]), np.pi / 2
        else:
            room = rule.rank_radius[number] * (1.0 + share * (laws.SPREAD - 1.0))
            distance = 2 * rule.depth + room
        places = distance * np.array([[0.0, 0.0], [np.cos(bearing), np.sin(bearing)]])
        if (expected := gradient(casings, places, headings)) is not None:
            break
    assert expected is not None
    assert between == "ranks" or casings.blended(places, headings) > 0
    assert_gradient(casings, places, headings, expected)


@pytest.mark.laws
@given(seed=seeds, model=models, n=st.integers(2, 5))
def test_forces_and_moments_balance(seed, model, n):
    rng = np.random.default_rng(seed)
    casings = Casings(scene_of(rng, n, model))
    places, headings = scatter(rng, n, 0.001)
    force, torque = casings.forces(places, headings)
    size = np.abs(force).max()
    moment = places[:, 0] * force[:, 1] - places[:, 1] * force[:, 0] + torque
    assert np.abs(force.sum(axis=0)).max() <= 1e-12 * size
    assert abs(moment.sum()) <= 1e-12 * size * n * SIDE


@given(
    seed=seeds,
    count=st.sampled_from([1, 2, 3, 5, 12, 30]),
    kind=st.sampled_from(["points", "strips"]),
)
def test_a_single_rule_is_the_sum_over_its_nodes(seed, count, kind):
    # With `points` this is the paper's eqs. 5 to 7, each pair once and like poles apart.
    rng = np.random.default_rng(seed)
    scene = scene_of(rng, 3, "points").replace(magnets={"model": kind, "nodes": count})
    angles = np.cumsum(rng.uniform(-np.pi / 2, np.pi / 2, 3))
    places = reference.centres(np.append(angles, [0.0, 0.0]), SIDE)
    expected = reference.magnet_forces(places, angles, scene, count)
    force, torque = mf.forces(scene, angles)
    size = np.abs(expected[0]).max()
    np.testing.assert_allclose(force, expected[0], rtol=0, atol=1e-12 * size)
    np.testing.assert_allclose(torque, expected[1], rtol=0, atol=1e-12 * size * SIDE)
    # Poles of both signs cancel in the sum: rounding is judged by the energy of one pair.
    pair = size * SIDE
    assert mf.energy(scene, angles) == pytest.approx(expected[2], rel=1e-12, abs=1e-11 * pair)


@given(seed=seeds, model=st.sampled_from(["strips", "unequal sizes", "points"]))
def test_an_empty_face_is_a_face_of_no_strength(seed, model):
    rng = np.random.default_rng(seed)
    sequence = ("N---", *("".join(rng.choice(list("NS-"), 4)) for _ in range(2)))
    scene = mf.Scene(sequence=sequence, magnets=MODELS[model])
    strength = np.where(scene.charges != 0.0, np.abs(scene.charges).max(), 1e-30)
    letters = tuple(faces.replace("-", "N") for faces in sequence)
    same = scene.replace(sequence=letters, magnets={"pole_charge": strength.tolist()})
    even = scene.replace(magnets={"pole_charge": float(np.abs(scene.charges).max())})
    pose = scatter(rng, 3, 0.001)
    force, torque = Casings(even).forces(*pose)
    other, turning = Casings(same).forces(*pose)
    size = max(np.abs(other).max(), 1e-9)
    np.testing.assert_allclose(force, other, rtol=0, atol=1e-12 * size)
    np.testing.assert_allclose(torque, turning, rtol=0, atol=1e-12 * size * SIDE)
