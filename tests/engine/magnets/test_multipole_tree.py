"""Tests of segments of long chains that interact as one, against sums over all pairs."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from magfold_bench.magnets.samples import folded, unfolded
from magfold_env.engine.magnets import multipole_tree
from magfold_env.scene import Magnets, Scene
from tests.engine import reference
from tests.engine.magnets.test_pairs import Casings, error, random_sequence

SIDE = 0.0125
BOUNDS = [5e-2, 1e-2, 1e-3, 1e-4, 1e-6]
seeds = st.integers(0, 2**32 - 1)


class Long(Casings):
    """A long chain that the engine evaluates; without ``far``, it sums all pairs one by one."""

    def __init__(self, sequence, far=True, **magnets):
        self.scene = Scene(sequence=sequence, magnets=Magnets(**magnets))
        super().__init__(self.scene)
        rule = self.model.magnets
        rule = rule if far else rule._replace(far_radius=np.inf, group_radius=np.inf)
        self.model = self.model._replace(magnets=rule)

    def pairs(self, places, headings):
        """Return the number of listed pairs of single casings."""
        self.forces(places, headings)
        rule, parts, counts = self.model.magnets, self.nodes.segments, [1]
        multipole_tree.begin(0, places[:, 0].copy(), places[:, 1].copy(), parts)
        while counts[-1]:
            found = multipole_tree.list_pairs(0, 0, self.scene.n, rule.group_radius, False, parts)
            counts.append(found[0])
        return sum(counts) - 1


def posed(headings):
    """Return the centres and the headings of a chain."""
    return reference.centres(np.append(headings, [0.0, 0.0]), SIDE), headings


def aligned_sequence(n):
    """Return a sequence with N in front and S behind, so that moments are along the headings."""
    return ("NSSN",) * n


def bent(rng, n):
    """Draw a curved chain with joint angles up to 0.6 rad."""
    return np.cumsum(rng.uniform(-0.6, 0.6, n))


SHAPES = {"unfolded": lambda _, n: unfolded(n), "folded": lambda _, n: folded(n), "bent": bent}


@pytest.mark.parametrize("bound", BOUNDS)
@pytest.mark.parametrize("shape", sorted(SHAPES))
@pytest.mark.parametrize("n", [24, 37, 64, 150])
def test_segments_stay_far_within_the_bound(n, shape, bound):
    rng = np.random.default_rng(41)
    for sequence in (random_sequence(rng, n), aligned_sequence(n)):
        pose = posed(SHAPES[shape](rng, n))
        exact = Long(sequence, accuracy=bound, far=False).forces(*pose)
        chain = Long(sequence, accuracy=bound)
        assert error(chain.scene, chain.forces(*pose), exact) <= 0.4 * bound


@pytest.mark.parametrize("bound", BOUNDS)
@pytest.mark.parametrize("shape", sorted(SHAPES))
def test_bound_holds_for_chains_of_sixty(shape, bound):
    rng = np.random.default_rng(46)
    sequence, pose = random_sequence(rng, 60), posed(SHAPES[shape](rng, 60))
    chain, exact = Long(sequence, accuracy=bound), Long(sequence, nodes=32)
    assert error(chain.scene, chain.forces(*pose), exact.forces(*pose)) <= bound


@pytest.mark.laws
@pytest.mark.parametrize("bound", [1e-2, 1e-3])
@pytest.mark.parametrize("shape", sorted(SHAPES))
def test_forces_are_the_gradient_of_the_energy(shape, bound):
    rng = np.random.default_rng(42)
    n = 45
    chain = Long(random_sequence(rng, n), accuracy=bound)
    # Shrunk a little at random, so that no distance lies on an edge of a blend.
    headings = SHAPES[shape](rng, n) * 0.97 + rng.normal(0.0, 0.01, n)
    force, torque = chain.forces(*posed(headings))
    jacobian = reference.velocity_map(np.append(headings, [0.0, 0.0]), SIDE)[:, :, :n]
    found = np.einsum("idk,id->k", jacobian, force) + torque
    for _ in range(6):
        turn = rng.normal(size=n)
        slope = -reference.derivative(
            lambda t, d=turn: chain.energy(*posed(headings + t * d)), 2e-5
        )
        assert found @ turn == pytest.approx(slope, abs=1e-8 * float(np.linalg.norm(found)))


@given(seed=seeds, first=st.integers(1, 39))
def test_components_that_do_not_act_yet_are_left_out(seed, first):
    rng = np.random.default_rng(seed)
    sequence, pose = random_sequence(rng, 40), posed(unfolded(40))
    chain, exact = Long(sequence), Long(sequence, far=False)
    for each in (chain, exact):
        each.model.charge[:first] = 0.0
    chain.first = first
    force, torque = chain.forces(*pose)
    # The same components by themselves, the inner ones uncharged but there.
    assert error(chain.scene, (force, torque), exact.forces(*pose)) <= 0.4e-3
    assert not force[:first].any()
    assert not torque[:first].any()


@pytest.mark.parametrize(("shape", "most"), [("unfolded", 1.05), ("folded", 1.3)])
def test_pairs_grow_little_faster_than_the_chain(shape, most):
    rng = np.random.default_rng(44)
    lengths = np.array([300, 3000])
    counts = [Long(("NSSN",) * n).pairs(*posed(SHAPES[shape](rng, n))) for n in lengths]
    assert np.diff(np.log(counts)) / np.diff(np.log(lengths)) <= most
