"""Run time against error on smooth motion, for every integrator and for the engine itself.

Errors, as `cases` defines them, are against DOP853 at 1e-13 on the same forces.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from magfold_env.benchmarks.dynamics import dense
from magfold_env.benchmarks.dynamics.cases import (
    ENGINE,
    Case,
    case,
    engine_case,
    fixed_cases,
    key,
    same_error,
    shares,
    task,
)
from magfold_env.laws.smooth_motion import (
    ADAMS,
    ADAPTIVE,
    DOP853,
    FIXED,
    SmoothProblem,
    magnetic_chain,
    pendulum,
)
from magfold_env.reporting.tables import Measurement, Progress, Row, Table
from magfold_env.reporting.timing import Spread, Timing, ratio, take_turns

DEFAULT = 1e-3  # tolerance of a scene that names none [rad]
EXACT = 1e-13
TOLERANCES = tuple(10.0**-k for k in range(2, 12))
ENGINE_TOLERANCES = tuple(10.0**-k for k in range(2, 11))
JUDGED = tuple(10.0**-k for k in range(3, 10))  # where the engine's error must be within bounds
TARGETS = (1e-3, 1e-6, 1e-9)  # errors at which integrators are compared [rad]
ALLOWED = 10.0  # true error of the engine over its tolerance
WANTED = 20.0  # time of double Euler over the engine's, for the same error
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


def run(quick: bool, progress: Progress) -> Measurement:
    """Measure all smooth problems."""
    effort = Effort.of(quick)
    problems = [pendulum(3), pendulum(6), magnetic_chain()]
    part = Measurement("smooth", [])
    for k, problem in enumerate(problems):

        def tell(share: float, what: str, k: int = k, name: str = problem.name) -> None:
            progress((k + share) / len(problems), f"{name}: {what}")

        _measure(problem, effort, part, tell)
    if not quick:
        progress(1.0, "independent check")
        part.findings.extend(independent_check(problem) for problem in problems)
    return part


def _measure(problem: SmoothProblem, effort: Effort, part: Measurement, tell: Progress) -> None:
    tell(0.0, "reference")
    exact = [DOP853.prepare(problem, EXACT, share)().angles for share in shares()]
    second = ADAMS.prepare(problem, 1e-12)().angles
    agreement = float(np.abs(second - exact[-1]).max())
    tell(0.1, "errors")
    cases = [engine_case(problem, tolerance, exact) for tolerance in ENGINE_TOLERANCES]
    for method in ADAPTIVE:
        cases += [case(problem, method, tolerance, exact) for tolerance in TOLERANCES]
    for method in FIXED:
        cases += fixed_cases(problem, method, exact, min(TARGETS), effort.seconds)
    at_default = next(c for c in cases if c.method == ENGINE and c.setting == DEFAULT)
    match = same_error(problem, at_default.error, exact)
    tell(0.4, "times")
    tasks = {key(c): task(c) for c in [*cases, match]}
    # A call from Python costs the same whatever it integrates: seen in runs of no length.
    idle = Case("idle", 0.0, lambda _: DOP853.prepare(problem, 1.0, 0.0), 0.0, 0)
    tasks["idle"] = task(idle)
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
