"""The nodes of a pole face: exactness near, the error bound everywhere, the table it rests on."""

from itertools import pairwise

import numpy as np
import pytest

import magfold_env as mf
from magfold_bench.laws import exact_magnets
from magfold_env.engine.magnets import pairs
from magfold_env.engine.magnets.segments import SPREAD
from magfold_env.engine.workspace import new_nodes
from magfold_env.scene import Magnets, Scene
from magfold_env.shapes import folded_words, word_to_angles
from magfold_env.simulation.pack import pack_magnets
from magfold_env.simulation.quadrature import choose_rule
from tests.engine.magnets.test_pairs import Casings, scatter, scene_of

SIDE = 0.0125
WIDTH = HEIGHT = 0.006
EXACT = 24  # nodes that leave 1e-7 where casings lie flush, and less elsewhere
BOUNDS = [5e-2, 1e-2, 1e-3, 1e-4]


def strip_force(nodes, offset, turn):
    """Force (2,) and torque of the engine's sum on a face of unit charge, as in the reference."""
    rule = pack_magnets(Scene(sequence=("NNNN",), magnets=Magnets(nodes=nodes)))
    x, y = float(offset[0]), float(offset[1])
    c, s = np.cos(turn), np.sin(turn)
    along = WIDTH * c, WIDTH * s
    faces = pairs.FacePair(True, HEIGHT / 2.0, HEIGHT / 2.0, x, y, *along, WIDTH, 0.0)
    _, fx, fy, torque = pairs.level_sum(rule, 0, faces, False, new_nodes(rule, 1))
    return np.array([fx, fy]), torque


def exact_force(offset, turn):
    """Force (2,) and torque between two pole faces, as the engine's nodes converge to them."""
    size = np.array([[WIDTH, HEIGHT]])
    pull, moment = exact_magnets.rectangle_pull(offset[None], np.array([turn]), size, size, 60, 30)
    return pull[0], moment[0]


@pytest.mark.parametrize("aside", [0.0, 0.0015, 0.004, 0.009])
def test_sixteen_nodes_meet_the_closed_form_at_one_millimetre(aside):
    offset = np.array([aside, 0.001])
    closed, _ = exact_force(offset, 0.0)
    found, _ = strip_force(16, offset, 0.0)
    np.testing.assert_allclose(found, closed, rtol=0, atol=1e-4 * np.hypot(*closed))


@pytest.mark.parametrize("turn", [0.0, 0.2, 0.6, 1.2, np.pi / 2, 2.5])
def test_sixteen_nodes_meet_the_converged_force_between_turned_faces(turn):
    # The near edge of the turned face is a millimetre away.
    offset = np.array([0.001, 0.001 + WIDTH / 2 * abs(np.sin(turn))])
    force, torque = exact_force(offset, turn)
    found, moment = strip_force(16, offset, turn)
    np.testing.assert_allclose(found, force, rtol=0, atol=1e-4 * np.hypot(*force))
    assert moment == pytest.approx(torque, abs=1e-4 * np.hypot(*force) * WIDTH)


def error(scene, found, exact):
    """Largest error of a force, or of a torque over the side, in flush forces."""
    force = np.hypot(*(found[0] - exact[0]).T).max()
    torque = np.abs(found[1] - exact[1]).max() / SIDE
    return max(force, torque) / exact_magnets.flush_force(scene)


def slide(rng):
    """Place a casing anywhere along a side of another one, flush or nearly so."""
    tilt = rng.choice([0.0, 0.05]) * rng.uniform(-1.0, 1.0)
    gap = SIDE * (1.0 + np.abs(np.sin(tilt))) + rng.choice([0.0, 1e-3]) * rng.random()
    places = np.array([[0.0, 0.0], [rng.uniform(-1.2, 1.2) * SIDE, gap]])
    headings = np.pi / 4 + np.array([0.0, rng.integers(4) * np.pi / 2 + tilt])
    return places, headings


# Few of what is drawn at random, and many.
FEW_OR_MANY = [pytest.param(1, id="few"), pytest.param(5, id="many", marks=pytest.mark.slow)]


@pytest.fixture(scope="module", params=FEW_OR_MANY)
def scattered(request):
    """Pairs of casings that do not overlap, at any angle or sliding past each other; forces."""
    rng = np.random.default_rng(17)
    pairs = []
    for k in range(60 * request.param):
        scene = scene_of(rng, 2, "strips")
        pose = scatter(rng, 2, rng.choice([1e-4, 1e-3])) if k % 2 else slide(rng)
        pairs.append((scene, pose, Casings(scene.replace(magnets={"nodes": EXACT})).forces(*pose)))
    return pairs


@pytest.mark.parametrize("bound", BOUNDS)
def test_bound_holds_for_pairs_that_do_not_overlap(bound, scattered):
    worst = 0.0
    for scene, pose, exact in scattered:
        found = Casings(scene.replace(magnets={"accuracy": bound})).forces(*pose)
        worst = max(worst, error(scene, found, exact))
    assert worst <= bound


def far_apart(rng, spread):
    """Place a casing from nearly touching to `spread` sides away."""
    bearing, first, second = rng.uniform(-np.pi, np.pi, 3)
    distance = SIDE * rng.uniform(np.sqrt(2), spread)
    places = distance * np.array([[0.0, 0.0], [np.cos(bearing), np.sin(bearing)]])
    return places, np.array([first, second])


GEOMETRIES = {
    "default": {},
    "narrow and thick": {"width": 0.003, "height": 0.003, "thickness": 0.004},
    "wide and thin": {"width": 0.011, "height": 0.011, "thickness": 0.0005, "inset": 0.0001},
    "high": {"height": 0.012},
}


