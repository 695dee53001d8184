"""Cholesky's method against LAPACK, with rows left out, and with matrices that are not definite."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from magfold_env.engine import cholesky


def draw(seed, size):
    rng = np.random.default_rng(seed)
    rows = rng.normal(size=(size, size + 2)) * 10 ** rng.uniform(-3, 3, (size, 1))
    return rows @ rows.T, rng.normal(size=size), rng


@given(seed=st.integers(0, 2**32 - 1), size=st.integers(1, 20))
def test_systems_are_solved(seed, size):
    source, right, rng = draw(seed, size)
    taken = (rng.random(size) < 0.8).astype(np.int64)
    added = np.abs(rng.normal(size=size))
    matrix, inverse, found = np.full((size + 3, size + 3), np.nan), np.empty(size), right.copy()
    cholesky.load(size, source, taken, added, matrix)
    assert cholesky.factorise(size, matrix, inverse) == taken.all()
    cholesky.solve(size, matrix, inverse, found)
    kept = np.flatnonzero(taken)
    assert not np.delete(found, kept).any()
    assert not inverse[taken == 0].any()
    whole = source[np.ix_(kept, kept)] + np.diag(added[kept])
    backward = np.abs(whole) @ np.abs(found[kept]) + np.abs(right[kept])
    assert (np.abs(whole @ found[kept] - right[kept]) <= 1e-11 * backward.max(initial=0.0)).all()


@given(seed=st.integers(0, 2**32 - 1), size=st.integers(1, 20))
def test_lower_halves_are_solved_from_any_row_on(seed, size):
    source, right, rng = draw(seed, size)
    first = int(rng.integers(size))
    right[:first] = 0.0
    matrix, inverse = source.copy(), np.empty(size)
    assert cholesky.factorise(size, matrix, inverse)
    upper = np.triu(matrix)
    np.testing.assert_allclose(upper.T @ upper, source, rtol=1e-12, atol=1e-12 * source.max())
    np.testing.assert_allclose(inverse, 1.0 / np.diag(upper), rtol=1e-15)
    found = right.copy()
    cholesky.solve_lower(first, size, matrix, inverse, found)
    expected = np.linalg.solve(upper.T, right)
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("size", [2, 3, 6, 7])
def test_a_row_that_repeats_another_is_left_out(size):
    source, right, _ = draw(3, size)
    source[size - 1] = source[0]
    source[:, size - 1] = source[:, 0]
    right[size - 1] = right[0]
    source[size - 1, size - 1] *= 1.0 - 1e-9  # not definite, beyond rounding
    matrix, inverse = source.copy(), np.empty(size)
    assert not cholesky.factorise(size, matrix, inverse)
    cholesky.solve(size, matrix, inverse, right)
    assert right[size - 1] == 0.0
    assert np.isfinite(right).all()
