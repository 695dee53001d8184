"""Tests of the friction solver: conditions, another solver, and difficult random scenes."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from magfold_bench.laws.random_scenes import random_scene
from magfold_env.engine import indices as ix
from magfold_env.engine.contact.constraints import begin_step
from magfold_env.engine.friction.solver import solve_with_friction
from magfold_env.engine.friction.sticking import first_accelerations
from magfold_env.engine.workspace import new_work
from magfold_env.scene import Scene
from magfold_env.simulation.pack import pack
from magfold_env.simulation.session import Session

seeds = st.integers(0, 2**32 - 1)


class Problem:
    """Rows G of contacts and equalities, then of friction balls, with w = G (Gᵀ λ + start)."""

    def __init__(self, rows, start, normals, grip, equality=()):
        count = len(rows)
        self.rows, self.start, self.normals, self.friction_limit = rows, start, normals, grip
        # A chain with n components has n + 2 coordinates, and W no larger rank.
        n = max(rows.shape[1] - 2, (count - 15) // 6 + 1, 2)
        self.work = work = new_work(pack(Scene(sequence=("NNNN",) * n, magnets=None)))
        work.rows.delassus[:count, :count] = rows @ rows.T
        work.rows.bias[:count] = rows @ start
        work.rows.equality[list(equality)] = 1
        work.rows.id[normals:count, 0] = np.repeat(np.arange((count - normals) // 3), 3)

    def solve(self):
        return solve_with_friction(self.normals, len(self.rows), self.work, self.friction_limit)

    @property
    def motion(self):
        """Return the effect of the multipliers, which is unique in contrast to them."""
        return self.start + self.rows.T @ self.work.rows.multiplier[: len(self.rows)]


def draw(rng, most_normals=14, most_balls=15):
    """Draw rows of any rank with some copies; some friction limits are zero or very large."""
    normals, balls = int(rng.integers(0, most_normals + 1)), int(rng.integers(1, most_balls + 1))
    rows = rng.normal(size=(normals + 3 * balls, rng.integers(1, 15)))
    for r in range(1, normals):
        if rng.random() < 0.3:
            rows[r] = rows[rng.integers(r)] * rng.choice([0.5, 1.0, 2.0])
    if balls > 1 and rng.random() < 0.3:
        rows[normals : normals + 3] = rows[-3:]
    grip = 10 ** rng.uniform(-3, 1, balls)
    grip[rng.random(balls) < 0.1] = 0.0
    grip[rng.random(balls) < 0.1] = 1e6
    equality = np.flatnonzero(rng.random(normals) < 0.2)
    return Problem(rows, rng.normal(size=rows.shape[1]), normals, grip, equality)


def assert_optimal(work, normals, count, radius, tolerance=1e-9):
    """Check the conditions of the convex problem; ``radius`` contains the balls' limits."""
    lam = work.rows.multiplier[:count]
    w = work.rows.delassus[:count, :count] @ lam + work.rows.bias[:count]
    allowed = tolerance * np.abs(work.rows.bias[:count]).max()
    held = work.rows.equality[:normals] == 1
    push, rate = lam[:normals], w[:normals]
    assert np.abs(rate[held]).max(initial=0.0) <= allowed
    assert push[~held].min(initial=0.0) >= 0.0
    assert rate[~held].min(initial=0.0) >= -allowed
    assert np.minimum(push, np.abs(rate))[~held].max(initial=0.0) <= allowed
    assert_coulomb(lam[normals:].reshape(-1, 3), w[normals:].reshape(-1, 3), radius, allowed)


def assert_coulomb(force, slip, radius, allowed):
    """Check that each ball's friction (balls, 3) opposes its slip, or that it does not slip."""
    size = np.linalg.norm(force, axis=1)
    assert (size <= radius * (1 + 1e-12)).all()
    inside = size < radius * (1 - 1e-9)
    assert np.abs(slip[inside]).max(initial=0.0) <= allowed
    full = ~inside & (radius > 0.0)
    opposed = -np.linalg.norm(slip[full], axis=1) * force[full].T / size[full]
    np.testing.assert_allclose(slip[full], opposed.T, rtol=0, atol=allowed)


@given(seed=seeds)
def test_forces_satisfy_their_conditions(seed):
    problem = draw(np.random.default_rng(seed))
    assert problem.solve()
    assert_optimal(problem.work, problem.normals, len(problem.rows), problem.friction_limit)


def test_grip_that_just_suffices_holds_and_the_impossible_is_not_solved() -> None:
    # One component of unit mass: the force that holds it is opposite to its acceleration.
    problem = Problem(np.eye(3), np.array([0.6, 0.0, 0.8]), 0, np.ones(1))
    assert problem.solve()
    np.testing.assert_allclose(problem.motion, 0.0, rtol=0, atol=1e-12)
    problem = Problem(np.eye(3), np.array([0.6, 0.0, 0.8]), 0, np.array([0.5]))
    assert problem.solve()
    np.testing.assert_allclose(problem.motion, [0.3, 0.0, 0.4], rtol=0, atol=1e-12)
    rows = np.array([[1.0, 0.0], [-1.0, 0.0]])
    problem = Problem(rows, np.zeros(2), 2, np.zeros(0))
    problem.work.rows.bias[:2] = -1.0  # two walls that close in on each other
    assert not problem.solve()
    problem.work.rows.bias[:2] = np.nan
    assert not problem.solve()


@pytest.mark.parametrize("seed", [9, 27, 33])
def test_chains_at_rest_whose_forces_are_far_from_unique(seed):
    # More components stick than there are coordinates.
    session = Session(random_scene(seed))
    model, state, work = session._model, session._state, session._work
    begin_step(model, state, work)
    assert first_accelerations(model, state, work, np.zeros(model.n + 2))
    normals = int(work.rows.counts[ix.CONTACTS])
    assert_optimal(work, normals, normals + 3 * model.n, model.friction_limit)
