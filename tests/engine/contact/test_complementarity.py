"""Tests of multipliers and their optimality conditions."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from magfold_env.engine.contact.complementarity import solve_nonnegative, take_least
from magfold_env.engine.workspace import new_work
from magfold_env.scene import Scene
from magfold_env.simulation.pack import pack

seeds = st.integers(0, 2**32 - 1)


def workspace(n=8):
    return new_work(pack(Scene(sequence=("NNNN",) * n, magnets=None)))


def load(work, rows, bias, equality=()):
    """Set up the problem w = G Gᵀ λ + b for the rows G (m, k)."""
    m = len(rows)
    work.rows.delassus[:m, :m] = rows @ rows.T
    work.rows.bias[:m] = bias
    work.rows.equality[:m] = 0
    work.rows.equality[list(equality)] = 1
    work.rows.passive[:m] = 1
    work.rows.multiplier[:m] = 0.0
    return m


def draw_rows(rng, most):
    """Draw rows of any rank; some are copies, multiples or sums of others."""
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


@given(seed=seeds, apart=st.floats(-13.0, -2.0))
def test_the_least_multipliers_change_the_velocities_equally(seed, apart):
    rng = np.random.default_rng(seed)
    work, rows = workspace(), rng.normal(size=(5, 9))
    # Two opposite rows: a component that both press, or a wedge that it is driven into.
    rows[1] = -rows[0] + 10.0**apart * rng.normal(size=9)
    m = load(work, rows, np.zeros(5))
    lam = rng.uniform(0.0, 1.0, m)
    lam[:2] += 1e5
    work.rows.multiplier[:m] = lam
    take_least(m, work)
    least = work.rows.multiplier[:m]
    before, after = lam @ rows, least @ rows
    assert np.linalg.norm(after - before) <= 0.011 * np.linalg.norm(before)
    if apart < -9.0:
        assert np.abs(least).max() < 1e4
