"""What kernels read through one pointer is what the tuple holds, and what they write is there."""

import copy
import gc
import pickle
from typing import Any, NamedTuple, cast

import numpy as np
import pytest

from magfold_env.engine.compile.by_pointer import POINTERS, by_pointer, pointer
from magfold_env.engine.compile.jit import allocating_kernel, kernel
from magfold_env.engine.compile.pointer_types import address_of
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


@allocating_kernel
def row_of(outer: Outer) -> Array:
    return outer.row


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


def test_an_array_that_a_kernel_returns_lives_as_long_as_its_tuple():
    outer = an_outer()
    row = row_of(outer)
    np.testing.assert_array_equal(row, outer.row)


@by_address
@pytest.mark.parametrize("shape", [(5,), (2, 3), (0,)])
@pytest.mark.parametrize("writable", [True, False])
def test_arrays_are_found_where_they_are(shape: tuple[int, ...], writable: bool) -> None:
    array = np.zeros(shape)
    array.flags.writeable = writable
    assert address_of(array) == array.ctypes.data
