"""Tests that the nodes of far pole faces keep the error bound; near ones may be graded."""

import numpy as np
import pytest

from magfold_env.scene import Scene
from magfold_env.simulation.pack import pack_magnets
from tests.engine.magnets.test_pairs import Casings, error, scene_of

SIDE = 0.0125
EXACT = 24  # nodes that leave 1e-7 where casings lie flush, and less elsewhere
BOUNDS = [5e-2, 1e-2, 1e-3, 1e-4]


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
