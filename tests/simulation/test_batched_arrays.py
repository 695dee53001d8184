"""Tests of the base of batches: array copies, shared threads, banded equations."""

import os
import threading
from itertools import count
from typing import Any

import numpy as np
import pytest

from magfold_env.engine.compile.by_pointer import (
    POINTERS,
    call_float,
    calls_by_address,
    code_of,
    take,
)
from magfold_env.engine.compile.jit import kernel
from magfold_env.engine.state import Array, IntArray
from magfold_env.simulation.banded import factor_banded, solve_banded
from magfold_env.simulation.batched_arrays import BatchedArrays
from magfold_env.simulation.work_queue import WorkQueue
from tests.engine.compile.test_by_pointer import Inner, Outer, an_outer


@kernel
def digest(one: Outer, two: Outer, three: Outer, x: float) -> float:
    total = x * two.inner.scale + three.row[3] + (100.0 if one.on else 0.0)
    for i in range(one.cube.shape[1]):
        for j in range(one.cube.shape[2]):
            total += (1 + i) * (10 + j) * (one.cube[0, i, j] - 2.0 * one.cube[1, i, j])
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
    batched = BatchedArrays([original], 5, own=["cube", "inner.numbers"])
    rng = np.random.default_rng(2)
    batched["cube"][:] = rng.random((5, 2, 3, 4))
    batched["inner.numbers"][:, 1] = np.arange(5)
    if POINTERS:
        batched.number("inner").fill(3.0)  # the first word of `inner` is `scale`
    out, counter = np.zeros(5), np.zeros(1, dtype=np.int64)
    code = code_of(digest, original, original, original, 2.0)
    assert digests(code, batched.references, counter, out) == 5
    for k in range(5):
        own = original._replace(
            cube=batched["cube"][k].copy(),
            inner=Inner(3.0 if POINTERS else 0.5, batched["inner.numbers"][k].copy()),
        )
        assert out[k] == digest(own, own, own, 2.0)
    assert digests(code, batched.references, counter, out) == 0


def test_copies_become_what_the_original_was_or_another_one() -> None:
    original = an_outer()
    batched = BatchedArrays([original], 4)
    batched["cube"][:] = 7.0
    batched["inner.numbers"][:] = 7
    batched.restore(np.array([1, 3]))
    assert (batched["cube"][[0, 2]] == 7.0).all()
    for k in (1, 3):
        np.testing.assert_array_equal(batched["cube"][k], original.cube)
        np.testing.assert_array_equal(batched["inner.numbers"][k], original.inner.numbers)
    assert batched["cube"].ctypes.data % 64 == 0
    first, second = an_outer(), an_outer()._replace(size=9, cube=np.full((2, 3, 4), 2.0))
    second = second._replace(row=np.full(6, 0.5), inner=second.inner._replace(scale=0.25))
    batched = BatchedArrays([first], 2, own=["cube"])
    batched.become(second)
    out, counter = np.zeros(2), np.zeros(1, dtype=np.int64)
    digests(code_of(digest, first, first, first, 2.0), batched.references, counter, out)
    assert (out == digest(second, second, second, 2.0)).all()
    batched["cube"][:] = 0.0
    assert (second.cube == 2.0).all()


def test_a_copy_may_be_of_another_original() -> None:
    first, second = an_outer(), an_outer()._replace(size=9, cube=np.full((2, 3, 4), 2.0))
    batched = BatchedArrays([first, second], 3)
    batched.restore(np.array([1]), 1)
    kept = batched.get_state()
    out, counter = np.zeros(3), np.zeros(1, dtype=np.int64)
    code = code_of(digest, first, first, first, 2.0)
    digests(code, batched.references, counter, out)
    for k, original in enumerate((first, second, first)):
        assert out[k] == digest(original, original, original, 2.0)
        np.testing.assert_array_equal(batched.row(k, k % 2).cube, original.cube)
    batched["cube"][:] = 0.0
    batched.set_state(kept)
    np.testing.assert_array_equal(batched["cube"][1], second.cube)


PATIENCE = 600.0  # [s] waited out only where a thread never comes


def worker(pieces: int, together: int = 1):
    """Return a job that takes pieces from a counter, and the threads that did the pieces.

    No thread continues after its first piece before ``together`` threads have one.
    """
    counter, doers, all_there = count(), [], threading.Barrier(together, timeout=PATIENCE)

    def work() -> int:
        done = 0
        while next(counter) < pieces:
            doers.append(threading.get_ident())
            if done == 0:
                all_there.wait()
            done += 1
        return done

    return work, doers


@pytest.mark.parametrize("size", [1, 2, 5])
def test_every_piece_is_done_once(size: int) -> None:
    queue = WorkQueue(size)
    for pieces in (0, 1, 2, 7):
        work, doers = worker(pieces)
        queue.run(work, (), pieces)
        assert len(doers) == pieces
    queue.close()


def test_all_threads_take_part() -> None:
    queue = WorkQueue(3)
    work, doers = worker(30, together=3)
    queue.run(work, (), 30)
    assert len(doers) == 30
    assert len(set(doers)) == 3
    assert threading.get_ident() in doers
    queue.close()


@pytest.mark.skipif(not hasattr(os, "fork"), reason="forks")
@pytest.mark.filterwarnings("ignore:.*multi-threaded.*fork:DeprecationWarning")
def test_a_forked_process_has_threads_of_its_own() -> None:
    queue = WorkQueue(2)
    work, _ = worker(4, together=2)
    queue.run(work, (), 4)
    child = os.fork()
    if child == 0:
        wrong = 1
        try:
            work, doers = worker(40, together=2)
            queue.run(work, (), 40)
            wrong = int(len(doers) != 40 or len(set(doers)) != 2)
        finally:
            os._exit(wrong)
    assert os.waitpid(child, 0)[1] == 0
    work, doers = worker(4, together=2)
    queue.run(work, (), 4)
    assert len(doers) == 4
    queue.close()


@pytest.mark.parametrize(("rows", "half"), [(1, 1), (5, 2), (60, 5)])
def test_solutions_are_those_of_the_full_matrix(rows, half):
    rng = np.random.default_rng(rows)
    band = rng.uniform(-1.0, 1.0, (rows, 2 * half + 1))
    band[:, half] += 2.0 * half + 1.0
    full = np.zeros((rows, rows))
    for row, column in np.ndindex(rows, rows):
        if abs(column - row) <= half:
            full[row, column] = band[row, half + column - row]
    right = rng.normal(size=(rows, 3))
    expected = np.linalg.solve(full, right)
    factor_banded(band)
    solve_banded(band, right)
    np.testing.assert_allclose(right, expected, rtol=1e-12, atol=1e-14)
