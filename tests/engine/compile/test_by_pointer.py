"""Kernels read tuples by pointer, call each other, and are compiled once."""

import copy
import gc
import math
import pickle
from typing import Any, NamedTuple, cast

import numba
import numpy as np
import pytest

from magfold_env.engine.compile.by_pointer import POINTERS, by_pointer, pointer
from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.state import Array, IntArray

by_address = pytest.mark.skipif(not POINTERS, reason="tuples are passed on field by field")


@by_pointer
class Inner(NamedTuple):
    """A tuple within another."""

    scale: float
    numbers: IntArray


@by_pointer
class Outer(NamedTuple):
    """One field of every kind."""

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


def test_what_kernels_write_is_in_the_arrays():
    outer = an_outer()
    before = outer.row.copy()
    scale_row(outer)
    np.testing.assert_array_equal(outer.row, 0.5 * before)


def test_a_tuple_within_another_is_passed_on_and_stands_alone():
    assert last_within(an_outer()) == last_of(an_outer().inner) == -4


@by_address
def test_a_pointer_passes_the_tuple_and_compiles_nothing_more():
    outer, compiled = an_outer(), cast("Any", read)
    compiled(outer, 1)
    signatures, row = len(compiled.signatures), outer.row.copy()
    assert compiled(pointer(outer), 1) == compiled(outer, 1)
    assert len(compiled.signatures) == signatures
    scale_row(pointer(outer))
    np.testing.assert_array_equal(outer.row, 0.5 * row)


def test_a_pointer_keeps_its_tuple_alive():
    one = pointer(an_outer())
    gc.collect()
    assert read(one, 0) == read(an_outer(), 0)


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
def test_arrays_with_gaps_are_refused():
    outer = an_outer()._replace(row=np.zeros(10)[::2])
    with pytest.raises(TypeError, match="row: kernels take C-contiguous arrays only"):
        scale_row(outer)


@by_address
def test_other_fields_are_refused():
    outer = an_outer()._replace(size="seven")
    with pytest.raises(TypeError, match="size: must be a bool, an int, a float, an array"):
        read(outer, 0)


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


def test_called_from_a_kernel_and_from_python_they_do_the_same():
    values = np.random.default_rng(2).random((5, 2))
    expected = sum(length(x, y, k == 0) for k, (x, y) in enumerate(values)) + 15.0
    assert sum_of_lengths(values) == expected
    assert twice(values) == 2.0 * expected
    assert length(3.0, 4.0, True) == 10.0


def test_only_what_python_calls_is_compiled():
    @kernel
    def inner(x: float) -> float:
        return x + 1.0

    @kernel
    def outer(x: float) -> float:
        return inner(x) + inner(2.0)

    assert outer(1.0) == 5.0
    assert not inner.signatures  # pyright: ignore[reportFunctionMemberAccess]
    assert inner(1.0) == 2.0


def test_code_that_numba_compiled_itself_may_call_them():
    @numba.njit
    def user(x: float) -> float:
        return length(x, 4.0, False)

    assert user(3.0) == 5.0
