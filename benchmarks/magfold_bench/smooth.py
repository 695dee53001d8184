"""Smooth motion: run time against error, for every integrator and for the engine itself.

Errors are against DOP853 at 1e-13 on the same forces: the largest of any heading at the ends of
six equal parts of the run, each reached by a run of its own.

An impact makes an integrator start anew: so the magnetic chain's motion is also cut into equal
arcs, each integrated without knowledge of the one before. A fold consists of such arcs: high
orders, and methods that build on past steps, lose on short ones what they win on long ones.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from magfold_bench.laws import smooth_motion
from magfold_bench.laws.smooth_motion import ADAPTIVE, DOP853, Integrator, Run, SmoothProblem
from magfold_bench.presentation import panels_by
from magfold_env.engine.state import Array
from magfold_env.reporting import plotting, tables, timing
from magfold_env.reporting.tables import Measurement, Progress, Row, Table, Tick

ENGINE = "engine"
DEFAULT = 1e-3  # tolerance of a scene that names none [rad]
EXACT = 1e-13
TOLERANCES = tuple(10.0**-k for k in range(2, 12))
ENGINE_TOLERANCES = tuple(10.0**-k for k in range(2, 11))
BOUNDED = tuple(10.0**-k for k in range(3, 10))  # where the engine's error must be within bounds
TARGETS = (1e-3, 1e-6, 1e-9)  # errors at which integrators are compared [rad]
ALLOWED = 10.0  # true error of the engine over its tolerance
WANTED = 20.0  # time of double Euler over the engine's, for the same error
FEWEST_STEPS = 64
NEAR = 0.95  # how near, from below, errors count as the same

ARCS = (1, 4, 16)
ARC_TOLERANCES = tuple(10.0 ** (-k / 2) for k in range(4, 23))


class Effort(NamedTuple):
    """How much work a run of the benchmark may be."""

    seconds: float  # longest single integration with equal steps [s]
    rounds: int  # samples of every timing


QUICK, FULL = Effort(0.02, 3), Effort(0.25, 7)


@dataclass(frozen=True, eq=False)
class Case:
    """One integrator at one setting on a smooth problem."""

    method: str
    setting: float
    """Tolerance [rad], or number of steps."""
    prepare: Callable[[float], Callable[[], Run]]
    """Takes the share of the run's time."""
    error: float
    """[rad]"""
    evaluations: int

    def task(self) -> timing.Task:
        """Return the whole run as something to time."""
        return lambda: self.prepare(1.0)


def shares() -> Array:
    """Return the ends of the equal parts of a run, as shares of it."""
    return np.arange(1, smooth_motion.PARTS + 1) / smooth_motion.PARTS


def case(
    problem: SmoothProblem, method: Integrator | None, setting: float, exact: list[Array]
) -> Case:
    """Find the error and the evaluations of an integrator, or of the engine, at a setting."""

    def prepare(share: float) -> Callable[[], Run]:
        if method is None:
            return smooth_motion.prepare_engine(problem, setting, share)
        return method.prepare(problem, setting, share)

    runs = [prepare(share)() for share in shares()]
    errors = [np.abs(run.angles - end).max() for run, end in zip(runs, exact, strict=True)]
    name = ENGINE if method is None else method.name
    return Case(name, setting, prepare, float(max(errors)), runs[-1].evaluations)


def fixed_cases(
    problem: SmoothProblem,
    method: Integrator,
    exact: list[Array],
    enough: float,
    seconds: float,
) -> list[Case]:
    """Double the steps until an error is small enough [rad] or a run takes too long [s]."""
    cases: list[Case] = []
    steps = FEWEST_STEPS
    while True:
        cases.append(case(problem, method, steps, exact))
        taken = timing.take_turns({"run": cases[-1].task()}, rounds=1, shortest=0.0)["run"].median
        if cases[-1].error < enough or taken > seconds:
            return cases
        steps *= 2


def same_error(problem: SmoothProblem, error: float, exact: list[Array]) -> Case:
    """Return double Euler with about as many steps as it needs for an error [rad].

    It is of first order: the error times the steps is nearly constant.
    """
    found = case(problem, smooth_motion.EULER, FEWEST_STEPS, exact)
    steps = float(FEWEST_STEPS)
    for _ in range(6):
        steps = round(steps * found.error / error)
        found = case(problem, smooth_motion.EULER, steps, exact)
        if NEAR < found.error / error <= 1.0:
            break
    return found


