"""Energy that integrators lose or win from one time step to the next, on a pendulum of three."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from magfold_env.laws.mechanics import kinetic_energy, weight_energy
from magfold_env.laws.smooth_motion import Integrator, SmoothProblem, pendulum
from magfold_env.paper.quoted import PENDULUM_STEPS
from magfold_env.scene import Scene
from magfold_env.simulation.simulate import simulate

Floats = npt.NDArray[np.float64]

COMPONENTS = 3
MARGIN = 0.5  # time steps beyond the last frame, so that rounding does not lose it


def problem() -> SmoothProblem:
    """Return the paper's pendulum, which swings down from a horizontal line."""
    return pendulum(COMPONENTS)


def energy(scene: Scene, angles: Floats, rates: Floats) -> Floats:
    """Return kinetic and potential energy [J] of frames, shape (m,)."""
    still = np.zeros((*angles.shape[:-1], 2))
    return kinetic_energy(scene, angles, rates, still) + weight_energy(scene, angles, np.zeros(2))


def depth(scene: Scene) -> float:
    """Return the energy that there is to swing with [J]: from the start to hanging straight."""
    hanging, level = np.full(scene.n, -np.pi / 2), np.zeros(scene.n)
    base = np.zeros(2)
    return float(weight_energy(scene, level, base) - weight_energy(scene, hanging, base))


def change(scene: Scene, angles: Floats, rates: Floats) -> float:
    """Return the mean change of the energy between frames, as a share of `depth`.

    It is infinite where numbers broke down.
    """
    if not (np.isfinite(angles).all() and np.isfinite(rates).all()):
        return math.inf
    return float(np.abs(np.diff(energy(scene, angles, rates))).mean()) / depth(scene)


def integrator_change(method: Integrator, step: float, tolerance: float) -> float:
    """Return the mean change a time step [s]; adaptive methods take as many as they need in it."""
    swinging = problem()
    scene, n = swinging.scene, swinging.scene.n
    y = swinging.start()
    frames = np.zeros((PENDULUM_STEPS + 1, y.size))
    frames[0] = y
    advance = _advance(method, swinging, step, tolerance)
    for k in range(PENDULUM_STEPS):
        advance(y)
        frames[k + 1] = y
    rates = y.size // 2  # where they begin
    return change(scene, frames[:, :n], frames[:, rates : rates + n])


def _advance(
    method: Integrator, swinging: SmoothProblem, step: float, tolerance: float
) -> Callable[[Floats], object]:
    """Return what advances a state by one time step, in place."""
    model, work = swinging.model, swinging.work
    fixed, adaptive = method.fixed, method.adaptive
    if fixed is not None:
        return lambda y: fixed(model, work, y, step, 1)
    assert adaptive is not None
    return lambda y: adaptive(model, work, y, step, tolerance)


def engine_change(step: float, tolerance: float) -> float:
    """Return the mean change that the engine makes between frames one time step [s] apart."""
    scene = problem().scene.replace(
        duration=(PENDULUM_STEPS + MARGIN) * step, solver={"tolerance": tolerance}
    )
    fold = simulate(scene, frame_rate=1.0 / step)
    assert fold.trajectory is not None
    return change(scene, fold.trajectory.angles, fold.trajectory.rates)