@pytest.mark.parametrize("bound", [*BOUNDS, 1e-6])
@pytest.mark.parametrize("geometry", GEOMETRIES)
@pytest.mark.parametrize("times", FEW_OR_MANY)
def test_bound_holds_for_pairs_far_apart(times, bound, geometry):
    rng = np.random.default_rng(20)
    worst = 0.0
    for _ in range(30 * times):
        scene = scene_of(rng, 2, "strips").replace(magnets=GEOMETRIES[geometry])
        pose = far_apart(rng, rng.choice([2.0, 3.0, 6.0, 12.0]))
        exact = Casings(scene.replace(magnets={"nodes": EXACT})).forces(*pose)
        found = Casings(scene.replace(magnets={"accuracy": bound})).forces(*pose)
        worst = max(worst, error(scene, found, exact))
    assert worst <= bound


@pytest.fixture(scope="module")
def folded():
    """Chains that are folded, or nearly, and their forces."""
    rng = np.random.default_rng(18)
    chains = []
    for word in folded_words(6):
        scene = scene_of(rng, 6, "strips")
        joints = word_to_angles(word) * rng.choice([1.0, 0.98, 0.8])
        angles = np.concatenate([[0.0], np.cumsum(joints)])
        exact = mf.forces(scene.replace(magnets={"nodes": EXACT}), angles)
        chains.append((scene, angles, exact))
    return chains


@pytest.mark.parametrize("bound", BOUNDS)
def test_bound_holds_for_folded_chains(bound, folded):
    worst = 0.0
    for scene, angles, exact in folded:
        found = mf.forces(scene.replace(magnets={"accuracy": bound}), angles)
        worst = max(worst, error(scene, found, exact))
    assert worst <= bound


def facing_pairs(rng, distance, count):
    """Pairs of pole faces of casings that do not overlap, their centres `distance` apart.

    The first face's places (count, 2) and directions (count,) in the frame of the second.
    """
    draws = 400 * count
    depths = rng.choice([SIDE / 2 - 0.0005, SIDE / 2 - 0.003], (2, draws))
    bearing, turn = rng.uniform(-np.pi, np.pi, (2, draws))
    offset = distance * np.exp(1j * bearing)
    # Faces lie along their x; their casings' centres are a depth along their −y.
    between = offset - 1j * depths[0] * np.exp(1j * turn) + 1j * depths[1]
    reach = SIDE / 2 * (1.0 + np.abs(np.cos(turn)) + np.abs(np.sin(turn)))
    turned = between * np.exp(-1j * turn)
    sides = np.abs([between.real, between.imag, turned.real, turned.imag])
    apart = np.flatnonzero(sides.max(axis=0) >= reach)[:count]
    assert apart.size == count
    return np.stack([offset.real, offset.imag], axis=1)[apart], turn[apart]


# Entries of the table in `quadrature`: nodes, distance of the faces' centres, largest error.
ENTRIES = [
    (2, 0.007, 9e-3),
    (2, 0.012, 3e-4),
    (3, 0.007, 1e-3),
    (3, 0.0085, 1e-4),
    (4, 0.005, 1e-2),
    (4, 0.007, 2e-4),
    (6, 0.005, 1e-3),
    (8, 0.007, 9e-8),
    (12, 0.001, 3e-4),
    (16, 0.001, 2e-5),
]


@pytest.mark.medium
@pytest.mark.parametrize(("nodes", "distance", "stated"), ENTRIES)
def test_error_map_is_as_stated(nodes, distance, stated):
    rng = np.random.default_rng(19)
    flush = abs(exact_force(np.array([0.0, 0.001]), 0.0)[0][1])
    # Nearer than that only flush casings come: one pose.
    poses = ([[0.0, distance]], [np.pi]) if distance <= 0.001 else facing_pairs(rng, distance, 1000)
    worst = 0.0
    for offset, turn in zip(*poses, strict=True):
        exact, _ = strip_force(EXACT, offset, turn)
        found, _ = strip_force(nodes, offset, turn)
        worst = max(worst, np.hypot(*(found - exact)) / flush)
    assert stated / 2 <= worst <= 2 * stated


def test_nodes_that_are_given_are_used():
    assert choose_rule(Magnets(nodes=7)).counts == (7,)
    assert choose_rule(Magnets(model="points")).counts == (3,)
    assert choose_rule(Magnets(model="points", nodes=30)).counts == (30,)


def test_a_tighter_bound_never_takes_fewer_nodes():
    rules = [choose_rule(Magnets(accuracy=bound)) for bound in (5e-2, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8)]
    counts = np.array([rule.counts for rule in rules])
    assert (np.diff(counts, axis=0) >= 0).all()
    assert all(rule.radii[1] > rule.radii[2] for rule in rules)
    assert all(rule.ranks[-1] == rule.counts[0] for rule in rules)


@pytest.mark.parametrize("bound", [*BOUNDS, 1e-6, 1e-8])
def test_one_blend_of_ranks_ends_before_the_next_begins(bound):
    radii = choose_rule(Magnets(accuracy=bound)).rank_radii
    assert all(near * SPREAD <= far for far, near in pairwise(radii))


def test_only_magnets_nearer_than_the_tables_are_graded():
    scene = Scene(sequence=("NNNN",))
    assert not pack_magnets(scene).graded.any()
    assert not pack_magnets(scene.replace(magnets={"inset": 0.0004, "nodes": 5})).graded.any()
    graded = pack_magnets(scene.replace(magnets={"inset": 0.0004})).graded
    # Inner faces are farther away.
    assert graded[:4, :4].all()
    assert graded.sum() == 16
