"""Smooth motions to integrate, and integrators under one signature."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from magfold_bench.laws import integrators
from magfold_env.engine.state import Array, Model, Work
from magfold_env.engine.workspace import new_work
from magfold_env.scene import Scene, load_scene
from magfold_env.simulation.pack import pack

GRAVITY = 9.81  # [m/s²] of the time unit √(d/g)
PERIODS = 6.0  # length of a run in that unit


@dataclass(frozen=True, eq=False)
class SmoothProblem:
    """A pinned chain without contact and friction, from rest to a given time."""

    name: str
    scene: Scene
    """With the run's length as its duration."""

    @property
    def until(self) -> float:
        """Length of the run [s]."""
        return self.scene.duration

    @cached_property
    def model(self) -> Model:
        """The chain as the engine's kernels see it."""
        return pack(self.scene)

    @cached_property
    def work(self) -> Work:
        """Scratch space of the engine's kernels."""
        return new_work(self.model)

    def start(self) -> Array:
        """Return headings and base, then their rates, at the beginning, shape (2 (n + 2),)."""
        n = self.scene.n
        y = np.zeros(2 * (n + 2))
        y[1:n] = np.cumsum(np.asarray(self.scene.start_angles))
        return y


def pendulum(n: int) -> SmoothProblem:
    """Return a chain without magnets that swings down from a horizontal line."""
    scene = load_scene("pendulum-3").replace(sequence=("NNNN",) * n, start_angles=(0.0,) * (n - 1))
    return SmoothProblem(f"pendulum, n = {n}", scene.replace(duration=longest(scene)))


def longest(scene: Scene) -> float:
    """Return 6 √(d/g) for the distance d of a component's hinges [s]."""
    return PERIODS * math.sqrt(scene.casing.diagonal / GRAVITY)


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


class Run(NamedTuple):
    """Where a run ended and what it cost."""

    angles: Array  # headings [rad], shape (n,)
    evaluations: int


def _dp54(model: Model, work: Work, y: Array, until: float, tolerance: float) -> int:
    return integrators.runge_kutta(model, work, y, until, tolerance, integrators.dp54())


def _dop853(model: Model, work: Work, y: Array, until: float, tolerance: float) -> int:
    return integrators.runge_kutta(model, work, y, until, tolerance, integrators.dop853())


EULER = Integrator("double Euler", fixed=integrators.double_euler)
VERLET = Integrator("velocity Verlet", fixed=integrators.velocity_verlet)
MIDPOINT = Integrator("implicit midpoint", fixed=integrators.implicit_midpoint)
DP54 = Integrator("DP5(4)", adaptive=_dp54)
DOP853 = Integrator("DOP853", adaptive=_dop853)
ADAMS = Integrator("Adams PECE", adaptive=integrators.adams)

FIXED = (EULER, VERLET, MIDPOINT)
ADAPTIVE = (DP54, DOP853, ADAMS)
