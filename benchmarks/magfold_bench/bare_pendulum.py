"""A lower bound on the time to simulate a swinging chain: one bare loop for a pinned pendulum.

The loop takes the engine's own steps, with Dormand and Prince's pair, the same error estimate and
the same rule for the next step, so it needs as many evaluations as the engine. It omits everything
that a pendulum does not need, such as magnets, contact, friction and recording, and the checks for
them. Accelerations come from `recursion`, the shortest kernel of this project that computes them.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from magfold_env.engine.chain import recursion
from magfold_env.engine.compile.by_pointer import by_pointer, reference
from magfold_env.engine.compile.jit import inlined, kernel
from magfold_env.engine.elementary import inverse_root
from magfold_env.engine.state import Array, Bodies, copy
from magfold_env.engine.stepping.stages import ERROR, LOCAL, ORDER, SLOW, STAGES, WEIGHT
from magfold_env.engine.stepping.step_length import (
    CAUTION,
    EASY,
    LARGEST_GROWTH,
    LONGEST_STEP,
)
from magfold_env.scene import Scene
from magfold_env.shapes import headings
from magfold_env.simulation.pack import pack

FIRST = 0.1  # first step, in units of 1 / typical rate


@by_pointer
class Pendulum(NamedTuple):
    """A chain of n components, its state, and scratch space for a step."""

    bodies: Bodies
    gravity_x: float  # [m/s²]
    gravity_y: float
    typical_rate: float  # a typical rate [rad/s]
    tolerance: float  # [rad]
    q: Array  # headings, (n,) [rad]
    v: Array  # their rates, (n,) [rad/s]
    new_q: Array  # (n,)
    new_v: Array
    stage_q: Array  # (n,)
    stage_v: Array
    slope_q: Array  # (STAGES, n)
    slope_v: Array
    force: Array  # (n,) zeros, because only gravity acts
    scratch: Array  # (recursion.ROWS, n)


@kernel
def swing(p: Pendulum, until: float) -> int:
    """Advance the pendulum to the time `until` [s] and return the number of evaluations."""
    time, step, before, last_error = 0.0, FIRST / p.typical_rate, 0.0, 0.0
    copy(p.v, p.slope_q[0], 0)
    accelerate(p, p.q, p.v, p.slope_v[0])
    evaluations = 1
    while time < until:
        growth = LARGEST_GROWTH
        while True:
            h = min(step, until - time, LONGEST_STEP)
            stages(p, h)
            evaluations += STAGES - 1
            error = step_error(p, h)
            if error <= 1.0:
                break
            growth = 1.0
            step = h * max(0.2, 0.9 * inverse_root(error, ORDER))
        if error > EASY:
            wanted = CAUTION * inverse_root(error, ORDER)
            if before > 0.0:
                trend = inverse_root(error / last_error, ORDER)
                wanted = min(wanted, wanted * trend * h / before)
            growth = min(growth, wanted)
        step = max(h * growth, 0.5 * step if h < step else 0.0)
        time = until if h >= until - time else time + h
        before, last_error = h, max(error, EASY)
        copy(p.new_q, p.q, 0)
        copy(p.new_v, p.v, 0)
        copy(p.slope_q[STAGES - 1], p.slope_q[0], 0)
        copy(p.slope_v[STAGES - 1], p.slope_v[0], 0)
    return evaluations


@inlined
def accelerate(p: Pendulum, q: Array, v: Array, out: Array) -> None:
    """Compute angular accelerations (n,) [rad/s²]; gravity acts as if the hinge accelerated."""
    recursion.accelerate(p.bodies, -p.gravity_x, -p.gravity_y, q, v, p.force, p.scratch, out)


@inlined
def stages(p: Pendulum, h: float) -> None:
    """Compute the slopes within a step of `h` seconds and the state at its end."""
    for s in range(1, STAGES):
        q, v = (p.stage_q, p.stage_v) if s < STAGES - 1 else (p.new_q, p.new_v)
        for k in range(q.size):
            dq, dv = 0.0, 0.0
            for r in range(s):
                dq += WEIGHT[s, r] * p.slope_q[r, k]
                dv += WEIGHT[s, r] * p.slope_v[r, k]
            q[k] = p.q[k] + h * dq
            v[k] = p.v[k] + h * dv
            p.slope_q[s, k] = v[k]
        accelerate(p, q, v, p.slope_v[s])


@inlined
def step_error(p: Pendulum, h: float) -> float:
    """Return the estimated error of a step, relative to the allowed error, as in the engine."""
    error = 0.0
    allowed = LOCAL * p.tolerance
    for k in range(p.q.size):
        eq, ev = 0.0, 0.0
        for s in range(STAGES):
            eq += ERROR[s] * p.slope_q[s, k]
            ev += ERROR[s] * p.slope_v[s, k]
        eq = abs(h * eq) / allowed
        ev = abs(h * ev) / (allowed * max(SLOW * p.typical_rate, abs(p.new_v[k])))
        error = max(error, eq, ev)
    return error


def pendulum(scene: Scene) -> Pendulum:
    """Return the pendulum of a concrete scene with a pinned chain, in its initial state."""
    bare = scene.mount == "pinned" and scene.magnets is None and not scene.contact
    if not bare or scene.frictions.any() or scene.start_angles is None:
        raise ValueError("scene: must be a drawn, pinned chain without magnets, friction, contact")
    n, model = scene.n, pack(scene)
    return Pendulum(
        bodies=model.bodies,
        gravity_x=model.gravity_x,
        gravity_y=model.gravity_y,
        typical_rate=model.typical_rate,
        tolerance=model.tolerance,
        q=headings(np.asarray(scene.start_angles)),
        v=np.zeros(n),
        new_q=np.zeros(n),
        new_v=np.zeros(n),
        stage_q=np.zeros(n),
        stage_v=np.zeros(n),
        slope_q=np.zeros((STAGES, n)),
        slope_v=np.zeros((STAGES, n)),
        force=np.zeros(n),
        scratch=np.zeros((recursion.ROWS, n)),
    )


def prepare_swing(scene: Scene) -> Callable[[], int]:
    """Return a function to time, which swings a scene's pendulum over the scene's duration."""
    made, until = pendulum(scene), scene.duration
    reference(made)  # finds the arrays' addresses now, outside the timed swing
    return lambda: swing(made, until)
