"""Threads share work out to the last piece, and are there again after a fork."""

import os
import threading
import time
from itertools import count

import pytest

from magfold_env.engine.team import Team


def worker(pieces: int, seconds: float = 0.0):
    """Return work that takes pieces from a counter, and who has done them."""
    counter, doers = count(), []

    def work() -> int:
        done = 0
        while next(counter) < pieces:
            doers.append(threading.get_ident())
            time.sleep(seconds)
            done += 1
        return done

    return work, doers


@pytest.mark.parametrize("size", [1, 2, 5])
def test_every_piece_is_done_once(size: int) -> None:
    team = Team(size)
    for pieces in (0, 1, 2, 7):
        work, doers = worker(pieces, 1e-3)
        team.run(work, (), pieces)
        assert len(doers) == pieces
    team.close()


def test_all_threads_take_part() -> None:
    team = Team(3)
    work, doers = worker(30, 5e-3)
    team.run(work, (), 30)
    assert len(set(doers)) == 3
    assert threading.get_ident() in doers
    team.close()


def test_threads_end() -> None:
    before = threading.active_count()
    team = Team(4)
    work, _ = worker(8, 1e-3)
    team.run(work, (), 8)
    assert threading.active_count() == before + 3
    team.close()
    deadline = time.monotonic() + 5.0
    while threading.active_count() > before and time.monotonic() < deadline:
        time.sleep(0.01)
    assert threading.active_count() == before


@pytest.mark.skipif(not hasattr(os, "fork"), reason="forks")
@pytest.mark.filterwarnings("ignore:.*multi-threaded.*fork:DeprecationWarning")
def test_a_forked_process_has_threads_of_its_own() -> None:
    team = Team(2)
    work, _ = worker(4, 1e-3)
    team.run(work, (), 4)
    child = os.fork()
    if child == 0:
        work, doers = worker(40, 5e-3)
        team.run(work, (), 40)
        os._exit(0 if len(doers) == 40 and len(set(doers)) == 2 else 1)
    assert os.waitpid(child, 0)[1] == 0
    work, doers = worker(4, 1e-3)
    team.run(work, (), 4)
    assert len(doers) == 4
    team.close()