def run(quick: bool, progress: Progress) -> Measurement:
    """Measure all smooth problems."""
    found = Measurement()
    problems = [
        smooth_motion.pendulum(3),
        smooth_motion.pendulum(6),
        smooth_motion.magnetic_chain(),
    ]
    for problem, tick in tables.each_case(progress, problems, lambda problem: problem.name):
        _measure(problem, QUICK if quick else FULL, found, tick)
    return found


def _measure(problem: SmoothProblem, effort: Effort, found: Measurement, tick: Tick) -> None:
    exact = [DOP853.prepare(problem, EXACT, share)().angles for share in shares()]
    second = smooth_motion.ADAMS.prepare(problem, 1e-12)().angles
    agreement = float(np.abs(second - exact[-1]).max())
    tick(0.1)
    cases = [case(problem, None, tolerance, exact) for tolerance in ENGINE_TOLERANCES]
    for method in ADAPTIVE:
        cases += [case(problem, method, tolerance, exact) for tolerance in TOLERANCES]
    for method in smooth_motion.FIXED:
        cases += fixed_cases(problem, method, exact, min(TARGETS), effort.seconds)
    at_default = next(c for c in cases if c.method == ENGINE and c.setting == DEFAULT)
    match = same_error(problem, at_default.error, exact)
    tick(0.4)
    # A call from Python costs the same whatever it integrates: seen in runs of no length.
    idle = Case("idle", 0.0, lambda _: DOP853.prepare(problem, 1.0, 0.0), 0.0, 0)
    tasks = {each: each.task() for each in [*cases, match, idle]}
    times = timing.take_turns(tasks, effort.rounds, tick=lambda share: tick(0.4 + 0.6 * share))
    rows: list[Row] = [
        {
            "problem": problem.name,
            "method": each.method,
            "setting": each.setting,
            "error [rad]": each.error,
            "evaluations": each.evaluations,
            **times[each].spread.time_cells("µs", 1e6),
            "call overhead [µs]": 1e6 * times[idle].median,
        }
        for each in cases
    ]
    found.rows.extend(rows)
    found.tables.extend(_tables(problem, rows))
    bounded = tables.select(rows, method=ENGINE)
    worst = float(_over_tolerance([row for row in bounded if row["setting"] in BOUNDED]).max())
    quotient = timing.ratio(times[match], times[at_default])
    said = [
        f"{problem.name}: the engine's error is at most {worst:.2g} times the tolerance, from "
        f"1e-3 to 1e-9; {ALLOWED:g} is allowed: {tables.verdict(worst <= ALLOWED)}",
        f"{problem.name}: double Euler takes {quotient} times the engine's time for its error at "
        f"1e-3, {match.error:.2g} rad, in {match.setting:.0f} steps; {WANTED:g} is asked for: "
        f"{tables.verdict(quotient.median >= WANTED)}",
        f"{problem.name}: DOP853 at {EXACT:g} and Adams at 1e-12 agree to {agreement:.1e} rad",
    ]
    found.findings.extend(said)


def _over_tolerance(rows: list[Row]) -> Array:
    return tables.numbers(rows, "error [rad]") / tables.numbers(rows, "setting")


def _tables(problem: SmoothProblem, rows: list[Row]) -> list[Table]:
    """Return how the engine keeps its tolerance, and what every method needs for an error."""
    mine = tables.select(rows, method=ENGINE)
    engine: list[Row] = [
        {
            "tolerance [rad]": row["setting"],
            "error [rad]": row["error [rad]"],
            "error / tolerance": share,
            "evaluations": row["evaluations"],
            "time [µs]": row["time [µs]"],
        }
        for row, share in zip(mine, _over_tolerance(mine).tolist(), strict=True)
    ]
    shown: list[Row] = []
    for method in tables.distinct(rows, "method"):
        mine = tables.select(rows, method=method)
        cells: Row = {"method": method}
        for target in TARGETS:
            cells[f"µs, {target:g}"] = needed(mine, "time [µs]", target)
            cells[f"evals, {target:g}"] = needed(mine, "evaluations", target)
        shown.append(cells)
    title = f"Time (calls' overhead off) and evaluations for an error [rad]: {problem.name}"
    return [Table(f"The engine on {problem.name}", engine), Table(title, shown)]


