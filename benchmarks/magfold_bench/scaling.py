"""Time to compute a chain's accelerations: this engine, the paper's equation 39, other engines.

The chain is pinned, and gravity and motors in its hinges act on it. Every contender is built for
one problem and first returns its accelerations once, which are compared before anything is timed.
Each timed call does many evaluations, so the cost of the call itself is negligible. The contenders
take turns, so that ratios compare measurements close in time. Three rows measure something else:
Pinocchio's algorithm works in three dimensions and is called from Python; the cost of a call at n =
1, with almost nothing to compute, has its own row and is subtracted from Pinocchio's other times.
MuJoCo's row is a whole step in three dimensions, with positions, velocities and constraints.
CasADi's is C that was generated for one chain's length and masses, and compiled for this processor.
"""

import importlib
import math
from collections.abc import Callable, Mapping
from importlib.util import find_spec
from shutil import which
from typing import Any, NamedTuple

import numpy as np

from magfold_bench import tables, timing
from magfold_bench.laws.mechanics import equation_39, levers
from magfold_bench.presentation import Lines
from magfold_bench.tables import Measurement, Progress, Row, Table, Tick
from magfold_env.engine.chain import recursion
from magfold_env.engine.compile.jit import allocating_kernel
from magfold_env.engine.state import Array, Bodies

GRAVITY = (0.0, -9.81)  # [m/s²]
PITCH = 0.0177  # hinge to hinge [m]
MASS = 0.0037  # [kg]


class ChainProblem(NamedTuple):
    """A chain that hangs from a fixed hinge, and its state; gravity is `GRAVITY`."""

    bodies: Bodies
    angles: Array  # headings (n,) [rad]
    rates: Array  # their rates (n,) [rad/s]
    torques: Array  # of the motors in the hinges (n,) [N·m]; motor i is fixed to component i − 1

    @property
    def n(self) -> int:
        """Number of components."""
        return self.angles.size

    @property
    def forces(self) -> Array:
        """Generalised forces (n,) [N·m] of the motors and their reactions."""
        return self.torques - np.append(self.torques[1:], 0.0)

    @property
    def joint_angles(self) -> Array:
        """Angles (n,) [rad] of components relative to the previous one, or of the first to x."""
        return np.diff(self.angles, prepend=0.0)

    @property
    def joint_rates(self) -> Array:
        """Rates of the joint angles (n,) [rad/s]."""
        return np.diff(self.rates, prepend=0.0)


def random_problem(n: int, seed: int = 0) -> ChainProblem:
    """Return a moving chain of unequal squares, bent arbitrarily within its stops."""
    rng = np.random.default_rng([seed, n])
    mass = MASS * rng.uniform(0.7, 1.3, n)
    bodies = Bodies(
        mass=mass,
        inertia=mass * PITCH**2 / 12.0 * rng.uniform(0.7, 1.3, n),
        reach=np.full(n, PITCH / 2.0),
        length=np.full(n, PITCH),
    )
    return ChainProblem(
        bodies=bodies,
        angles=np.cumsum(rng.uniform(-np.pi / 2.0, np.pi / 2.0, n)),
        rates=rng.normal(0.0, 10.0, n),
        torques=rng.normal(0.0, MASS * 9.81 * PITCH, n),
    )


SCALAR = "magfold, one chain"
LANES = f"magfold, {recursion.LANES} chains at once"
DENSE = "eq. 39 dense, NumPy"
PINOCCHIO = "Pinocchio aba"
MUJOCO = "MuJoCo mj_step"
CASADI = "CasADi, generated C"

LENGTHS = (1, 2, 6, 20, 60, 200, 450, 1000, 3000, 10_000)
QUICK_LENGTHS = (1, 6, 60, 450)
LONG = 60  # length from which growth is judged
AGREE = 1e-9  # relative to the largest acceleration, up to `LONG` components
OVERHEAD = "a call of Pinocchio"

