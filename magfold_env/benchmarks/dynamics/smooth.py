"""Run time against error on smooth motion, for every integrator and for the engine itself.

An error is the largest of any heading at the ends of six equal parts of the run, each reached by
a run of its own. The reference is DOP853 at 1e-13 on the same forces.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from magfold_env.benchmarks.dynamics import dense
from magfold_env.benchmarks.dynamics.integrators import (
    ADAMS,
    ADAPTIVE,
    DOP853,
    EULER,
    FIXED,
    Integrator,
    Run,
    prepare_engine,
)
from magfold_env.benchmarks.dynamics.part import Part, Progress, Row, Table
from magfold_env.benchmarks.dynamics.smooth_problems import (
    PARTS,
    SmoothProblem,
    magnetic_chain,
    pendulum,
)
from magfold_env.benchmarks.timing import Spread, Timing, ratio, take_turns
from magfold_env.engine.state import Array

ENGINE = "engine"
DEFAULT = 1e-3  # tolerance of a scene that names none [rad]
EXACT = 1e-13
TOLERANCES = tuple(10.0**-k for k in range(2, 12))
ENGINE_TOLERANCES = tuple(10.0**-k for k in range(2, 11))
JUDGED = tuple(10.0**-k for k in range(3, 10))  # where the engine's error must be within bounds
TARGETS = (1e-3, 1e-6, 1e-9)  # errors at which integrators are compared [rad]
ALLOWED = 10.0  # true error of the engine over its tolerance
WANTED = 20.0  # time of double Euler over the engine's, for the same error
FEWEST_STEPS = 64
NEAR = 0.95  # how near, from below, errors count as the same
CHECK_NODES = 4  # a pole face, in the independent check


@dataclass(frozen=True)
class Effort:
    """How much work a run of the benchmark may be."""

    seconds: float
    """Longest single integration with equal steps [s]."""
    rounds: int
    """Samples of every timing."""

    @classmethod
    def of(cls, quick: bool) -> Effort:
        """Return the effort of a quick or a full run."""
        return cls(0.02, 3) if quick else cls(0.25, 7)


@dataclass(frozen=True, eq=False)
class Case:
    """One integrator at one setting."""

    method: str
    setting: float
    """Tolerance [rad], or number of steps."""
    prepare: Callable[[float], Callable[[], Run]]
    """Takes the share of the run's time."""
    error: float
    """[rad]"""
    evaluations: int


def run(quick: bool, progress: Progress) -> Part:
    """Measure all smooth problems."""
    effort = Effort.of(quick)
    problems = [pendulum(3), pendulum(6), magnetic_chain()]
    part = Part("smooth", [])
    for k, problem in enumerate(problems):

        def tell(share: float, what: str, k: int = k, name: str = problem.name) -> None:
            progress((k + share) / len(problems), f"{name}: {what}")

        _measure(problem, effort, part, tell)
    if not quick:
        progress(1.0, "independent check")
        part.findings.extend(independent_check(problem) for problem in problems)
    return part


def _measure(problem: SmoothProblem, effort: Effort, part: Part, tell: Progress) -> None:
    tell(0.0, "reference")
    exact = [DOP853.prepare(problem, EXACT, share)().angles for share in shares()]
    second = ADAMS.prepare(problem, 1e-12)().angles
    agreement = float(np.abs(second - exact[-1]).max())
    tell(0.1, "errors")
    cases = [engine_case(problem, tolerance, exact) for tolerance in ENGINE_TOLERANCES]
    for method in ADAPTIVE:
        cases += [case(problem, method, tolerance, exact) for tolerance in TOLERANCES]
    for method in FIXED:
        cases += fixed_cases(problem, method, exact, effort.seconds)
    at_default = next(c for c in cases if c.method == ENGINE and c.setting == DEFAULT)
    match = same_error(problem, at_default.error, exact)
    tell(0.4, "times")
    tasks = {key(c): _task(c) for c in [*cases, match]}
    # A call from Python costs the same whatever it integrates: seen in runs of no length.
    idle = Case("idle", 0.0, lambda _: DOP853.prepare(problem, 1.0, 0.0), 0.0, 0)
    tasks["idle"] = _task(idle)
    times = take_turns(tasks, effort.rounds, tick=lambda share: tell(0.4 + 0.6 * share, "times"))
    overhead = times["idle"].median
    rows = [_row(problem, c, times[key(c)], overhead) for c in cases]
    part.rows.extend(rows)
    part.tables.append(_engine_table(problem, rows))
    part.tables.append(_target_table(problem, rows))
    quotient = ratio(times[key(match)], times[key(at_default)])
    part.findings.extend(_findings(problem, rows, quotient, match))
    part.findings.append(
        f"{problem.name}: DOP853 at {EXACT:g} and Adams at 1e-12 agree to {agreement:.1e} rad"
    )


def shares() -> Array:
    """Return the ends of the equal parts of a run, as shares of it."""
    return np.arange(1, PARTS + 1) / PARTS


def _task(c: Case) -> Callable[[], Callable[[], Run]]:
    return lambda: c.prepare(1.0)


def key(c: Case) -> str:
    """Return a name of a case that no other has."""
    return f"{c.method} {c.setting:.12g}"


def case(problem: SmoothProblem, method: Integrator, setting: float, exact: list[Array]) -> Case:
    """Find the error and the evaluations of an integrator at a setting."""
    return _case(method.name, setting, lambda share: method.prepare(problem, setting, share), exact)


def engine_case(problem: SmoothProblem, tolerance: float, exact: list[Array]) -> Case:
    """Find the error and the evaluations of the engine at a tolerance [rad]."""
    return _case(ENGINE, tolerance, lambda share: prepare_engine(problem, tolerance, share), exact)


