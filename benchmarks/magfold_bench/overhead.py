"""The time that Python adds to a vector environment's step, by number of environments.

There are three measurements. The first step of an episode feeds a component without simulation, so
the whole step counts. In intermediate steps, and in the last step, in which every episode ends and
another one begins, only the time outside the compiled kernels counts.
"""

import sys
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from types import ModuleType
from typing import Any, cast, get_args

import numpy as np

from magfold_bench import tables, timing
from magfold_bench.episodes import Vector, vector
from magfold_bench.presentation import Lines
from magfold_bench.tables import Measurement, Progress, Row, Table, Tick
from magfold_env.engine.state import Array
from magfold_env.envs.tasks.setup import Fidelity

COUNTS = (1, 4, 16, 64, 256)
COMPONENTS = 6
FIRST, ON_THE_WAY, LAST = "first step", "steps on the way", "last step"
WANTED = (20.0, 0.5)  # largest allowed µs per step, and µs per environment
SEED = 29
PACKAGE = "magfold_env."


@contextmanager
def watched_kernels() -> Generator[Callable[[], float]]:
    """Yield a function that returns the total time [s] of Python's calls to kernels so far.

    The time includes kernels that these kernels call, and the cost of a call before the kernel
    begins. All kernels must be compiled beforehand, because the compiler cannot use watched ones.
    """
    inside = 0.0

    def watched(kernel: Callable[..., Any]) -> Callable[..., Any]:
        def call(*arguments: Any) -> Any:
            nonlocal inside
            begun = time.thread_time()
            result = kernel(*arguments)
            inside += time.thread_time() - begun
            return result

        return call

    found: list[tuple[ModuleType, str, Any]] = [
        (module, name, value)
        for key, module in list(sys.modules.items())
        if key.startswith(PACKAGE)
        for name, value in list(vars(module).items())
        if hasattr(value, "py_func") and hasattr(value, "overloads")  # a compiled function
    ]
    for module, name, kernel in found:
        setattr(module, name, watched(kernel))
    try:
        yield lambda: inside
    finally:
        for module, name, kernel in found:
            setattr(module, name, kernel)


def run(quick: bool, progress: Progress) -> Measurement:
    """Measure steps with both fidelities and every number of environments."""
    counts, rounds = ((1, 4), 3) if quick else (COUNTS, 9)
    found = Measurement()
    fidelities: tuple[Fidelity, ...] = get_args(Fidelity)
    for fidelity, tick in tables.each_case(progress, fidelities):
        found.rows.extend(measure(fidelity, counts, rounds, tick))
    for fidelity in fidelities:
        mine = tables.select(found.rows, fidelity=fidelity)
        lines: dict[int, Row] = {n: {"envs": n, "wanted": allowed(n)} for n in counts}
        for row in mine:
            lines[int(row["envs"])][str(row["measured on"])] = row["time [µs]"]
        title = f"Python's share of a vector step, {fidelity}, µs"
        found.tables.append(Table(title, list(lines.values())))
        for way in tables.distinct(mine, "measured on"):
            found.findings.append(_finding(tables.select(mine, {"measured on": way})))
    return found


def measure(fidelity: Fidelity, counts: tuple[int, ...], rounds: int, tick: Tick) -> list[Row]:
    """Return a row for each number of environments and each kind of measurement."""
    envs = {count: vector(count, components=COMPONENTS, fidelity=fidelity) for count in counts}

    def first_step(env: Vector) -> timing.Task:
        (action,) = drawn_actions(env, 1)

        def prepare() -> Callable[[], object]:
            env.reset()
            return lambda: env.step(action)

        return prepare

    firsts = {count: first_step(env) for count, env in envs.items()}
    first = timing.take_turns(firsts, rounds, tick=lambda share: tick(0.5 * share))
    rows: list[Row] = []
    for k, (count, env) in enumerate(envs.items()):
        outside = outside_kernels(env, rounds)
        taken = {
            FIRST: first[count],
            ON_THE_WAY: timing.Timing(outside[:, 1:-1].mean(axis=1)),
            LAST: timing.Timing(outside[:, -1]),
        }
        for way, spent in taken.items():
            row: Row = {"fidelity": fidelity, "measured on": way, "envs": count}
            rows.append(row | spent.spread.time_cells("µs", 1e6))
        tick(0.5 + 0.5 * (k + 1) / len(envs))
    return rows


def drawn_actions(env: Vector, steps: int) -> list[Any]:
    """Return random actions for some steps, each with one action per environment."""
    space = cast("Any", env).action_space
    space.seed(SEED)
    return [space.sample() for _ in range(steps)]


def outside_kernels(env: Vector, rounds: int) -> Array:
    """Return the time [s] that each step of an episode spends outside kernels, (rounds, steps)."""
    actions = drawn_actions(env, COMPONENTS)
    env.reset(seed=SEED)
    for action in actions:
        env.step(action)  # compiles
    samples = np.zeros((rounds, COMPONENTS))
    with watched_kernels() as inside:
        for k in range(rounds):
            env.reset()
            for step, action in enumerate(actions):
                begun = time.thread_time() - inside()
                env.step(action)
                samples[k, step] = time.thread_time() - inside() - begun
    return samples


def fit(rows: list[Row]) -> tuple[float, float]:
    """Return µs per step and µs per environment, fitted by least squares of relative errors."""
    count, taken = tables.numbers(rows, "envs"), tables.numbers(rows, "time [µs]")
    lines = np.stack([1.0 / taken, count / taken], axis=1)
    (step, env), *_ = np.linalg.lstsq(lines, np.ones(len(rows)))
    return float(step), float(env)


def allowed(count: int) -> float:
    """Return the time limit [µs] of a step of `count` environments."""
    return WANTED[0] + WANTED[1] * count


def _finding(rows: list[Row]) -> str:
    """Return a sentence on the time of a step with one fidelity, measured in one way."""
    step, env = fit(rows)
    held = sum(float(row["time [µs]"]) <= allowed(int(row["envs"])) for row in rows)
    return (
        f"{rows[0]['fidelity']}, {rows[0]['measured on']}: {step:.3g} µs per vector step and "
        f"{env:.2g} µs per environment; at most {WANTED[0]:g} and {WANTED[1]:g} are allowed: "
        f"holds for {held} of {len(rows)} numbers of environments"
    )


DIAGRAM = Lines(
    "Python's share of a vector step", "envs", "time [µs]", "measured on", ("fidelity",)
)
