"""Kernels that kernels call: the same results as by themselves, compiled once for all callers."""

import math

import numba
import numpy as np
from numba.core.event import Listener, register, unregister

from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.state import Array


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


def test_constants_make_for_no_other_code():
    seen: list[str] = []

    class Names(Listener):
        def on_start(self, event):
            seen.append(event.data["dispatcher"].py_func.__name__)

        def on_end(self, event):
            pass

    @kernel
    def leaf(k: int) -> int:
        return k + 1

    @kernel
    def root(k: int) -> int:
        return leaf(k) + leaf(0) + leaf(1)

    listener = Names()
    register("numba:compile", listener)
    try:
        assert root(2) == 6
    finally:
        unregister("numba:compile", listener)
    assert seen == ["root", "leaf"]


def test_code_that_numba_compiled_itself_may_call_them():
    @numba.njit
    def user(x: float) -> float:
        return length(x, 4.0, False)

    assert user(3.0) == 5.0
