"""Compare the times of several tasks.

The speed of a machine drifts with other programs, clock rate and heat. The tasks therefore take
turns in rounds, and ratios are taken within each round, where the drift cancels out. The clock is
the processor time of the calling thread, so that time used by other programs does not count.
"""

import gc
import math
import time
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass
from typing import Self, TypeVar

import numpy as np
import numpy.typing as npt

Task = Callable[[], Callable[[], object]]
"""A function that prepares one call, untimed, and returns the function to time."""

Key = TypeVar("Key", bound=Hashable)

MOST_CALLS = 10_000
LASTING = 1e-2  # [s]; calling a kernel with many arrays takes 1e-4 s


@dataclass(frozen=True, eq=False)
class Spread:
    """Median and quartiles of a quantity that is measured once per round."""

    median: float
    low: float
    high: float

    def __str__(self) -> str:
        return f"{self.median:.3g} ({self.low:.3g} to {self.high:.3g})"

    def cells(self, name: str) -> dict[str, float]:
        """Return these values as the cells of a table row, under a name."""
        return {
            name: self.median,
            f"{name}, lower quartile": self.low,
            f"{name}, upper quartile": self.high,
        }

    def time_cells(self, unit: str, scale: float = 1.0) -> dict[str, float]:
        """Return the values times ``scale``, in ``unit``, as the cells of a table row for times."""
        return {
            f"time [{unit}]": scale * self.median,
            f"lower quartile [{unit}]": scale * self.low,
            f"upper quartile [{unit}]": scale * self.high,
        }


@dataclass(frozen=True, eq=False)
class Timing:
    """The times of one task."""

    samples: npt.NDArray[np.float64]
    """Seconds per call, one sample per round."""

    @property
    def spread(self) -> Spread:
        """Median and quartiles [s]."""
        return spread_of(self.samples)

    @property
    def median(self) -> float:
        """Median [s]."""
        return self.spread.median

    def each_of(self, count: int) -> Self:
        """Return the time per item if one call processes several items."""
        return type(self)(self.samples / count)


def spread_of(samples: npt.NDArray[np.float64]) -> Spread:
    """Return the median and quartiles of samples."""
    low, median, high = np.quantile(samples, [0.25, 0.5, 0.75])
    return Spread(float(median), float(low), float(high))


def ratio(slow: Timing, fast: Timing) -> Spread:
    """Return the ratio of the times of ``slow`` and ``fast`` within each round."""
    return spread_of(slow.samples / fast.samples)


def unprepared(call: Callable[[], object]) -> Task:
    """Return the task that calls a function and needs no preparation."""
    return lambda: call


def take_turns(
    tasks: Mapping[Key, Task],
    rounds: int = 7,
    shortest: float = 2e-3,
    clock: Callable[[], float] = time.thread_time,
    tick: Callable[[float], None] | None = None,
) -> dict[Key, Timing]:
    """Time tasks in turn, with one sample of each in every round.

    Each task runs twice before the first round: first to compile and to fill caches, then to find
    the number of calls per sample. Calls shorter than ``shortest`` [s] are repeated, and the sample
    is their mean. The clock is in seconds; work on several threads needs `time.perf_counter`.
    ``tick`` is called with the finished share of the work, 0 to 1.
    """
    calls: dict[Key, int] = {}
    for name, task in tasks.items():
        _sample(task, 1, clock)
        once = max(_sample(task, 1, clock), 1e-9)
        calls[name] = min(max(1, math.ceil(shortest / once)), MOST_CALLS)
    samples = {name: np.zeros(rounds) for name in tasks}
    collecting = gc.isenabled()
    gc.disable()
    try:
        for turn in range(rounds):
            for name, task in tasks.items():
                samples[name][turn] = _sample(task, calls[name], clock)
            if tick is not None:
                tick((turn + 1) / rounds)
    finally:
        if collecting:
            gc.enable()
    return {name: Timing(taken) for name, taken in samples.items()}


def enough_repeats(
    work: Callable[[int], object],
    least: float = LASTING,
    clock: Callable[[], float] = time.thread_time,
) -> int:
    """Return the number of repetitions for which one call of compiled work lasts `least` [s].

    The cost of the call itself is then negligible.
    """
    work(1)  # compiles the work
    repeats = 1
    while True:
        begun = clock()
        work(repeats)
        if clock() - begun >= least:
            return repeats
        repeats *= 2


def _sample(task: Task, calls: int, clock: Callable[[], float]) -> float:
    """Return the mean time of a call [s]."""
    total = 0.0
    for _ in range(calls):
        call = task()
        begun = clock()
        call()
        total += clock() - begun
    return total / calls
