"""Who computes a chain's accelerations: this engine, the paper's dense equation, and the peers.

Every contender is built for one problem, tells its accelerations once, so that they can be
compared before anything is timed, and does many evaluations a call, so that the call costs nothing.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any

import numpy as np

from magfold_env.benchmarks.dynamics.chain_problem import GRAVITY, ChainProblem
from magfold_env.engine.chain import lanes as batch
from magfold_env.engine.chain import recursion
from magfold_env.engine.compile.jit import allocating_kernel
from magfold_env.engine.state import Array, Bodies

SCALAR = "magfold, one chain"
LANES = f"magfold, {batch.LANES} chains at once"
DENSE = "eq. 39 dense, NumPy"
PINOCCHIO = "Pinocchio aba"
MUJOCO = "MuJoCo mj_step"

BASE = (-GRAVITY[0], -GRAVITY[1])


@dataclass(frozen=True, eq=False)
class Contender:
    """One way to find the accelerations of one problem."""

    accelerations: Array
    """Of the headings (n,) [rad/s²]."""
    work: Callable[[], object]
    """What is timed."""
    evaluations: int
    """How many chains' accelerations it finds."""


Build = Callable[[ChainProblem], Contender]


@allocating_kernel
def repeat_scalar(
    times: int,
    bodies: Bodies,
    base: tuple[float, float],
    heading: Array,
    rate: Array,
    force: Array,
    scratch: Array,
    out: Array,
) -> None:
    """Find the same accelerations again and again."""
    for _ in range(times):
        recursion.accelerate(bodies, base[0], base[1], heading, rate, force, scratch, out)


@allocating_kernel
def repeat_lanes(times: int, bodies: Bodies, base: tuple[float, float], lanes: Array) -> None:
    """Do the same for a block of chains."""
    for _ in range(times):
        batch.accelerate_lanes(bodies, base[0], base[1], lanes)


def scalar(problem: ChainProblem) -> Contender:
    """One chain after the other."""
    out, scratch = np.zeros(problem.n), np.zeros((recursion.ROWS, problem.n))
    given = (BASE, problem.angles, problem.rates, problem.forces, scratch, out)
    times = _times(problem.n, 20_000)
    repeat_scalar(1, problem.bodies, *given)
    return Contender(out.copy(), lambda: repeat_scalar(times, problem.bodies, *given), times)


def lanes(problem: ChainProblem) -> Contender:
    """`batch.LANES` chains side by side; the first is the problem's, the others move slower."""
    n, bodies = problem.n, problem.bodies
    block = batch.new_lanes(batch.LANES, n)[0]
    slower = 1.0 - np.arange(batch.LANES) / batch.LANES
    block[:n, batch.HEADING] = np.outer(problem.angles, slower)
    block[:n, batch.RATE] = np.outer(problem.rates, slower)
    block[:n, batch.FORCE] = problem.forces[:, None]
    times = _times(n, 5_000)
    repeat_lanes(1, bodies, BASE, block)
    found = block[1:, batch.ACCELERATION, 0].copy()
    return Contender(found, lambda: repeat_lanes(times, bodies, BASE, block), times * batch.LANES)


def dense(problem: ChainProblem) -> Contender:
    """Solve the paper's eq. 39 as it stands; what does not depend on the state is found before."""
    bodies, n = problem.bodies, problem.n
    levers = np.tril(np.broadcast_to(bodies.length, (n, n)), -1) + np.diag(bodies.reach)
    coupling = levers.T @ (bodies.mass[:, None] * levers)
    inertia = np.diag(bodies.inertia)
    weight_x, weight_y = (g * (levers.T @ bodies.mass) for g in GRAVITY)
    angles, rates, forces = problem.angles, problem.rates, problem.forces

    def accelerations() -> Array:
        apart = angles[:, None] - angles
        pull = forces + np.cos(angles) * weight_y - np.sin(angles) * weight_x
        pull -= (coupling * np.sin(apart)) @ rates**2
        mass = coupling * np.cos(apart) + inertia
        return np.asarray(np.linalg.solve(mass, pull), dtype=np.float64)

    return Contender(accelerations(), accelerations, 1)


def pinocchio(problem: ChainProblem) -> Contender:
    """Featherstone's articulated-body algorithm in three dimensions, in C++, called from Python."""
    pin: Any = importlib.import_module("pinocchio")
    bodies = problem.bodies
    model = pin.Model()
    model.gravity.linear = np.array([*GRAVITY, 0.0])
    joint, place = 0, pin.SE3.Identity()
    for i in range(problem.n):
        joint = model.addJoint(joint, pin.JointModelRZ(), place, f"joint {i}")
        centre = np.array([bodies.reach[i], 0.0, 0.0])
        inertia = pin.Inertia(bodies.mass[i], centre, bodies.inertia[i] * np.eye(3))
        model.appendBodyToJoint(joint, inertia, pin.SE3.Identity())
        place = pin.SE3(np.eye(3), np.array([bodies.length[i], 0.0, 0.0]))
    data = model.createData()
    aba: Any = pin.aba
    # Of its two conventions the faster one.
    given = (problem.joint_angles, problem.joint_rates, problem.torques, pin.Convention.WORLD)
    times = _times(problem.n, 2_000)

    def work() -> None:
        for _ in range(times):
            aba(model, data, *given)

    return Contender(np.cumsum(aba(model, data, *given)), work, times)


def mujoco(problem: ChainProblem) -> Contender:
    """MuJoCo's step, forward dynamics and explicit Euler, repeated in C.

    It is so short that the chain stays where it is.
    """
    mj: Any = importlib.import_module("mujoco")
    bodies = problem.bodies
    spec = mj.MjSpec()
    spec.option.gravity = [*GRAVITY, 0.0]
    spec.option.timestep = 1e-12
    spec.option.disableflags = mj.mjtDisableBit.mjDSBL_CONTACT
    body, place = spec.worldbody, 0.0
    for i in range(problem.n):
        body = body.add_body(
            pos=[place, 0.0, 0.0],
            mass=bodies.mass[i],
            ipos=[bodies.reach[i], 0.0, 0.0],
            inertia=[bodies.inertia[i]] * 3,
            explicitinertial=True,
        )
        body.add_joint(type=mj.mjtJoint.mjJNT_HINGE, axis=[0.0, 0.0, 1.0])
        place = bodies.length[i]
    model = spec.compile()
    data = mj.MjData(model)
    data.qpos[:] = problem.joint_angles
    data.qvel[:] = problem.joint_rates
    data.qfrc_applied[:] = problem.torques
    mj.mj_forward(model, data)
    found = np.cumsum(data.qacc)
    times = _times(problem.n, 500)
    return Contender(found, lambda: mj.mj_step(model, data, times), times)


def missing() -> list[str]:
    """Names of the peers that are not installed; the extra ``peers`` brings them."""
    needs = {PINOCCHIO: "pinocchio", MUJOCO: "mujoco"}
    return [name for name, module in needs.items() if find_spec(module) is None]


BUILDS: dict[str, Build] = {
    SCALAR: scalar,
    LANES: lanes,
    PINOCCHIO: pinocchio,
    MUJOCO: mujoco,
    DENSE: dense,
}

# Longer chains would take minutes or many gigabytes: these keep matrices of n² numbers or more.
LONGEST = {PINOCCHIO: 450, MUJOCO: 1000, DENSE: 1000}


def _times(n: int, components: int) -> int:
    """How often to repeat an evaluation, so that about ``components`` components are done."""
    return max(1, components // n)
