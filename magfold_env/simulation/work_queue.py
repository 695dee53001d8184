"""Threads that share one queue of work.

Chains of a vector environment take very different times: one may fold for seconds while another is
at rest. Every thread therefore takes the next chain when it has finished one, and a step takes
little longer than its work divided evenly. The threads are Python's and run kernels that release
the interpreter's lock. Numba's own threads are unsuitable: those of GNU OpenMP kill a process that
forks after they have run, as `AsyncVectorEnv` does, and those of numba's workqueue divide loops in
advance and abort when two Python threads use them at once.
"""

import os
import threading
import weakref
from collections.abc import Callable
from queue import SimpleQueue
from typing import Any

Job = tuple[Callable[..., int], tuple[Any, ...], "SimpleQueue[int]"]


class WorkQueue:
    """Several threads, including the calling one; the others start on first use."""

    def __init__(self, size: int) -> None:
        self.size = size
        self._jobs: SimpleQueue[Job | None] = SimpleQueue()
        self._process = -1
        self._end: weakref.finalize[..., Any] | None = None

    def run(self, work: Callable[..., int], arguments: tuple[Any, ...], pieces: int) -> None:
        """Call ``work(*arguments)`` on all threads until a given number of pieces of work is done.

        Every call takes pieces from a shared counter until none is left, and returns the number it
        has done. A thread that starts late finds none, and no other thread waits for it.
        """
        helpers = min(self.size, pieces) - 1
        if helpers > 0:
            self._start()
        done: SimpleQueue[int] = SimpleQueue()
        for _ in range(helpers):
            self._jobs.put((work, arguments, done))
        left = pieces - work(*arguments)
        while left > 0:
            left -= done.get()

    def close(self) -> None:
        """End the threads; a later run starts others."""
        if self._end is not None:
            self._end()
            self._end = None

    def _start(self) -> None:
        """Start the threads unless they are running; a forked process has none of them."""
        if self._end is not None and self._process == os.getpid():
            return
        self._process, self._jobs = os.getpid(), SimpleQueue()
        for _ in range(self.size - 1):
            threading.Thread(target=_work_off, args=(self._jobs,), daemon=True).start()
        # `__del__` would not do: when the interpreter ends, it finds modules that are gone.
        self._end = weakref.finalize(self, _end, self._jobs, self.size - 1)
        self._end.atexit = False


def _end(jobs: SimpleQueue[Job | None], threads: int) -> None:
    for _ in range(threads):
        jobs.put(None)


def _work_off(jobs: SimpleQueue[Job | None]) -> None:
    while (job := jobs.get()) is not None:
        work, arguments, done = job
        done.put(work(*arguments))
        del job, work, arguments, done
