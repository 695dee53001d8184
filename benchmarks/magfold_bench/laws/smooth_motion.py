"""Smooth motions to integrate, and integrators under one signature."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from magfold_bench.laws import integrators
from magfold_bench.laws.overlap import squares_apart
from magfold_env.engine.contact.boxes import APART
from magfold_env.engine.state import Array, Model, Work
from magfold_env.engine.workspace import new_work
from magfold_env.scene import Scene, load_scene
from magfold_env.shapes import centres
from magfold_env.simulation.pack import pack
from magfold_env.simulation.session import Session
from magfold_env.simulation.simulate import simulate

GRAVITY = 9.81  # [m/s²] of the time unit √(d/g)
PERIODS = 6.0  # length of a run in that unit
FRAME_RATE = 5000.0  # [1/s] at which the first contact is looked for
STEPS_TO_CONTACT = 2000  # many times what it takes; then magnets pass through each other, slowly
BEFORE_CONTACT = 0.95  # share of the time until the first contact
PARTS = 6  # equal parts of a run, after each of which errors are looked at


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


def magnetic_chain() -> SmoothProblem:
    """Return the paper's third sequence, pinned, until shortly before something touches."""
    scene = load_scene("paper/sequence-3").replace(mount="pinned", friction=0.0, contact=False)
    scene = scene.draw(np.random.default_rng(0))
    scene = scene.replace(duration=longest(scene))
    first = first_contact(scene)
    return SmoothProblem(
        f"magnets, n = {scene.n}",
        scene.replace(duration=min(BEFORE_CONTACT * first, scene.duration)),
    )


def longest(scene: Scene) -> float:
    """Return 6 √(d/g) for the distance d of a component's hinges [s]."""
    return PERIODS * math.sqrt(scene.casing.diagonal / GRAVITY)


def first_contact(scene: Scene) -> float:
    """Return when a joint first reaches its stop or two casings meet [s]; ∞ if none do."""
    fine = scene.replace(solver={"tolerance": 1e-6, "max_steps": STEPS_TO_CONTACT})
    run = simulate(fine, frame_rate=FRAME_RATE).trajectory
    assert run is not None
    for time, angles in zip(run.time, run.angles, strict=True):
        if np.abs(np.diff(angles)).max(initial=0.0) >= math.pi / 2 or overlap(scene, angles):
            return float(time)
    return math.inf


def overlap(scene: Scene, angles: Array) -> bool:
    """Whether two casings that are not near neighbours overlap; stops keep those apart."""
    side = scene.casing.side
    return squares_apart(centres(angles, side), angles, side, APART) < 0.0


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