def _case(
    method: str,
    setting: float,
    prepare: Callable[[float], Callable[[], Run]],
    exact: list[Array],
) -> Case:
    runs = [prepare(share)() for share in shares()]
    errors = [np.abs(run.angles - end).max() for run, end in zip(runs, exact, strict=True)]
    return Case(method, setting, prepare, float(max(errors)), runs[-1].evaluations)


def fixed_cases(
    problem: SmoothProblem, method: Integrator, exact: list[Array], seconds: float
) -> list[Case]:
    """Double the steps until the smallest target is met or a run takes too long [s]."""
    cases: list[Case] = []
    steps = FEWEST_STEPS
    while True:
        cases.append(case(problem, method, steps, exact))
        task = {"run": _task(cases[-1])}
        taken = take_turns(task, rounds=1, shortest=0.0)["run"].median
        if cases[-1].error < min(TARGETS) or taken > seconds:
            return cases
        steps *= 2


def same_error(problem: SmoothProblem, error: float, exact: list[Array]) -> Case:
    """Return double Euler with about as many steps as it needs for an error [rad].

    It is of first order: the error times the steps is nearly constant.
    """
    found = case(problem, EULER, FEWEST_STEPS, exact)
    steps = float(FEWEST_STEPS)
    for _ in range(6):
        steps = round(steps * found.error / error)
        found = case(problem, EULER, steps, exact)
        if NEAR < found.error / error <= 1.0:
            break
    return found


def _row(problem: SmoothProblem, c: Case, taken: Timing, overhead: float) -> Row:
    return {
        "problem": problem.name,
        "method": c.method,
        "setting": c.setting,
        "error [rad]": c.error,
        "evaluations": c.evaluations,
        "time [µs]": 1e6 * taken.spread.median,
        "lower quartile [µs]": 1e6 * taken.spread.low,
        "upper quartile [µs]": 1e6 * taken.spread.high,
        "call overhead [µs]": 1e6 * overhead,
    }


def _engine_table(problem: SmoothProblem, rows: list[Row]) -> Table:
    shown: list[Row] = []
    for row in rows:
        if row["method"] == ENGINE:
            ratio_to = float(row["error [rad]"]) / float(row["setting"])
            shown.append(
                {
                    "tolerance [rad]": row["setting"],
                    "error [rad]": row["error [rad]"],
                    "error / tolerance": ratio_to,
                    "evaluations": row["evaluations"],
                    "time [µs]": row["time [µs]"],
                }
            )
    return Table(f"The engine on {problem.name}", shown)


def _target_table(problem: SmoothProblem, rows: list[Row]) -> Table:
    methods = list(dict.fromkeys(str(row["method"]) for row in rows))
    shown: list[Row] = []
    for method in methods:
        mine = [row for row in rows if row["method"] == method]
        cells: Row = {"method": method}
        for target in TARGETS:
            cells[f"µs, {target:g}"] = needed(mine, "time [µs]", target)
            cells[f"evals, {target:g}"] = needed(mine, "evaluations", target)
        shown.append(cells)
    return Table(
        f"Time (calls' overhead off) and evaluations for an error [rad]: {problem.name}", shown
    )


def needed(rows: list[Row], cost: str, error: float) -> float:
    """Cost at which an error is reached, between measured settings by power laws; nan if never.

    The overhead of a call is taken off times.
    """
    errors = np.array([float(row["error [rad]"]) for row in rows])
    costs = np.array([float(row[cost]) for row in rows])
    if cost.startswith("time"):
        costs = np.maximum(costs - float(rows[0]["call overhead [µs]"]), 1e-3)
    order = np.argsort(costs)
    errors, costs = errors[order], costs[order]
    reached = np.flatnonzero(errors <= error)
    if reached.size == 0:
        return float("nan")
    k = int(reached[0])
    if k == 0:
        return float(costs[0])
    share = np.log(errors[k - 1] / error) / np.log(errors[k - 1] / max(errors[k], 1e-300))
    return float(costs[k - 1] * (costs[k] / costs[k - 1]) ** share)


def _findings(problem: SmoothProblem, rows: list[Row], quotient: Spread, match: Case) -> list[str]:
    ratios = [
        float(row["error [rad]"]) / float(row["setting"])
        for row in rows
        if row["method"] == ENGINE and row["setting"] in JUDGED
    ]
    worst = max(ratios)
    return [
        f"{problem.name}: the engine's error is at most {worst:.2g} times the tolerance, from "
        f"1e-3 to 1e-9; {ALLOWED:g} is allowed: {_verdict(worst <= ALLOWED)}",
        f"{problem.name}: double Euler takes {quotient} times the engine's time for its error at "
        f"1e-3, {match.error:.2g} rad, in {match.setting:.0f} steps; {WANTED:g} is asked for: "
        f"{_verdict(quotient.median >= WANTED)}",
    ]


def _verdict(held: bool) -> str:
    return "holds" if held else "FAILS"


def independent_check(problem: SmoothProblem) -> str:
    """Compare the reference with SciPy's solution of the dense equations, in a sentence."""
    scene = problem.scene
    if scene.magnets is not None:
        # The same fixed nodes on both sides: the check is of dynamics, not of quadrature.
        scene = scene.replace(magnets={"nodes": CHECK_NODES})
    same = SmoothProblem(problem.name, scene)
    mine = DOP853.prepare(same, EXACT)().angles
    error = float(np.abs(mine - dense.solve(scene, problem.until)).max())
    return f"{problem.name}: SciPy on dense equation 39 differs by {error:.1e} rad at the end"