# By length, how many times faster than Pinocchio the engine must be with a single chain.
PINOCCHIO_FACTORS = {6: 6.0, 60: 12.0, 450: 12.0}
LANES_AT, LANES_FACTOR = 6, 8.0
STEEPEST = 1.1  # power of n
QUARTILES = ("times one chain's", "lower quartile", "upper quartile")


BASE = (-GRAVITY[0], -GRAVITY[1])


class Contender(NamedTuple):
    """A way to compute the accelerations of a problem."""

    accelerations: Array  # of the headings (n,) [rad/s²]
    work: Callable[[], object]  # what is timed
    evaluations: int  # number of chains whose accelerations one call computes


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
    """Compute the same accelerations repeatedly."""
    for _ in range(times):
        recursion.accelerate(bodies, base[0], base[1], heading, rate, force, scratch, out)


@allocating_kernel
def repeat_lanes(times: int, bodies: Bodies, base: tuple[float, float], lanes: Array) -> None:
    """Compute the same accelerations of a block of chains repeatedly."""
    for _ in range(times):
        recursion.accelerate_lanes(bodies, base[0], base[1], lanes)


def scalar(problem: ChainProblem) -> Contender:
    """Compute one chain after another with the engine's kernel."""
    out, scratch = np.zeros(problem.n), np.zeros((recursion.ROWS, problem.n))
    given = (BASE, problem.angles, problem.rates, problem.forces, scratch, out)
    times = _times(problem.n, 20_000)
    repeat_scalar(1, problem.bodies, *given)
    return Contender(out.copy(), lambda: repeat_scalar(times, problem.bodies, *given), times)


def lanes(problem: ChainProblem) -> Contender:
    """Compute `recursion.LANES` chains side by side: the problem's, and slower copies of it."""
    n, bodies = problem.n, problem.bodies
    block = recursion.new_lanes(recursion.LANES, n)[0]
    slower = 1.0 - np.arange(recursion.LANES) / recursion.LANES
    block[:n, recursion.HEADING] = np.outer(problem.angles, slower)
    block[:n, recursion.RATE] = np.outer(problem.rates, slower)
    block[:n, recursion.FORCE] = problem.forces[:, None]
    times = _times(n, 5_000)
    repeat_lanes(1, bodies, BASE, block)
    found = block[1:, recursion.ACCELERATION, 0].copy()
    runs = times * recursion.LANES
    return Contender(found, lambda: repeat_lanes(times, bodies, BASE, block), runs)


def dense(problem: ChainProblem) -> Contender:
    """Solve the paper's equation 39 directly; terms that do not change are precomputed."""
    bodies = problem.bodies
    arms = levers(bodies.reach, bodies.length)
    coupling = arms.T @ (bodies.mass[:, None] * arms)
    inertia = np.diag(bodies.inertia)
    weight_x, weight_y = (g * (arms.T @ bodies.mass) for g in GRAVITY)
    angles, rates, forces = problem.angles, problem.rates, problem.forces

    def accelerations() -> Array:
        pull = forces + np.cos(angles) * weight_y - np.sin(angles) * weight_x
        return equation_39(coupling, inertia, angles, rates, pull)

    return Contender(accelerations(), accelerations, 1)


def pinocchio(problem: ChainProblem) -> Contender:
    """Call Featherstone's articulated-body algorithm, in three dimensions and C++, from Python."""
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
    # WORLD is the faster of Pinocchio's two conventions.
    given = (problem.joint_angles, problem.joint_rates, problem.torques, pin.Convention.WORLD)
    times = _times(problem.n, 2_000)

    def work() -> None:
        for _ in range(times):
            aba(model, data, *given)

    return Contender(np.cumsum(aba(model, data, *given)), work, times)


