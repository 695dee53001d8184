"""Long chains: segments that act on each other as one, against sums over all pairs."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from magfold_bench.laws import exact_magnets
from magfold_bench.magnets.samples import folded, unfolded
from magfold_env.engine.magnets import multipole_tree
from magfold_env.engine.magnets import pairs as magnets
from magfold_env.engine.state import Loads, Pose
from magfold_env.engine.workspace import new_nodes
from magfold_env.scene import Magnets, Scene
from magfold_env.simulation.pack import charges, pack_magnets
from tests.engine import reference
from tests.engine.magnets.test_pairs import random_sequence

SIDE = 0.0125
BOUNDS = [5e-2, 1e-2, 1e-3, 1e-4, 1e-6]
seeds = st.integers(0, 2**32 - 1)


class Long:
    """Casings of a long chain, anywhere, under the engine's sums."""

    def __init__(self, sequence, accuracy=1e-3, far=True):
        self.scene = Scene(sequence=sequence, magnets=Magnets(accuracy=accuracy))
        rule = pack_magnets(self.scene)
        self.rule = rule if far else rule._replace(far_radius=np.inf, group_radius=np.inf)
        self.charge = charges(self.scene)
        self.nodes = new_nodes(self.rule, self.scene.n)

    def pose(self, headings):
        places = reference.centres(np.append(headings, [0.0, 0.0]), SIDE)
        return Pose(np.cos(headings), np.sin(headings), places[:, 0].copy(), places[:, 1].copy())

    def forces(self, headings, first=0):
        n = self.scene.n
        loads = Loads(*np.zeros((3, n)))
        magnets.add_forces(first, self.rule, self.charge, self.pose(headings), self.nodes, loads)
        return np.stack([loads.fx, loads.fy], axis=1), loads.torque

    def energy(self, headings):
        return magnets.energy(0, self.rule, self.charge, self.pose(headings), self.nodes)

    def pairs(self, headings):
        """How many pairs of single casings are listed, and how many times."""
        pose, parts = self.pose(headings), self.nodes.segments
        loads = Loads(*np.zeros((3, self.scene.n)))
        magnets.add_forces(0, self.rule, self.charge, pose, self.nodes, loads)
        multipole_tree.begin(0, pose.x, pose.y, parts)
        counts = []
        while not counts or counts[-1]:
            rule = self.rule.group_radius, self.rule.group_terms
            counts.append(multipole_tree.list_pairs(0, 0, self.scene.n, *rule, False, parts)[0])
        return sum(counts), len(counts)


def aligned_sequence(n):
    """Front faces N, back faces S: moments all along the headings."""
    return ("NSSN",) * n


def bent(rng, n):
    """A chain that wanders: joints of up to 0.6 rad."""
    return np.cumsum(rng.uniform(-0.6, 0.6, n))


SHAPES = {
    "unfolded": lambda _, n: unfolded(n),
    "folded": lambda _, n: folded(n),
    "bent": bent,
}


def error(found, exact, scene):
    force = np.hypot(*(found[0] - exact[0]).T).max()
    return max(force, np.abs(found[1] - exact[1]).max() / SIDE) / exact_magnets.flush_force(scene)


@pytest.mark.parametrize("bound", BOUNDS)
@pytest.mark.parametrize("shape", sorted(SHAPES))
@pytest.mark.parametrize("n", [24, 37, 64, 150])
def test_segments_stay_far_within_the_bound(n, shape, bound):
    rng = np.random.default_rng(41)
    for sequence in (random_sequence(rng, n), aligned_sequence(n)):
        headings = SHAPES[shape](rng, n)
        exact = Long(sequence, bound, far=False).forces(headings)
        chain = Long(sequence, bound)
        assert error(chain.forces(headings), exact, chain.scene) <= 0.4 * bound


@pytest.mark.parametrize("bound", BOUNDS)
@pytest.mark.parametrize("shape", sorted(SHAPES))
def test_bound_holds_for_chains_of_sixty(shape, bound):
    rng = np.random.default_rng(46)
    sequence, headings = random_sequence(rng, 60), SHAPES[shape](rng, 60)
    chain = Long(sequence, bound)
    many = chain.scene.replace(magnets={"nodes": 32})
    exact = Long(sequence, bound, far=False)
    exact.rule = pack_magnets(many)
    exact.nodes = new_nodes(exact.rule, 60)
    assert error(chain.forces(headings), exact.forces(headings), chain.scene) <= bound


@pytest.mark.laws
@pytest.mark.parametrize("bound", [1e-2, 1e-3])
@pytest.mark.parametrize("shape", sorted(SHAPES))
def test_forces_are_the_gradient_of_the_energy(shape, bound):
    rng = np.random.default_rng(42)
    n = 45
    chain = Long(random_sequence(rng, n), bound)
    # Shrunk a little at random, so that no distance lies on an edge of a blend.
    headings = SHAPES[shape](rng, n) * 0.97 + rng.normal(0.0, 0.01, n)
    force, torque = chain.forces(headings)
    jacobian = reference.velocity_map(np.append(headings, [0.0, 0.0]), SIDE)[:, :, :n]
    found = np.einsum("idk,id->k", jacobian, force) + torque
    for _ in range(6):
        turn = rng.normal(size=n)
        slope = -reference.derivative(lambda t, d=turn: chain.energy(headings + t * d), 2e-5)
        assert found @ turn == pytest.approx(slope, abs=1e-8 * float(np.linalg.norm(found)))


@given(seed=seeds, first=st.integers(1, 39))
def test_components_that_do_not_act_yet_are_left_out(seed, first):
    rng = np.random.default_rng(seed)
    sequence, headings = random_sequence(rng, 40), unfolded(40)
    chain = Long(sequence)
    chain.charge[:first] = 0.0
    force, torque = chain.forces(headings, first)
    # The same components by themselves, the inner ones uncharged but there.
    exact = Long(sequence, far=False)
    exact.charge[:first] = 0.0
    assert error((force, torque), exact.forces(headings), chain.scene) <= 0.4e-3
    assert not force[:first].any()
    assert not torque[:first].any()


@pytest.mark.parametrize(("shape", "most"), [("unfolded", 1.05), ("folded", 1.3)])
def test_pairs_grow_little_faster_than_the_chain(shape, most):
    rng = np.random.default_rng(44)
    lengths = np.array([300, 3000])
    counts = [Long(("NSSN",) * n).pairs(SHAPES[shape](rng, n))[0] for n in lengths]
    assert np.diff(np.log(counts)) / np.diff(np.log(lengths)) <= most
