"""Tube-feed episodes a second, simulated, and steps a second without dynamics.

Chains are simulated at the default tolerance, until they have settled; magnets are random, speeds
log-uniform over their whole range. In a round everyone plays the same episodes, one after another
or side by side; every round has others, for some take a hundred times as long as others. On one
core processor time counts, with threads the clock's. Steps without dynamics are taken with random
actions, beginning anew included.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from itertools import count, product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from magfold_env.benchmarks.env import players
from magfold_env.benchmarks.env.players import ENVS, TUBE_FEED, rate_cells, rate_verdict
from magfold_env.reporting import plotting, tables, timing
from magfold_env.reporting.tables import Measurement, Progress, Row, Table, Tick

LENGTHS = (4, 6, 8, 12)
SEED, STEPS_SEED = 17, 5
COMPONENTS = 6  # of the chains that something is asked of
WANTED = {1: 300.0, 2: 550.0}  # episodes a second, by threads
FORMS = {"single": None, f"vector of {ENVS}": ENVS}
SHAPINGS = {"none": False, "similarity": "similarity"}
STEPS_WANTED = 20_000.0  # steps a second without dynamics


class Way(NamedTuple):
    """One way to play."""

    form: str  # `SINGLE` or `VECTOR`
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


class Effort(NamedTuple):
    """How much work a run of the benchmark may be."""

    lengths: tuple[int, ...]
    envs: int
    rounds: int


QUICK, FULL = Effort((COMPONENTS,), 4, 2), Effort(LENGTHS, ENVS, 7)


def run(quick: bool, progress: Progress) -> Measurement:
    """Measure episodes of every length."""
    effort = QUICK if quick else FULL
    rows: list[Row] = []
    cases = list(product(effort.lengths, WAYS))
    for (n, clock), tick in tables.each_case(progress, cases, lambda case: f"n = {case[0]}"):
        rows.extend(measure(n, clock, effort, tick))
    title = f"Tube-feed episodes a second, dynamics, {effort.envs} in a round"
    return Measurement(rows, [Table(title, rows)], _findings(rows))


def measure(n: int, clock: str, effort: Effort, tick: Tick) -> list[Row]:
    """Return a row for each way to play chains of n components that is timed with a clock."""
    ways = WAYS[clock]
    tasks = {way: _task(n, way, effort.envs) for way in ways}
    times = timing.take_turns(tasks, effort.rounds, 0.0, CLOCKS[clock], tick)
    rows: list[Row] = []
    for way, mine in times.items():
        row: Row = {"n": n, "clock": clock, "form": way.form, "threads": way.threads}
        row |= rate_cells("episodes", mine, effort.envs)
        rows.append(row | {"times the first": timing.ratio(times[ways[0]], mine).median})
    return rows


def _task(n: int, way: Way, envs: int) -> timing.Task:
    """Return the task to play so many episodes."""
    play, rounds = _player(n, way, envs), count()

    def prepare() -> Callable[[], None]:
        k = next(rounds)
        actions = players.log_uniform(np.random.default_rng([SEED, n, k]), n, envs)
        return lambda: play(SEED + k * envs, actions)

    return prepare


def _player(n: int, way: Way, envs: int) -> Callable[[int, NDArray[np.float32]], None]:
    """Return what plays episodes, given the first one's seed and the actions."""
    options: dict[str, Any] = {"components": n, "actions": "box", "baseline": None}
    if way.form == SINGLE:
        return partial(players.play_single, players.single(TUBE_FEED, **options))
    return partial(players.play_vector, players.vector(TUBE_FEED, envs, way.threads, **options))


def _findings(rows: list[Row]) -> list[str]:
    found: list[str] = []
    clocks = {1: CORE, 2: WALL}
    for threads, wanted in WANTED.items():
        for row in tables.select(rows, n=COMPONENTS, threads=threads, clock=clocks[threads]):
            rate = float(row["episodes/s"])
            cores = "one core" if threads == 1 else f"{threads} threads"
            found.append(
                f"n = {COMPONENTS}, {row['form']}, {cores}: {rate:.0f} episodes/s; "
                f"{rate_verdict(rate, wanted)}"
            )
    return found


def draw(rows: list[Row]) -> Any:
    """Episodes a second against the length, a panel a clock."""
    figure, axes = plotting.panels(len(WAYS), "Tube-feed episodes a second, dynamics")
    for axis, (clock, ways) in zip(axes, WAYS.items(), strict=True):
        for k, way in enumerate(ways):
            mine = tables.select(rows, clock=clock, form=way.form, threads=way.threads)
            axis.errorbar(
                tables.numbers(mine, "n"),
                tables.numbers(mine, "episodes/s"),
                players.rate_quartiles(mine, "episodes/s"),
                color=plotting.COLOURS[k + 1],
                marker=plotting.MARKERS[k],
                markersize=5,
                capsize=3,
                label=f"{way}",
            )
        wanted = WANTED[max(way.threads for way in ways)]
        axis.plot(COMPONENTS, wanted, "_", color=plotting.INK, markersize=22, markeredgewidth=2)
        axis.annotate(
            f"asked for: {wanted:g}",
            (COMPONENTS, wanted),
            (14, -3),
            textcoords="offset points",
            fontsize=9,
            color=plotting.INK,
        )
        axis.set_yscale("log")
        axis.set_title(clock, fontsize=11)
        axis.set_xlabel("components n")
        axis.set_xticks(sorted(tables.distinct(rows, "n")))
        plotting.legend(axis, "lower left")
    axes[0].set_ylabel("episodes a second")
    return figure


def quasistatic(quick: bool, progress: Progress) -> Measurement:
    """Measure steps without dynamics in every form, with and without shaping."""
    steps, rounds = (10 * ENVS, 3) if quick else (100 * ENVS, 15)
    tasks = {
        (form, shaping): players.stepping(
            TUBE_FEED, envs, steps, STEPS_SEED, fidelity="quasistatic", shaping=kind
        )
        for (form, envs), (shaping, kind) in product(FORMS.items(), SHAPINGS.items())
    }
    times = timing.take_turns(tasks, rounds, 0.0, tick=lambda share: progress(share, "steps"))
    rows: list[Row] = []
    findings: list[str] = []
    for (form, shaping), mine in times.items():
        row: Row = {"form": form, "shaping": shaping, **rate_cells("steps", mine, steps)}
        rows.append(row | {"µs a step": 1e6 * mine.median / steps})
        rate = float(row["steps/s"])
        findings.append(
            f"{form}, shaping {shaping}: {rate:,.0f} steps/s on one core; "
            f"{rate_verdict(rate, STEPS_WANTED)}"
        )
    title = "Quasistatic tube-feed steps a second on one core, n = 6"
    return Measurement(rows, [Table(title, rows)], findings)


def draw_quasistatic(rows: list[Row]) -> Any:
    """Draw steps a second as bars."""
    figure, axes = plotting.panels(1, "Quasistatic tube-feed steps a second, one core", 7.0, 3.2)
    axis, places = axes[0], np.arange(len(rows))
    quartiles = players.rate_quartiles(rows, "steps/s")
    axis.barh(
        places,
        tables.numbers(rows, "steps/s"),
        xerr=quartiles,
        color=plotting.COLOURS[1],
        capsize=3,
    )
    axis.set_yticks(places, [f"{row['form']}, shaping {row['shaping']}" for row in rows])
    axis.invert_yaxis()
    axis.set_xlabel("steps/s")
    axis.axvline(STEPS_WANTED, color=plotting.INK, linestyle="--", linewidth=1.0)
    return figure
