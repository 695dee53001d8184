"""Copies side by side are read by kernels as the original would be, each with its own arrays."""

from typing import Any, NamedTuple

import numpy as np

from magfold_env.engine.compile.by_pointer import (
    POINTERS,
    by_pointer,
    call_float,
    calls_by_address,
    code_of,
    take,
)
from magfold_env.engine.compile.jit import kernel
from magfold_env.engine.state import Array, IntArray
from magfold_env.simulation.stack import Stack


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
    square: Array
    inner: Inner
    shared: Array


def an_outer() -> Outer:
    rng = np.random.default_rng(1)
    return Outer(True, 7, rng.random((3, 5)), Inner(0.5, np.array([3, -4])), rng.random(4))


@kernel
def digest(one: Outer, two: Outer, three: Outer, x: float) -> float:
    total = x * two.inner.scale + three.shared[3] + (100.0 if one.on else 0.0)
    for i in range(one.square.shape[0]):
        for j in range(one.square.shape[1]):
            total += (1 + i) * (10 + j) * one.square[i, j]
    return total + one.inner.numbers[1] * one.size


@calls_by_address
def digests(code: Any, references: Any, counter: IntArray, out: Array) -> int:
    taken = 0
    while True:
        k = take(counter)
        if k >= out.size:
            return taken
        taken += 1
        out[k] = call_float(code, references[k], references[k], references[k], 2.0)


def test_kernels_read_every_copy() -> None:
    original = an_outer()
    stack = Stack([original], 5, own=["square", "inner.numbers"])
    rng = np.random.default_rng(2)
    stack["square"][:] = rng.random((5, 3, 5))
    stack["inner.numbers"][:, 1] = np.arange(5)
    if POINTERS:
        stack.number("inner").fill(3.0)  # the first word of `inner` is `scale`
    out, counter = np.zeros(5), np.zeros(1, dtype=np.int64)
    code = code_of(digest, original, original, original, 2.0)
    assert digests(code, stack.references, counter, out) == 5
    for k in range(5):
        own = original._replace(
            square=stack["square"][k].copy(),
            inner=Inner(3.0 if POINTERS else 0.5, stack["inner.numbers"][k].copy()),
        )
        assert out[k] == digest(own, own, own, 2.0)
    assert digests(code, stack.references, counter, out) == 0


def test_copies_become_what_the_original_was() -> None:
    original = an_outer()
    stack = Stack([original], 4)
    stack["square"][:] = 7.0
    stack["inner.numbers"][:] = 7
    stack.restore(np.array([1, 3]))
    assert (stack["square"][[0, 2]] == 7.0).all()
    for k in (1, 3):
        np.testing.assert_array_equal(stack["square"][k], original.square)
        np.testing.assert_array_equal(stack["inner.numbers"][k], original.inner.numbers)
    assert stack["square"].ctypes.data % 64 == 0


def test_a_copy_may_be_of_another_original() -> None:
    first, second = an_outer(), an_outer()._replace(size=9, square=np.full((3, 5), 2.0))
    stack = Stack([first, second], 3)
    stack.restore(np.array([1]), 1)
    kept = stack.contents()
    out, counter = np.zeros(3), np.zeros(1, dtype=np.int64)
    code = code_of(digest, first, first, first, 2.0)
    digests(code, stack.references, counter, out)
    for k, original in enumerate((first, second, first)):
        assert out[k] == digest(original, original, original, 2.0)
        np.testing.assert_array_equal(stack.row(k, k % 2).square, original.square)
    stack["square"][:] = 0.0
    stack.refill(kept)
    np.testing.assert_array_equal(stack["square"][1], second.square)


def test_copies_become_another_original() -> None:
    first, second = an_outer(), an_outer()._replace(size=9, square=np.full((3, 5), 2.0))
    second = second._replace(shared=np.full(6, 0.5), inner=second.inner._replace(scale=0.25))
    stack = Stack([first], 2, own=["square"])
    stack.become(second)
    out, counter = np.zeros(2), np.zeros(1, dtype=np.int64)
    digests(code_of(digest, first, first, first, 2.0), stack.references, counter, out)
    assert (out == digest(second, second, second, 2.0)).all()
    stack["square"][:] = 0.0
    assert (second.square == 2.0).all()
