"""Tube-feed episodes per second, in single and in vector environments.

Episodes are simulated at the default tolerance until the chains have settled. Magnets are random,
and speeds are log-uniform over their whole range. In a round, all contestants play the same
episodes, one after another or in parallel. Every round has new episodes, because some take a
hundred times as long as others. One core is timed by processor time, threads by a wall clock.
"""

import time
from collections.abc import Callable
from functools import partial
from itertools import count, product
from typing import Any, NamedTuple

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from numpy.typing import NDArray

from magfold_bench import tables, timing
from magfold_bench.presentation import Lines
from magfold_bench.tables import Measurement, Progress, Row, Table, Tick
from magfold_env.envs import register_envs

TUBE_FEED = "MagFold/TubeFeed-v0"
ENVS = 64
"""Number of environments in a vector environment."""

Single = gymnasium.Env[Any, Any]
Vector = VectorEnv[Any, Any, Any]

LENGTHS = (4, 6, 8, 12)
SEED = 17
COMPONENTS = 6  # length of the chains to which most requirements apply


class Way(NamedTuple):
    """The kind of environment and the number of threads that play the episodes."""

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
"""Contestants that take turns, by the clock that times them."""
WANTED = {
    (CORE, Way(SINGLE, 1), COMPONENTS): 250.0,
    (CORE, Way(VECTOR, 1), COMPONENTS): 350.0,
    (WALL, Way(VECTOR, 2), COMPONENTS): 620.0,
    (CORE, Way(VECTOR, 1), 12): 20.0,
}
"""Required episodes per second, by clock, way and length."""


class Effort(NamedTuple):
    """How much a run of the benchmark measures."""

    lengths: tuple[int, ...]
    envs: int
    rounds: int


QUICK = Effort((COMPONENTS,), 4, 2)
FULL = Effort(LENGTHS, ENVS, 7)


def single(**options: Any) -> Single:
    """Return one environment as users create it, with Gymnasium's default wrappers."""
    register_envs()
    return gymnasium.make(TUBE_FEED, **options)


def vector(count: int, threads: int = 1, **options: Any) -> Vector:
    """Return ``count`` parallel environments, which reset within the step that ends an episode.

    They are stepped on ``threads`` threads.
    """
    register_envs()
    kind: dict[str, Any] = {"autoreset_mode": AutoresetMode.SAME_STEP, "threads": threads}
    return gymnasium.make_vec(TUBE_FEED, num_envs=count, **kind, **options)


def play_single(env: Single, seed: int, actions: NDArray[Any]) -> None:
    """Play, one after another, the episodes that `play_vector` plays in parallel.

    The episodes' seeds count up from ``seed``; actions have the shape (steps, episodes, …).
    """
    for k in range(actions.shape[1]):
        env.reset(seed=seed + k)
        for action in actions[:, k]:
            _, _, terminated, truncated, _ = env.step(action)
            if terminated or truncated:
                break


def play_vector(env: Vector, seed: int, actions: NDArray[Any]) -> None:
    """Play an episode in every environment; the arguments are those of `play_single`."""
    env.reset(seed=seed)
    for action in actions:
        env.step(action)


def run(quick: bool, progress: Progress) -> Measurement:
    """Measure the rate of episodes with chains of every length."""
    effort = QUICK if quick else FULL
    rows: list[Row] = []
    cases = list(product(effort.lengths, WAYS))
    for (n, clock), tick in tables.each_case(progress, cases, lambda case: f"n = {case[0]}"):
        rows.extend(measure(n, clock, effort, tick))
    title = f"Tube-feed episodes per second, dynamics, {effort.envs} per round"
    return Measurement(rows, [Table(title, rows)], _findings(rows))


def measure(n: int, clock: str, effort: Effort, tick: Tick) -> list[Row]:
    """Return a row for each way to play episodes with chains of n components, timed by a clock."""
    ways = WAYS[clock]
    tasks = {way: _task(n, way, effort.envs) for way in ways}
    times = timing.take_turns(tasks, effort.rounds, 0.0, CLOCKS[clock], tick)
    rows: list[Row] = []
    for way, mine in times.items():
        row: Row = {"n": n, "clock": clock, "way": str(way)}
        spread = mine.spread
        row |= {
            "episodes/s": effort.envs / spread.median,
            "lower quartile": effort.envs / spread.high,
            "upper quartile": effort.envs / spread.low,
            "times the first": timing.ratio(times[ways[0]], mine).median,
        }
        rows.append(row)
    return rows


def _task(n: int, way: Way, envs: int) -> timing.Task:
    """Return the task that plays `envs` episodes."""
    options: dict[str, Any] = {"components": n, "actions": "box", "baseline": None}
    if way.form == SINGLE:
        play = partial(play_single, single(**options))
    else:
        play = partial(play_vector, vector(envs, way.threads, **options))
    rounds = count()

    def prepare() -> Callable[[], None]:
        k = next(rounds)
        # Every magnet is N or S with equal probability, and speeds are log-uniform.
        drawn = np.random.default_rng([SEED, n, k]).uniform(-1.0, 1.0, (n, envs, 5))
        actions = drawn.astype(np.float32)
        return lambda: play(SEED + k * envs, actions)

    return prepare


def _findings(rows: list[Row]) -> list[str]:
    found: list[str] = []
    for (clock, way, n), wanted in WANTED.items():
        for row in tables.select(rows, n=n, way=str(way), clock=clock):
            rate = float(row["episodes/s"])
            cores = "one core" if way.threads == 1 else f"{way.threads} threads"
            found.append(
                f"n = {n}, {way.form}, {cores}: {rate:.0f} episodes/s; at least "
                f"{wanted:,.0f} are required: {tables.verdict(rate >= wanted)}"
            )
    return found


DIAGRAM = Lines("Tube-feed episodes per second, dynamics", "n", "episodes/s", "way", ("clock",))
