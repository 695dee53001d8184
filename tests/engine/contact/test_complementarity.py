"""Multipliers: their optimality conditions, an independent solver, and Moreau's impact."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from magfold_env.engine import entries as at
from magfold_env.engine.chain.feed import place_all
from magfold_env.engine.contact import boxes
from magfold_env.engine.contact.complementarity import solve_nonnegative
from magfold_env.engine.stepping import dynamics
from magfold_env.engine.workspace import new_state, new_work
from magfold_env.scene import Scene
from magfold_env.simulation.pack import pack
from tests.engine import reference

SIDE = 0.0125
seeds = st.integers(0, 2**32 - 1)


def chain_of(n, *, mount="free"):
    """Scene and model of a chain without magnets."""
    scene = Scene(sequence=("NNNN",) * n, magnets=None).replace(mount=mount)
    return scene, pack(scene)


def workspace(n=8):
    return new_work(chain_of(n)[1])


def load(work, rows, bias, equality=()):
    """Pose the problem w = G Gᵀ λ + b for the rows G (m, k)."""
    m = len(rows)
    work.rows.delassus[:m, :m] = rows @ rows.T
    work.rows.bias[:m] = bias
    work.rows.equality[:m] = 0
    work.rows.equality[list(equality)] = 1
    work.rows.passive[:m] = 1
    work.rows.multiplier[:m] = 0.0
    return m


def draw_rows(rng, most):
    """Rows of any rank; some repeat others, exactly, scaled or as sums."""
    rows = rng.normal(size=(rng.integers(1, most + 1), rng.integers(1, 9)))
    copies = rows[rng.integers(len(rows), size=rng.integers(0, 4))]
    sums = rows[:1] + rows[-1:]
    return np.concatenate([rows, copies, 2.0 * copies, sums])


@given(seed=seeds)
def test_multipliers_satisfy_their_conditions(seed):
    rng = np.random.default_rng(seed)
    work, rows = workspace(), draw_rows(rng, 10)
    # b = G u: that some w is possible is what a chain's constraints guarantee.
    m = load(work, rows, rows @ rng.normal(size=rows.shape[1]))
    work.rows.passive[:m] = rng.integers(0, 2, m)
    assert solve_nonnegative(m, work)
    lam = work.rows.multiplier[:m]
    w = work.rows.delassus[:m, :m] @ lam + work.rows.bias[:m]
    scale = np.abs(work.rows.bias[:m]).max()
    assert lam.min() >= 0.0
    assert w.min() >= -1e-8 * scale
    assert np.abs(lam * w).max() <= 1e-8 * scale * (1.0 + lam.max())


@given(seed=seeds)
def test_equalities_hold_with_either_sign(seed):
    rng = np.random.default_rng(seed)
    work, rows = workspace(), rng.normal(size=(6, 9))
    m = load(work, rows, rows @ rng.normal(size=9), equality=(1, 4))
    assert solve_nonnegative(m, work)
    lam = work.rows.multiplier[:m]
    w = work.rows.delassus[:m, :m] @ lam + work.rows.bias[:m]
    free = np.array([0, 2, 3, 5])
    assert np.abs(w[[1, 4]]).max() <= 1e-8
    assert lam[free].min() >= 0.0
    assert w[free].min() >= -1e-8
    assert np.abs((lam * w)[free]).max() <= 1e-8


class Impact:
    """A random chain with stops and contacts, whose velocities may violate them."""

    def __init__(self, rng, mount):
        n = int(rng.integers(5, 10))
        self.scene, self.model = chain_of(n, mount=mount)
        self.state, self.work = new_state(self.model, np.zeros(n)), new_work(self.model)
        q, work = self.state.q, self.work
        q[:n] = np.cumsum(rng.uniform(-np.pi / 2, np.pi / 2, n))
        place_all(0, self.model, q, work.pose)
        boxes.place_boxes(0, self.model, work.pose, work)
        joints = rng.choice(np.arange(1, n), int(rng.integers(1, n)), replace=False)
        for r, joint in enumerate(joints):
            work.rows.id[r, :2] = joint, rng.choice([-1, 1])
        self.stops = row = len(joints)
        work.rows.counts[at.JOINT_STOPS] = row
        # Rows are linear: for the projection it does not matter how large their gaps are.
        for _ in range(int(rng.integers(0, 4))):
            i = int(rng.integers(0, n - 4))
            work.rows.id[row, :3] = i, rng.integers(i + 4, n), rng.integers(4)
            row += 1
        if row < n:  # the same contact twice, as in closed loops
            work.rows.id[row] = work.rows.id[row - 1]
            row += row > len(joints)
        work.rows.counts[1:] = row
        self.rows = row
        self.free = n + 2 if mount == "free" else n
        self.before = np.append(rng.normal(0.0, 10.0, n), rng.normal(0.0, 0.3, 2))
        self.before[self.free :] = 0.0

    def project(self, slow=-1.0):
        after = self.before.copy()
        assert dynamics.project(self.model, self.state, after, self.work, slow)
        return after

    @property
    def jacobian(self):
        return self.work.rows.jacobian[: self.rows, : self.free]

    @property
    def mass(self):
        scene = self.scene
        matrix = reference.mass_matrix(self.state.q, SIDE, scene.masses, scene.inertias)
        return matrix[: self.free, : self.free]


mounts = st.sampled_from(["free", "pinned"])


@pytest.mark.laws
@given(seed=seeds, mount=mounts)
def test_impact_lets_nothing_approach_and_gains_no_energy(seed, mount):
    impact = Impact(np.random.default_rng(seed), mount)
    after, before = impact.project()[: impact.free], impact.before[: impact.free]
    rate = np.abs(impact.jacobian @ before).max()
    # The ridge that picks one of many impulses costs this much where rows nearly repeat.
    assert (impact.jacobian @ after).min() >= -1e-8 * rate
    energy = before @ impact.mass @ before
    assert after @ impact.mass @ after <= energy * (1 + 1e-12)


@given(seed=seeds, mount=mounts)
def test_corners_that_part_slowly_stay_together(seed, mount):
    impact = Impact(np.random.default_rng(seed), mount)
    apart = impact.jacobian @ impact.project()[: impact.free]
    rate = np.abs(impact.jacobian @ impact.before[: impact.free]).max()
    after = impact.jacobian @ impact.project(1e9)[: impact.free]
    assert after.min() >= -1e-6 * rate
    slow = (apart > 1e-3 * rate) & (np.arange(len(apart)) >= impact.stops)
    np.testing.assert_allclose(after[slow], 0.0, rtol=0, atol=1e-6 * rate)
