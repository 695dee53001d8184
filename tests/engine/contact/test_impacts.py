"""Tests of velocities after random impacts against an independent projection."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import nnls

from magfold_bench.laws.random_scenes import random_word
from magfold_env.engine import indices as ix
from magfold_env.engine.chain.tube import place_all
from magfold_env.engine.contact import boxes
from magfold_env.engine.stepping import dynamics
from magfold_env.engine.workspace import new_state, new_work
from magfold_env.scene import Scene
from magfold_env.shapes import FloatArray, word_to_angles
from magfold_env.simulation.pack import pack
from tests.engine import reference


def nearest_admissible(
    mass: FloatArray, jacobian: FloatArray, velocity: FloatArray
) -> tuple[FloatArray, float]:
    """Return the nearest velocity with J v ≥ 0 in the metric of a mass matrix, and its uncertainty.

    The uncertainty is the violation of the optimality conditions, relative to the speed before.
    """
    # With M = L Lᵀ the distance is Euclidean in Lᵀ v, and the dual a non-negative least squares.
    lower = np.linalg.cholesky(mass)
    cone = np.linalg.solve(lower, jacobian.T)
    length = np.linalg.norm(cone, axis=0)
    cone = cone[:, length > 0.0] / length[length > 0.0]
    if cone.size == 0:  # which SciPy does not take
        return velocity, 0.0
    before = lower.T @ velocity
    taken = np.flatnonzero(nnls(cone, -before)[0])
    change = cone[:, taken] @ np.linalg.lstsq(cone[:, taken], -before, rcond=None)[0]
    after = before + change
    doubt = max(-float((cone.T @ after).min(initial=0.0)), abs(float(after @ change)))
    return np.linalg.solve(lower.T, after), doubt / max(float(np.linalg.norm(before)), 1e-300)


SMALLEST, LARGEST = 5, 12  # components; four apart, squares can meet
PINNED = 0.3  # share of the chains
MOST_CONTACTS = 4
NEVER_SLOW = -1.0  # keeps the rule that ends rocking, which is no part of the law, out of this
CERTAIN = 1e-13  # doubt up to which the independent projection counts


class Impact:
    """A random chain with stops and contacts, whose velocities may violate them.

    Odd seeds give folded shapes with most joints at their stops; even seeds give any shape.
    """

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng([seed, 3])
        n = int(rng.integers(SMALLEST, LARGEST + 1))
        mount = "pinned" if rng.random() < PINNED else "free"
        self.scene = Scene(sequence=("NNNN",) * n, magnets=None, mount=mount)
        self.model = model = pack(self.scene)
        self.state, self.work = new_state(model, np.zeros(n)), new_work(model)
        work, rows = self.work, self.work.rows
        joints, share = rng.uniform(-np.pi / 2, np.pi / 2, n - 1), 0.5
        if seed % 2 == 1:
            joints, share = word_to_angles(random_word(rng, n)), 0.9
        self.state.q[1:n] = np.cumsum(joints)
        place_all(0, model, self.state.q, work.pose)
        boxes.place_boxes(0, model, work.pose, work)
        at_stop = np.flatnonzero(rng.random(n - 1) < share)
        for row, joint in enumerate(at_stop):
            rows.id[row, :2] = joint + 1, 1 if joints[joint] > 0.0 else -1
        rows.counts[ix.JOINT_STOPS] = self.stops = row = len(at_stop)
        for _ in range(int(rng.integers(0, MOST_CONTACTS + 1))):
            # Rows are linear: for the projection it does not matter how wide the gaps are.
            i = int(rng.integers(0, n - boxes.APART)) if n > boxes.APART else 0
            rows.id[row, :3] = i, rng.integers(i + boxes.APART, n), rng.integers(4)
            row += 1
        if row > self.stops:  # the same contact twice, as in closed loops
            rows.id[row] = rows.id[row - 1]
            row += 1
        rows.counts[1:] = row
        free = n + 2 if mount == "free" else n
        self.rows, self.free = slice(row), slice(free)
        self.before = np.append(rng.normal(0.0, 10.0, n), rng.normal(0.0, 0.3, 2))
        self.before[free:] = 0.0

    def project(self, slow: float = NEVER_SLOW) -> FloatArray:
        """Return the engine's velocity after the impact.

        Raises
        ------
        ArithmeticError
            If it finds none.
        """
        after = self.before.copy()
        if not dynamics.project(self.model, self.state, after, self.work, slow):
            raise ArithmeticError("no velocity after the impact")
        return after[self.free]

    @property
    def jacobian(self) -> FloatArray:
        """Return the rows of the stops and contacts after the projection."""
        return self.work.rows.jacobian[self.rows, self.free]

    @property
    def mass(self) -> FloatArray:
        """Return the mass matrix."""
        scene = self.scene
        matrix = reference.mass_matrix(
            self.state.q, scene.casing.side, scene.masses, scene.inertias
        )
        return matrix[self.free, self.free]


def impact_error(seed: int) -> float | None:
    """Return the error of the velocity after a random impact.

    The distance from the independent projection in the metric of the mass matrix, relative to
    the speed before. None if the independent projection is uncertain.
    """
    impact = Impact(seed)
    before, after, mass = impact.before[impact.free], impact.project(), impact.mass
    expected, doubt = nearest_admissible(mass, impact.jacobian, before)
    off = after - expected
    return float(np.sqrt(off @ mass @ off / (before @ mass @ before))) if doubt <= CERTAIN else None


@pytest.mark.laws
@pytest.mark.parametrize(
    "seeds", [range(0, 60, 2), pytest.param(range(400), marks=pytest.mark.weekly)]
)
def test_impacts_are_projections(seeds):
    errors = [impact_error(seed) for seed in seeds]
    assert max(error for error in errors if error is not None) <= 1e-8


@pytest.mark.laws
@given(seed=st.integers(0, 2**32 - 1))
def test_impact_lets_nothing_approach_and_gains_no_energy(seed):
    impact = Impact(seed)
    after, before = impact.project(), impact.before[impact.free]
    rate = np.abs(impact.jacobian @ before).max(initial=0.0)
    # The ridge that picks one of many impulses costs this much where rows nearly repeat.
    assert (impact.jacobian @ after).min(initial=0.0) >= -1e-8 * rate
    energy = before @ impact.mass @ before
    assert after @ impact.mass @ after <= energy * (1 + 1e-12)


@given(seed=st.integers(0, 2**32 - 1))
def test_corners_that_part_slowly_stay_together(seed):
    impact = Impact(seed)
    apart = impact.jacobian @ impact.project()
    rate = np.abs(impact.jacobian @ impact.before[impact.free]).max(initial=0.0)
    after = impact.jacobian @ impact.project(1e9)
    assert after.min(initial=0.0) >= -1e-6 * rate
    slow = (apart > 1e-3 * rate) & (np.arange(len(apart)) >= impact.stops)
    np.testing.assert_allclose(after[slow], 0.0, rtol=0, atol=1e-6 * rate)
