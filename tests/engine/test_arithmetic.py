"""Tests of Cholesky's method and elementary functions against libraries with more digits."""

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from magfold_env.engine import cholesky
from magfold_env.engine.compile.jit import kernel, numba_config
from magfold_env.engine.elementary import (
    direction,
    fma,
    fma_in_parts,
    inverse_root,
    log1p,
    sincos,
    square,
)


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
def test_halves_multiply_to_the_matrix(seed, size):
    source, _, _ = draw(seed, size)
    matrix, inverse = source.copy(), np.empty(size)
    assert cholesky.factorise(size, matrix, inverse)
    upper = np.triu(matrix)
    np.testing.assert_allclose(upper.T @ upper, source, rtol=1e-12, atol=1e-12 * source.max())
    np.testing.assert_allclose(inverse, 1.0 / np.diag(upper), rtol=1e-15)


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


@kernel
def sincos_of(x, sine, cosine):
    for i in range(x.size):
        sine[i], cosine[i] = sincos(x[i])


@kernel
def roots_of(x, degree, out):
    for i in range(x.size):
        out[i] = inverse_root(x[i], degree)


@pytest.mark.medium
@pytest.mark.skipif(bool(numba_config.DISABLE_JIT), reason="the interpreter takes minutes")
@pytest.mark.parametrize("largest", [1.0, 100.0, 1e6, 1e14])
def test_sincos_is_as_good_as_the_library_on_any_heading(largest):
    x = np.random.default_rng(1).uniform(-largest, largest, 5000)
    sine, cosine = np.empty_like(x), np.empty_like(x)
    sincos_of(x, sine, cosine)
    exact = np.sin(x.astype(np.longdouble)), np.cos(x.astype(np.longdouble))
    assert np.abs(sine - exact[0]).max() < 1.3e-16
    assert np.abs(cosine - exact[1]).max() < 1.3e-16


def test_sincos_knows_the_quadrants():
    x = np.arange(-20, 21) * (np.pi / 4)
    sine, cosine = np.empty_like(x), np.empty_like(x)
    sincos_of(x, sine, cosine)
    np.testing.assert_allclose(sine, np.sin(x), rtol=0, atol=2e-16)
    np.testing.assert_allclose(cosine, np.cos(x), rtol=0, atol=2e-16)


@given(seed=st.integers(0, 2**32 - 1))
def test_directions_are_those_of_the_library(seed):
    rng = np.random.default_rng(seed)
    for x, y in rng.normal(size=(20, 2)):
        assert direction(x, y) == pytest.approx(math.atan2(y, x), rel=7e-16, abs=0.0)
        z = y * 10.0 ** rng.uniform(-12, 12)
        assert direction(x, z) == pytest.approx(math.atan2(z, x), rel=7e-16, abs=0.0)
    assert direction(0.0, 0.0) == 0.0


@given(exponent=st.floats(-12.0, 8.0))
def test_logarithm_is_exact_to_rounding(exponent):
    z = 10**exponent
    assert log1p(z) == pytest.approx(np.log1p(z), rel=4e-16)


@pytest.mark.parametrize("degree", [3, 5])
def test_roots_are_exact_to_rounding(degree):
    x = 10.0 ** np.random.default_rng(degree).uniform(-300.0, 300.0, 2000)
    out = np.empty_like(x)
    roots_of(x, degree, out)
    # Newton's step from the library's root, in more digits.
    y, x = x.astype(np.longdouble) ** (-1.0 / degree), x.astype(np.longdouble)
    y += y * (1.0 - x * y**degree) / degree
    assert np.abs(out / y - 1.0).max() < 1e-15


@given(x=st.floats(-1e150, 1e150))
def test_a_square_is_the_rounded_product(x):
    assert square(x) == x * x


@kernel
def fused(a: float, b: float, c: float) -> float:
    return fma(a, b, c)


@kernel
def in_parts(a: float, b: float, c: float) -> float:
    return fma_in_parts(a, b, c)


def test_a_product_and_a_sum_are_rounded_once():
    rng = np.random.default_rng(0)
    for _ in range(2000):
        a, b = rng.normal(size=2) * 10.0 ** rng.integers(-20, 20, 2)
        c = -a * b * (1.0 + rng.normal() * 10.0 ** rng.integers(-18, 3))
        expected = float(Fraction(a) * Fraction(b) + Fraction(c))
        assert fused(a, b, c) == in_parts(a, b, c) == expected
