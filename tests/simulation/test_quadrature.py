"""The nodes of a pole face: exactness near, the error bound everywhere, the table it rests on."""

import numpy as np
import pytest

from magfold_bench.laws import exact_magnets
from magfold_env.engine.magnets import pairs
from magfold_env.engine.workspace import new_nodes
from magfold_env.scene import Magnets, Scene
from magfold_env.simulation.pack import pack_magnets
from tests.engine.magnets.test_pairs import Casings, scene_of

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


def error(scene, found, exact):
    """Largest error of a force, or of a torque over the side, in flush forces."""
    force = np.hypot(*(found[0] - exact[0]).T).max()
    torque = np.abs(found[1] - exact[1]).max() / SIDE
    return max(force, torque) / exact_magnets.flush_force(scene)


# Few of what is drawn at random, and many.
FEW_OR_MANY = [pytest.param(1, id="few"), pytest.param(5, id="many", marks=pytest.mark.slow)]


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


def test_only_magnets_nearer_than_the_tables_are_graded():
    scene = Scene(sequence=("NNNN",))
    assert not pack_magnets(scene).graded.any()
    assert not pack_magnets(scene.replace(magnets={"inset": 0.0004, "nodes": 5})).graded.any()
    graded = pack_magnets(scene.replace(magnets={"inset": 0.0004})).graded
    # Inner faces are farther away.
    assert graded[:4, :4].all()
    assert graded.sum() == 16