def needed(rows: list[Row], cost: str, error: float) -> float:
    """Cost at which an error is reached, between measured settings by power laws; nan if never.

    The overhead of a call is taken off times.
    """
    errors, costs = tables.numbers(rows, "error [rad]"), tables.numbers(rows, cost)
    if cost.startswith("time"):
        costs = np.maximum(costs - float(rows[0]["call overhead [µs]"]), 1e-3)
    order = np.argsort(costs)
    errors, costs = errors[order], costs[order]
    reached = np.flatnonzero(errors <= error)
    if reached.size == 0:
        return math.nan
    k = int(reached[0])
    if k == 0:
        return float(costs[0])
    share = np.log(errors[k - 1] / error) / np.log(errors[k - 1] / max(errors[k], 1e-300))
    return float(costs[k - 1] * (costs[k] / costs[k - 1]) ** share)


def draw(rows: list[Row]) -> Any:
    """Work-precision diagrams: error against run time, a panel a problem."""
    labels = "run time, calls' overhead off [s]", "largest error of a heading [rad]"
    title = "Smooth motion: error against run time"
    figure, panels = panels_by(rows, ("problem",), title, labels)
    for axis, here in panels:
        for k, method in enumerate(tables.distinct(rows, "method")):
            mine = tables.select(here, method=method)
            time = tables.numbers(mine, "time [µs]") - tables.numbers(mine, "call overhead [µs]")
            axis.loglog(
                1e-6 * np.maximum(time, 1.0),
                tables.numbers(mine, "error [rad]"),
                color=plotting.COLOURS[k % len(plotting.COLOURS)],
                marker=plotting.MARKERS[k % len(plotting.MARKERS)],
                markersize=5,
                linewidth=2.2 if method == ENGINE else 1.3,
                zorder=3 if method == ENGINE else 2,
                label=method,
            )
        axis.tick_params(axis="x", which="minor", labelbottom=False)
        axis.set_ylim(1e-12, 2.0)
    plotting.legend(panels[0][0], "lower left")
    return figure


def restarts(quick: bool, progress: Progress) -> Measurement:
    """Count the evaluations that each method needs, by the number of arcs."""
    problem = smooth_motion.magnetic_chain()
    exact = DOP853.prepare(problem, EXACT)().angles
    found = Measurement()
    shown: list[Row] = []
    for method, _ in tables.each_case(
        progress, ADAPTIVE, lambda method: f"restarts: {method.name}"
    ):
        for arcs in ARCS:
            mine: list[Row] = []
            for tolerance in ARC_TOLERANCES[:: 2 if quick else 1]:
                angles, count = in_arcs(problem, method, tolerance, arcs)
                mine.append(
                    {
                        "method": method.name,
                        "arcs": arcs,
                        "tolerance [rad]": tolerance,
                        "error [rad]": float(np.abs(angles - exact).max()),
                        "evaluations": count,
                    }
                )
            cells: Row = {"method": method.name, "arcs": arcs}
            cells |= {f"evals, {error:g}": fewest(mine, error) for error in TARGETS}
            shown.append(cells)
            found.rows.extend(mine)
    title = f"Evaluations for an error [rad], motion cut into arcs: {problem.name}"
    found.tables.append(Table(title, shown))
    return found


def in_arcs(
    problem: SmoothProblem, method: Integrator, tolerance: float, arcs: int
) -> tuple[Array, int]:
    """Headings (n,) at the end, and evaluations, of a run in so many arcs of equal length."""
    assert method.adaptive is not None
    y, length, count = problem.start(), problem.until / arcs, 0
    for _ in range(arcs):
        count += method.adaptive(problem.model, problem.work, y, length, tolerance)
    return y[: problem.scene.n], count


def fewest(rows: list[Row], error: float) -> float:
    """Fewest evaluations of the settings that reach an error; nan if none does."""
    counts = [float(row["evaluations"]) for row in rows if float(row["error [rad]"]) <= error]
    return min(counts, default=math.nan)
