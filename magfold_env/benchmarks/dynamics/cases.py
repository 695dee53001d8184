"""One integrator at one setting on a smooth problem: its error, its evaluations, how to run it.

An error is the largest of any heading at the ends of six equal parts of the run, each reached by
a run of its own.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from magfold_env.engine.state import Array
from magfold_env.laws.smooth_motion import (
    EULER,
    PARTS,
    Integrator,
    Run,
    SmoothProblem,
    prepare_engine,
)
from magfold_env.reporting.timing import take_turns

ENGINE = "engine"
FEWEST_STEPS = 64
NEAR = 0.95  # how near, from below, errors count as the same


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


def shares() -> Array:
    """Return the ends of the equal parts of a run, as shares of it."""
    return np.arange(1, PARTS + 1) / PARTS


def task(c: Case) -> Callable[[], Callable[[], Run]]:
    """Return the whole run as something to time."""
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
        once = {"run": task(cases[-1])}
        taken = take_turns(once, rounds=1, shortest=0.0)["run"].median
        if cases[-1].error < enough or taken > seconds:
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