def mujoco(problem: ChainProblem) -> Contender:
    """Repeat MuJoCo's step, which is forward dynamics and explicit Euler, in C.

    The time step is so short that the chain does not move.
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


def casadi(problem: ChainProblem) -> Contender:
    """Call C that CasADi writes for this chain without loops; gcc must be installed.

    The rest of the chain resists its hinge's acceleration a by ``inertia @ a + bias``. Columns of
    matrices are factors of a and of the turn's acceleration, and what depends on neither.
    """
    ca: Any = importlib.import_module("casadi")
    given = [ca.SX.sym(name, problem.n) for name in ("angles", "rates", "forces")]
    inertia, bias, base = ca.SX(2, 2), ca.SX(2, 1), ca.SX(BASE)
    links: list[Any] = []
    chain = [*zip(*problem.bodies, *map(ca.vertsplit, given), strict=True)]
    for mass, own, reach, length, angle, rate, force in reversed(chain):
        across = ca.vertcat(-ca.sin(angle), ca.cos(angle))
        moves = ca.horzcat(across, -(rate**2) * ca.vertcat(across[1], -across[0]))
        centre, tip = (ca.horzcat(ca.SX.eye(2), lever * moves) for lever in (reach, length))
        pushed = inertia @ tip + ca.horzcat(ca.SX(2, 3), bias)
        turned = across.T @ (reach * mass * centre + length * pushed)
        gain = -(turned + ca.horzcat(0, 0, own, -force)) / (turned[2] + own)
        links.append((gain, length * moves))
        total = mass * centre + pushed
        inertia, bias = total[:, :2] + total[:, 2] @ gain[:2], total[:, 3] + total[:, 2] * gain[3]
    found: list[Any] = []
    for gain, moves in reversed(links):
        found.append(gain[:2] @ base + gain[3])
        base += moves @ ca.vertcat(found[-1], 1)
    flags = {"flags": ["-O3", "-march=native"]}
    options = {"jit": True, "compiler": "shell", "jit_options": flags}
    function = ca.Function("chain", given, [ca.cse(ca.vertcat(*found))], options)
    times = _times(problem.n, 20_000)
    values = (problem.angles, problem.rates, problem.forces)
    many, copies = function.map(times), [ca.DM(np.tile(each, (times, 1)).T) for each in values]
    return Contender(np.array(many(*copies))[:, 0], lambda: many(*copies), times)


def missing() -> list[str]:
    """Return the compared libraries that are not installed; the extra ``peers`` contains them."""
    needs = {PINOCCHIO: "pinocchio", MUJOCO: "mujoco", CASADI: "casadi"}
    absent = [name for name, module in needs.items() if find_spec(module) is None]
    return absent if CASADI in absent or which("gcc") else [*absent, CASADI]


BUILDS: dict[str, Build] = {
    SCALAR: scalar,
    LANES: lanes,
    PINOCCHIO: pinocchio,
    MUJOCO: mujoco,
    CASADI: casadi,
    DENSE: dense,
}

# Longer chains would take minutes or gigabytes: these contenders store n² numbers or more, and
# CasADi's code for them takes long to compile.
LONGEST = {PINOCCHIO: 450, MUJOCO: 1000, CASADI: 60, DENSE: 1000}


def measure(quick: bool, progress: Progress) -> list[Row]:
    """Time every contender at every length, or at fewer lengths if ``quick``.

    Return one row per contender and length; libraries not installed have no rows. If
    contenders disagree about the accelerations, an ArithmeticError is raised.
    """
    lengths, rounds = (QUICK_LENGTHS, 5) if quick else (LENGTHS, 15)
    absent = missing()
    rows: list[Row] = []
    for n, tick in tables.each_case(progress, lengths, lambda n: f"n = {n}"):
        rows += _measure(n, rounds, absent, tick)
    return rows


def _measure(n: int, rounds: int, absent: list[str], tick: Tick) -> list[Row]:
    """Return the rows of all contenders that can handle n components."""
    names = [name for name in BUILDS if name not in absent and n <= LONGEST.get(name, n)]
    problem = random_problem(n)
    contenders = {name: BUILDS[name](problem) for name in names}
    apart = _differences(n, contenders)
    timed = dict(contenders)
    if PINOCCHIO in names:
        timed[OVERHEAD] = BUILDS[PINOCCHIO](random_problem(1))
    tasks = {name: timing.unprepared(each.work) for name, each in timed.items()}
    timings = timing.take_turns(tasks, rounds, tick=tick)
    taken = {name: t.samples / timed[name].evaluations for name, t in timings.items()}
    if PINOCCHIO in names and n > 1:
        taken[PINOCCHIO] = taken[PINOCCHIO] - taken[OVERHEAD]
    shown = {PINOCCHIO: OVERHEAD} if n == 1 else {}
    rows: list[Row] = []
    for name in names:
        ratio = timing.spread_of(taken[name] / taken[SCALAR])
        rows.append(
            {
                "contender": shown.get(name, name),
                "n": n,
                **timing.spread_of(1e6 * taken[name]).time_cells("µs"),
                "times one chain's": ratio.median,
                "lower quartile": ratio.low,
                "upper quartile": ratio.high,
                "difference": apart[name],
            }
        )
    return rows


def _differences(n: int, contenders: Mapping[str, Contender]) -> dict[str, float]:
    """Return the largest differences from the scalar kernel, over the largest acceleration."""
    expected = contenders[SCALAR].accelerations
    scale = float(np.abs(expected).max())
    # Mass matrices, which some contenders form, become ill-conditioned as chains grow.
    bound = AGREE * max(1.0, n / LONG) ** 2
    apart: dict[str, float] = {}
    for name, contender in contenders.items():
        apart[name] = float(np.abs(contender.accelerations - expected).max()) / scale
        if not apart[name] <= bound:
            msg = f"n = {n}: {name} and {SCALAR} differ by {apart[name]:.1e}"
            raise ArithmeticError(msg)
    return apart


def run(quick: bool, progress: Progress) -> Measurement:
    """Measure every contender at every length, like `measure`.

    Libraries that are not installed have no rows; a finding states that they are absent.
    """
    rows = measure(quick, progress)
    lines = tables.pivot(rows, "n", "contender", "time [µs]", "")
    found = _findings(rows) + [f"{name} is absent" for name in missing()]
    title = "Accelerations of a pinned chain: µs per evaluation and chain"
    return Measurement(rows, [Table(title, lines)], found)


def _findings(rows: list[Row]) -> list[str]:
    """Return the findings: agreement of the accelerations, and the requirements."""
    found: list[str] = []
    for n, factor in PINOCCHIO_FACTORS.items():
        for row in tables.select(rows, contender=PINOCCHIO, n=n):
            times = timing.Spread(*(float(row[key]) for key in QUARTILES))
            found.append(
                f"n = {n}: {times} times faster than Pinocchio; at least {factor} is required: "
                f"{tables.verdict(times.median >= factor)}"
            )
    for row in tables.select(rows, contender=LANES, n=LANES_AT):
        middle, low, high = (1.0 / float(row[key]) for key in QUARTILES)
        times = timing.Spread(middle, high, low)  # a reciprocal swaps the quartiles
        found.append(
            f"n = {LANES_AT}: in lanes {times} times faster than one chain after another; at "
            f"least {LANES_FACTOR} is required: {tables.verdict(times.median >= LANES_FACTOR)}"
        )
    steps = tables.numbers(tables.select(rows, contender=MUJOCO), "times one chain's")
    if steps.size:
        found.append(f"at least {steps.min():.3g} times faster than a MuJoCo step at all lengths")
    # Many long chains do not fit into the processor's cache, so there is no limit for their slope.
    for name in (SCALAR, LANES):
        slope = tables.growth(tables.select(rows, contender=name), LONG)
        if math.isfinite(slope):
            said = f"{name}: the time grows as n to the power {slope:.3f} from n = {LONG} on"
            if name == SCALAR:
                said += f"; at most {STEEPEST} is allowed: {tables.verdict(slope <= STEEPEST)}"
            found.append(said)
    return found


def draw(rows: list[Row]) -> Any:
    """Draw the time per evaluation against the length, without the row for the cost of a call."""
    title = "Accelerations of a pinned chain"
    shown = [row for row in rows if row["contender"] != OVERHEAD]
    return Lines(title, "n", "time [µs]", "contender").draw(shown)


def _times(n: int, components: int) -> int:
    """Return how many evaluations of n components process about ``components`` components."""
    return max(1, components // n)
