"""Tests that kernels read tuples by pointer, call each other, and are compiled once."""

import copy
import gc
import itertools
import math
import pickle
from typing import Any, NamedTuple, cast

import numpy as np
import pytest

from magfold_env.engine.compile.by_pointer import POINTERS, by_pointer, pointer
from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.state import Array, IntArray

by_address = pytest.mark.skipif(not POINTERS, reason="tuples are passed on field by field")


@by_pointer
class Inner(NamedTuple):
    """A tuple inside another tuple."""

    scale: float
    numbers: IntArray


@by_pointer
class Outer(NamedTuple):
    """A tuple with one field of every kind."""

    on: bool
    size: int
    cube: Array
    inner: Inner
    row: Array


def an_outer() -> Outer:
    rng = np.random.default_rng(1)
    inner = Inner(0.5, np.array([3, -4]))
    return Outer(True, 7, rng.random((2, 3, 4)), inner, rng.random(5))


@kernel
def read(outer: Outer, k: int) -> tuple[bool, int, float, float, int, float, int]:
    inner = outer.inner
    at = outer.cube[1]
    shapes = outer.cube.shape[0] * 100 + outer.cube.shape[1] * 10 + at.shape[1]
    return (
        outer.on, outer.size, at[k, 3], inner.scale, inner.numbers[k], outer.row[4], shapes,
    )  # fmt: skip


@kernel
def scale_row(outer: Outer) -> None:
    for k in range(outer.row.size):
        outer.row[k] *= outer.inner.scale


@kernel
def last_of(inner: Inner) -> int:
    return inner.numbers[inner.numbers.size - 1]


@kernel
def last_within(outer: Outer) -> int:
    return last_of(outer.inner)


def test_kernels_read_every_kind_of_field():
    outer = an_outer()
    for k in range(2):
        expected = (True, 7, outer.cube[1, k, 3], 0.5, outer.inner.numbers[k], outer.row[4], 234)
        assert read(outer, k) == expected
    assert not read(outer._replace(on=False), 0)[0]
    assert last_within(outer) == last_of(outer.inner) == -4


@pytest.mark.parametrize("way", [lambda outer: outer, pointer])
def test_what_kernels_write_is_in_the_arrays(way):
    outer = an_outer()
    before = outer.row.copy()
    scale_row(way(outer))
    np.testing.assert_array_equal(outer.row, 0.5 * before)


@by_address
def test_a_pointer_keeps_its_tuple_alive_and_compiles_nothing_more():
    read(an_outer(), 0)
    signatures, one = len(cast("Any", read).signatures), pointer(an_outer())
    gc.collect()
    assert read(one, 0) == read(an_outer(), 0)
    assert len(cast("Any", read).signatures) == signatures


@pytest.mark.parametrize("again", [copy.deepcopy, lambda outer: pickle.loads(pickle.dumps(outer))])
def test_copies_have_their_own_arrays(again):
    outer = an_outer()
    scale_row(outer)
    copied = again(outer)
    before = outer.row.copy()
    scale_row(copied)
    np.testing.assert_array_equal(outer.row, before)
    np.testing.assert_array_equal(copied.row, 0.5 * before)
    assert type(copied) is Outer


@by_address
@pytest.mark.parametrize(("changes", "message"), [
    ({"row": np.zeros(10)[::2]}, "row: kernels take C-contiguous arrays only"),
    ({"size": "seven"}, "size: must be a bool, an int, a float, an array"),
])  # fmt: skip
def test_other_fields_are_refused(changes, message):
    with pytest.raises(TypeError, match=message):
        read(an_outer()._replace(**changes), 0)


@kernel
def exchange(outer: Outer, i: int, j: int, k: int) -> None:
    before = outer.cube[i, j, k]
    outer.cube[i, j, k] = outer.row[k]
    outer.row[k] = before + outer.inner.numbers[i]


@kernel
def exchange_all(outer: Outer) -> None:
    for i in range(2):
        for j in range(3):
            for k in range(4):
                exchange(outer, i, j, k)


def test_indices_reach_what_they_reach_in_python():
    outer, other = an_outer(), an_outer()
    exchange_all(outer)
    for i, j, k in itertools.product(range(2), range(3), range(4)):
        before = float(other.cube[i, j, k])
        other.cube[i, j, k] = other.row[k]
        other.row[k] = before + other.inner.numbers[i]
    assert outer.row.tolist() == other.row.tolist()
    assert outer.cube.tolist() == other.cube.tolist()


@inlined
def square(x: float) -> float:
    return x * x


@kernel
def length(x: float, y: float, doubled: bool) -> float:
    size = math.sqrt(square(x) + square(y))
    return 2.0 * size if doubled else size


@kernel
def sum_of_lengths(values: Array) -> float:
    total = 0.0
    for k in range(values.shape[0]):
        total += length(values[k, 0], values[k, 1], k == 0)
    return total + length(3.0, 4.0, True) + length(3.0, 4.0, doubled=False)


@kernel
def twice(values: Array) -> float:
    return sum_of_lengths(values) + sum_of_lengths(values)


def test_called_from_kernels_python_and_code_of_numba_they_do_the_same() -> None:
    values = np.random.default_rng(2).random((5, 2))
    expected = sum(length(x, y, k == 0) for k, (x, y) in enumerate(values)) + 15.0
    assert sum_of_lengths(values) == expected
    assert twice(values) == 2.0 * expected
    assert length(3.0, 4.0, True) == 10.0

    def user(x: float) -> float:
        return length(x, 4.0, False)

    assert user(3.0) == 5.0
