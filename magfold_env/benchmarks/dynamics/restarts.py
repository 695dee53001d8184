"""What an integrator pays for starting anew, as it must after every impact.

The magnetic chain's smooth motion is cut into equal arcs, each integrated without knowledge of the
one before. A fold consists of such arcs: high orders, and methods that build on past steps, lose
on short ones what they win on long ones.
"""

from __future__ import annotations

import numpy as np

from magfold_env.benchmarks.dynamics.smooth import EXACT
from magfold_env.engine.state import Array
from magfold_env.laws.smooth_motion import (
    ADAPTIVE,
    DOP853,
    Integrator,
    SmoothProblem,
    magnetic_chain,
)
from magfold_env.reporting.tables import Measurement, Progress, Row, Table

ARCS = (1, 4, 16)
TOLERANCES = tuple(10.0 ** (-k / 2) for k in range(4, 23))
TARGETS = (1e-3, 1e-6, 1e-9)  # errors at which methods are compared [rad]


def run(quick: bool, progress: Progress) -> Measurement:
    """Count the evaluations that each method needs, by the number of arcs."""
    problem = magnetic_chain()
    exact = DOP853.prepare(problem, EXACT)().angles
    tolerances = TOLERANCES[::2] if quick else TOLERANCES
    rows: list[Row] = []
    shown: list[Row] = []
    for k, method in enumerate(ADAPTIVE):
        progress(k / len(ADAPTIVE), f"restarts: {method.name}")
        for arcs in ARCS:
            mine = [_row(problem, method, tolerance, arcs, exact) for tolerance in tolerances]
            cells: Row = {"method": method.name, "arcs": arcs}
            cells |= {f"evals, {error:g}": fewest(mine, error) for error in TARGETS}
            shown.append(cells)
            rows.extend(mine)
    title = f"Evaluations for an error [rad], motion cut into arcs: {problem.name}"
    return Measurement("restarts", rows, [Table(title, shown)])


def in_arcs(
    problem: SmoothProblem, method: Integrator, tolerance: float, arcs: int
) -> tuple[Array, int]:
    """Headings (n,) at the end, and evaluations, of a run in so many arcs of equal length."""
    assert method.adaptive is not None
    y, length, count = problem.start(), problem.until / arcs, 0
    for _ in range(arcs):
        count += method.adaptive(problem.model, problem.work, y, length, tolerance)
    return y[: problem.scene.n], count


def _row(
    problem: SmoothProblem, method: Integrator, tolerance: float, arcs: int, exact: Array
) -> Row:
    angles, count = in_arcs(problem, method, tolerance, arcs)
    return {
        "method": method.name,
        "arcs": arcs,
        "tolerance [rad]": tolerance,
        "error [rad]": float(np.abs(angles - exact).max()),
        "evaluations": count,
    }


def fewest(rows: list[Row], error: float) -> float:
    """Fewest evaluations of the settings that reach an error; nan if none does."""
    counts = [float(row["evaluations"]) for row in rows if float(row["error [rad]"]) <= error]
    return min(counts, default=float("nan"))
