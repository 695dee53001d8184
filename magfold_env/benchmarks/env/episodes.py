"""Whole tube-feed episodes a second: random magnets, speeds log-uniform over their whole range.

Chains are simulated at the default tolerance, until they have settled. In a round everyone plays
the same episodes, one after another or side by side; every round has others, for some take a
hundred times as long as others. On one core processor time counts, with threads the clock's.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import count
from typing import Any

import numpy as np
from numpy.typing import NDArray

from magfold_env.benchmarks.env.players import (
    ENVS,
    TUBE_FEED,
    log_uniform,
    play_single,
    play_vector,
    single,
    vector,
)
from magfold_env.benchmarks.env.rates import rate_cells, verdict
from magfold_env.reporting.tables import Measurement, Progress, Row, Table, Tick, begin_case
from magfold_env.reporting.timing import Task, ratio, take_turns

NAME = "episodes"
LENGTHS = (4, 6, 8, 12)
SEED = 17
JUDGED = 6  # components
WANTED = {1: 300.0, 2: 550.0}  # episodes a second, by threads


@dataclass(frozen=True)
class Way:
    """One way to play."""

    form: str
    """`SINGLE` or `VECTOR`."""
    threads: int

    def __str__(self) -> str:
        return f"{self.form}, {self.threads} thread{'s' * (self.threads > 1)}"


SINGLE, VECTOR = "single", "vector"
CORE, WALL = "processor time", "wall clock"
CLOCKS: dict[str, Callable[[], float]] = {CORE: time.process_time, WALL: time.perf_counter}
WAYS = {
    CORE: (Way(SINGLE, 1), Way(VECTOR, 1)),
    WALL: (Way(VECTOR, 1), Way(VECTOR, 2)),
}
"""Who takes turns with whom, by the clock that they are timed with."""


@dataclass(frozen=True)
class Effort:
    """How much work a run of the benchmark may be."""

    lengths: tuple[int, ...]
    envs: int
    rounds: int

    @classmethod
    def of(cls, quick: bool) -> Effort:
        """Return the effort of a quick or a full run."""
        return cls((JUDGED,), 4, 2) if quick else cls(LENGTHS, ENVS, 7)


def run(quick: bool, progress: Progress) -> Measurement:
    """Measure every length."""
    effort = Effort.of(quick)
    part = Measurement(NAME, [])
    cases = [(n, clock) for n in effort.lengths for clock in WAYS]
    for k, (n, clock) in enumerate(cases):
        tick = begin_case(progress, k, len(cases), f"n = {n}")
        part.rows.extend(measure(n, clock, effort, tick))
    part.tables.append(_table(part.rows, effort))
    part.findings.extend(_findings(part.rows))
    return part


def measure(n: int, clock: str, effort: Effort, tick: Tick) -> list[Row]:
    """Return a row for each way to play chains of n components that is timed with a clock."""
    ways = WAYS[clock]
    tasks = {f"{way}": _task(n, way, effort.envs) for way in ways}
    times = take_turns(tasks, effort.rounds, 0.0, CLOCKS[clock], tick)
    first = times[f"{ways[0]}"]
    rows: list[Row] = []
    for way in ways:
        mine = times[f"{way}"]
        row: Row = {"n": n, "clock": clock, "form": way.form, "threads": way.threads}
        row |= rate_cells("episodes", mine, effort.envs)
        rows.append(row | {"times the first": ratio(first, mine).median})
    return rows


def _task(n: int, way: Way, envs: int) -> Task:
    """Return the task to play so many episodes."""
    play, rounds = _player(n, way, envs), count()

    def prepare() -> Callable[[], None]:
        k = next(rounds)
        actions = log_uniform(np.random.default_rng([SEED, n, k]), n, envs)
        return lambda: play(SEED + k * envs, actions)

    return prepare


def _player(n: int, way: Way, envs: int) -> Callable[[int, NDArray[np.float32]], None]:
    """Return what plays episodes, given the first one's seed and the actions."""
    options: dict[str, Any] = {"components": n, "actions": "box", "baseline": None}
    if way.form == SINGLE:
        return partial(play_single, single(TUBE_FEED, **options))
    return partial(play_vector, vector(TUBE_FEED, envs, way.threads, **options))


def _table(rows: list[Row], effort: Effort) -> Table:
    title = f"Tube-feed episodes a second, dynamics, {effort.envs} in a round"
    return Table(title, rows)


def _findings(rows: list[Row]) -> list[str]:
    found: list[str] = []
    judged = {1: CORE, 2: WALL}
    for threads, wanted in WANTED.items():
        for row in rows:
            if (row["n"], row["threads"], row["clock"]) == (JUDGED, threads, judged[threads]):
                rate = float(row["episodes/s"])
                said = verdict(rate, wanted)
                cores = "one core" if threads == 1 else f"{threads} threads"
                found.append(f"n = {JUDGED}, {row['form']}, {cores}: {rate:.0f} episodes/s; {said}")
    return found
