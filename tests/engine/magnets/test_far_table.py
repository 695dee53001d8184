"""Tests of tables for casings at least three joints apart, against sums over many nodes."""

import math
from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from magfold_bench.laws import exact_magnets
from magfold_env.engine.magnets import pairs
from magfold_env.engine.magnets.chain import apart, invalidate_cache
from magfold_env.engine.workspace import new_work
from magfold_env.scene import Magnets, Scene
from magfold_env.simulation.pack import pack
from tests.engine import reference
from tests.engine.magnets.test_pairs import Casings, assert_gradient, gradient

SIDE = 0.0125
BOUND = 1e-3  # of the flush force: the finest accuracy that the table serves
EXACT = 24  # nodes that leave 1e-7 where casings lie flush, and less elsewhere
GEOMETRIES = {
    "the paper's": Magnets(),
    "narrow and deep": Magnets(width=0.004, thickness=0.003, inset=0.0008),
    "low": Magnets(height=0.003),
}
seeds = st.integers(0, 2**32 - 1)


class Pair(Casings):
    """Two casings that the kernels of the dynamics evaluate."""

    def __init__(self, scene):
        self.scene = scene
        self.model = pack(scene)
        self.work = new_work(self.model)
        assert self.model.magnets.tables.far.end > 0.0

    def acts(self, places, headings, *, with_energy=True, kept=False):
        """Return the forces (2, 2), torques (2,) and energy."""
        pose, nodes, model = self.pose(places, headings), self.work.nodes, self.model
        if not kept:
            invalidate_cache(nodes)
        pairs.spread_charges(model.magnets, model.charge, nodes)
        pairs.turn_casings(0, model.magnets, pose, nodes)
        energy, x, y, torque = apart(
            model.magnets, model.charge, pose, headings[1] - headings[0], nodes, 0, 1, with_energy
        )
        ex, ey = places[1] - places[0]
        return np.array([[x, y], [-x, -y]]), np.array([torque, ex * y - ey * x - torque]), energy

    def forces(self, places, headings):
        return self.acts(places, headings, with_energy=False)[:2]

    def energy(self, places, headings):
        return self.acts(places, headings)[2]

    def crosses_an_edge(self, first, second):
        return False  # third derivatives jump, but at every cell


@cache
def pair_of(geometry, faces=("NSNS", "NNSS")):
    return Pair(Scene(sequence=faces, magnets=GEOMETRIES[geometry]))


def touching(rng, *, flush=False):
    """Draw places and headings of two casings that touch or almost touch."""
    bearing, headings = rng.uniform(-np.pi, np.pi), rng.uniform(-np.pi, np.pi, 2)
    if flush:
        headings[1] = headings[0] + np.pi / 2 * rng.integers(4) + rng.choice([0.0, 1e-3, 0.02])
    body = reference.square(np.zeros(2), headings[0], SIDE / 2)
    line = np.array([np.cos(bearing), np.sin(bearing)])
    low, high = 0.9 * SIDE, 1.5 * SIDE
    for _ in range(40):
        middle = (low + high) / 2
        other = reference.square(middle * line, headings[1], SIDE / 2)
        low, high = (low, middle) if reference.separation(body, other) > 0 else (middle, high)
    return (high + rng.choice([0.0, 1e-5, 3e-4])) * np.array([0.0 * line, line]), headings


def away(rng):
    """Draw places and headings of two casings within the table's range or slightly beyond."""
    bearing, headings = rng.uniform(-np.pi, np.pi), rng.uniform(-np.pi, np.pi, 2)
    reach = SIDE * math.sqrt(2) * rng.uniform(1.0, 9.0)
    return reach * np.array([[0.0, 0.0], [np.cos(bearing), np.sin(bearing)]]), headings


def errors(pair, places, headings):
    """Return the largest errors of forces, and of torques and the energy over the side."""
    exact = reference.magnet_forces(places, headings, pair.scene, EXACT)
    sizes = np.array([1.0, SIDE, SIDE]) * exact_magnets.flush_force(pair.scene)
    found = zip(pair.acts(places, headings), exact, sizes, strict=True)
    return [np.abs(one - other).max() / size for one, other, size in found]


@pytest.mark.medium
@pytest.mark.parametrize("geometry", sorted(GEOMETRIES))
def test_forces_torques_and_energies_keep_the_bound(geometry):
    rng = np.random.default_rng(61)
    for k in range(60):
        faces = ["".join(rng.choice(list("NS-" if k % 5 == 0 else "NS"), 4)) for _ in range(2)]
        pair = Pair(Scene(sequence=tuple(faces), magnets=GEOMETRIES[geometry]))
        poses = [touching(rng), touching(rng, flush=True), away(rng)]
        assert max(max(errors(pair, *pose)) for pose in poses) <= BOUND


@pytest.mark.laws
@given(seed=seeds)
def test_forces_and_torques_are_the_energys_gradient(seed):
    rng = np.random.default_rng(seed)
    pair = pair_of("the paper's")
    pose = touching(rng, flush=bool(seed % 2)) if seed % 3 else away(rng)
    # Third derivatives jump between cells of the table: a step of 1e-6 m across is 1e-7 off.
    assert_gradient(pair, *pose, gradient(pair, *pose, step=1e-6), within=3e-7)


@pytest.mark.medium
def test_what_is_kept_is_a_function_of_charges_and_cell():
    rng = np.random.default_rng(64)
    pair = pair_of("the paper's")
    for _ in range(300):
        pose = away(rng) if rng.random() < 0.5 else touching(rng)
        fresh = pair.acts(*pose)
        for shift in (0.0, 1e-9, 1e-4):
            pair.acts(pose[0] + [[0.0], [shift]], pose[1], kept=True)
        again = pair.acts(*pose, kept=True)
        assert all((a == b).all() for a, b in zip(fresh[:2], again[:2], strict=True))
        assert again[2] == fresh[2]
