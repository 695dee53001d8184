"""Threads share work out to the last piece, and are there again after a fork."""

import os
import threading
from itertools import count

import pytest

from magfold_env.simulation.work_queue import WorkQueue

PATIENCE = 600.0  # [s] waited out only where a thread never comes


def worker(pieces: int, together: int = 1):
    """Return work that takes pieces from a counter, and who has done them.

    Nobody goes on from a first piece before so many threads have one.
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


def test_threads_end() -> None:
    before = set(threading.enumerate())
    queue = WorkQueue(4)
    work, _ = worker(8, together=4)
    queue.run(work, (), 8)
    helpers = set(threading.enumerate()) - before
    assert len(helpers) == 3
    queue.close()
    for helper in helpers:
        helper.join(PATIENCE)
        assert not helper.is_alive()


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
