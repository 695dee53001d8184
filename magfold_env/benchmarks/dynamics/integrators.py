"""The integrators that are compared, under one signature."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from magfold_env.benchmarks.dynamics.adams import adams
from magfold_env.benchmarks.dynamics.fixed_step import (
    double_euler,
    implicit_midpoint,
    velocity_verlet,
)
from magfold_env.benchmarks.dynamics.runge_kutta import dop853, dp54, runge_kutta
from magfold_env.benchmarks.dynamics.smooth_problems import SmoothProblem
from magfold_env.engine.state import Array, Model, Work
from magfold_env.simulation.session import Session

Fixed = Callable[[Model, Work, Array, float, int], int]
Adaptive = Callable[[Model, Work, Array, float, float], int]


class Unreached(RuntimeError):
    """A tolerance that an integrator could not reach."""


@dataclass(frozen=True)
class Integrator:
    """A method with either a number of steps or a tolerance as its setting."""

    name: str
    fixed: Fixed | None = None
    adaptive: Adaptive | None = None

    def prepare(
        self, problem: SmoothProblem, setting: float, share: float = 1.0
    ) -> Callable[[], Run]:
        """Return a call that integrates ``share`` of the problem's time.

        Parameters
        ----------
        setting
            Steps of the whole run, or the tolerance [rad].
        """
        model, work, y = problem.model, problem.work, problem.start()
        until = share * problem.until
        n = problem.scene.n

        def call() -> Run:
            if self.fixed is not None:
                count = self.fixed(model, work, y, until, max(round(share * setting), 1))
            else:
                assert self.adaptive is not None
                count = self.adaptive(model, work, y, until, setting)
            if count < 0:
                raise Unreached(f"{self.name}: tolerance {setting:g} is out of reach")
            return Run(y[:n].copy(), count)

        return call


@dataclass(frozen=True, eq=False)
class Run:
    """Where a run ended and what it cost."""

    angles: Array
    """Headings [rad], shape (n,)."""
    evaluations: int


def _dp54(model: Model, work: Work, y: Array, until: float, tolerance: float) -> int:
    return runge_kutta(model, work, y, until, tolerance, dp54())


def _dop853(model: Model, work: Work, y: Array, until: float, tolerance: float) -> int:
    return runge_kutta(model, work, y, until, tolerance, dop853())


EULER = Integrator("double Euler", fixed=double_euler)
VERLET = Integrator("velocity Verlet", fixed=velocity_verlet)
MIDPOINT = Integrator("implicit midpoint", fixed=implicit_midpoint)
DP54 = Integrator("DP5(4)", adaptive=_dp54)
DOP853 = Integrator("DOP853", adaptive=_dop853)
ADAMS = Integrator("Adams PECE", adaptive=adams)

FIXED = (EULER, VERLET, MIDPOINT)
ADAPTIVE = (DP54, DOP853, ADAMS)


def prepare_engine(
    problem: SmoothProblem, tolerance: float, share: float = 1.0
) -> Callable[[], Run]:
    """Return a call that lets the engine itself integrate ``share`` of the problem's time."""
    scene = problem.scene.replace(solver={"tolerance": tolerance}, duration=share * problem.until)
    session = Session(scene)

    def call() -> Run:
        session.settle()
        return Run(session.angles, session.evaluations)

    return call
