"""Threads that work off one queue together.

Chains of a vector environment take very different times: one folds on for seconds while another
has come to rest. So every thread takes the next chain when it is done with its last, and a step
takes little longer than its work shared out evenly. The threads are Python's, in kernels that do
not hold the interpreter's lock, because numba's own are no use here: those of GNU OpenMP kill a
process that forks after they have run (`AsyncVectorEnv` does), and those of numba's workqueue
share loops out beforehand, and abort where two Python threads use them at once.
"""

import os
import threading
from collections.abc import Callable
from queue import SimpleQueue
from typing import Any

Job = tuple[Callable[..., int], tuple[Any, ...], "SimpleQueue[int]"]


class WorkQueue:
    """Some threads, the calling one among them; the others are started when first needed."""

    def __init__(self, size: int) -> None:
        self.size = size
        self._jobs: SimpleQueue[Job | None] = SimpleQueue()
        self._process = -1

    def run(self, work: Callable[..., int], arguments: tuple[Any, ...], pieces: int) -> None:
        """Call ``work(*arguments)`` on all threads until so many pieces of work are done.

        Every call takes pieces, from a counter of their own, until none is left, and returns how
        many it has done. A thread that is late finds none, and nobody waits for it.
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
        """End the threads."""
        if self._process == os.getpid():
            for _ in range(self.size - 1):
                self._jobs.put(None)
        self._process = -1

    def __del__(self) -> None:
        self.close()

    def _start(self) -> None:
        """Start the threads, unless they run: those of a process do not survive its forking."""
        if self._process == os.getpid():
            return
        self._process, self._jobs = os.getpid(), SimpleQueue()
        for _ in range(self.size - 1):
            threading.Thread(target=_work_off, args=(self._jobs,), daemon=True).start()


def _work_off(jobs: SimpleQueue[Job | None]) -> None:
    while (job := jobs.get()) is not None:
        work, arguments, done = job
        done.put(work(*arguments))
        del job, work, arguments, done
