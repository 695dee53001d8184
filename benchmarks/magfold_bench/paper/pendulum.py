"""Figures 15 and 16: how integrators change a pendulum's energy, and how long they take."""

import math
from collections.abc import Callable
from functools import partial

import numpy as np

from magfold_bench import bare_pendulum, scaling, tables
from magfold_bench.laws import integrators, mechanics
from magfold_bench.paper import quoted
from magfold_bench.paper.reproduction import Claim, Measured, Plot, Reproduction
from magfold_bench.presentation import Lines
from magfold_bench.tables import Progress, Row, Table, pivot, select
from magfold_env.engine.workspace import new_work
from magfold_env.scene import Scene, load_scene
from magfold_env.shapes import FloatArray
from magfold_env.simulation.pack import pack
from magfold_env.simulation.simulate import simulate

COMPONENTS = 3
MARGIN = 0.5  # time steps after the last frame, so that rounding does not omit this frame
STEPS = (1, 2, 5, 10, 20, 50, 100, 200)
QUICK_STEPS = (1, 5, 20, 100)
TOLERANCE, TIGHT = 1e-4, 1e-10  # [rad]; the first is the engine's default
STEP, CHANGE = "Δt [ms]", "change per step [%]"
KEPT = 1e-6
"""Change of the energy per step [%] below which an integrator counts as conserving energy, as
the exact equations do."""

_PAIR = f"DP5(4), tolerance {TOLERANCE:g}"
_ENGINE = f"this project's solver, tolerance {TOLERANCE:g}"
_TIGHT = f"this project's solver, tolerance {TIGHT:g}"


# --- Figure 15: the energy of a pendulum of three --------------------------------------------


def problem() -> Scene:
    """Return the paper's pendulum, which swings down from a horizontal start."""
    return load_scene("pendulum-3").replace(start_angles=(0.0,) * (COMPONENTS - 1))


def depth(scene: Scene) -> float:
    """Return the energy [J] that is released between the start and hanging straight down."""
    hanging, level = np.full(scene.n, -np.pi / 2), np.zeros(scene.n)
    base = np.zeros(2)
    return float(
        mechanics.weight_energy(scene, level, base) - mechanics.weight_energy(scene, hanging, base)
    )


def change(scene: Scene, angles: FloatArray, rates: FloatArray) -> float:
    """Return the mean change of the energy between frames, as a share of `depth`.

    The change is infinite if any number is not finite.
    """
    if not (np.isfinite(angles).all() and np.isfinite(rates).all()):
        return math.inf
    still = np.zeros((*angles.shape[:-1], 2))
    energy = mechanics.kinetic_energy(scene, angles, rates, still) + mechanics.weight_energy(
        scene, angles, np.zeros(2)
    )
    return float(np.abs(np.diff(energy)).mean()) / depth(scene)


def integrator_change(name: str, step: float) -> float:
    """Return the energy's mean change per time step [s] with an integrator of equal steps."""
    scene = problem()
    model, n = pack(scene), scene.n
    work, y = new_work(model), np.zeros(2 * (n + 2))  # at rest on a horizontal line
    frames = np.zeros((quoted.PENDULUM_STEPS + 1, y.size))
    for k in range(quoted.PENDULUM_STEPS):
        integrators.FIXED[name](model, work, y, step, 1)
        frames[k + 1] = y
    rates = y.size // 2  # where they begin
    return change(scene, frames[:, :n], frames[:, rates : rates + n])


def pair_change(step: float) -> float:
    """Return the energy's mean change with an adaptive pair that restarts at each time step [s]."""
    scene = problem().replace(solver={"tolerance": TOLERANCE})
    swinging = bare_pendulum.pendulum(scene)
    frames = np.zeros((quoted.PENDULUM_STEPS + 1, 2, scene.n))  # begins like `swinging`
    for k in range(quoted.PENDULUM_STEPS):
        bare_pendulum.swing(swinging, step)
        frames[k + 1] = swinging.q, swinging.v
    return change(scene, frames[:, 0], frames[:, 1])


def engine_change(step: float, tolerance: float) -> float:
    """Return the energy's mean change in the engine between frames one time step [s] apart."""
    scene = problem().replace(
        duration=(quoted.PENDULUM_STEPS + MARGIN) * step, solver={"tolerance": tolerance}
    )
    fold = simulate(scene, frame_rate=1.0 / step)
    assert fold.trajectory is not None
    evenly = slice(quoted.PENDULUM_STEPS + 1)  # without the final state
    return change(scene, fold.trajectory.angles[evenly], fold.trajectory.rates[evenly])


def drift(quick: bool, progress: Progress) -> Measured:
    """Let every integrator take as many time steps as the paper's solver, for each step length."""
    cases: dict[str, Callable[[float], float]] = {
        name: partial(integrator_change, name) for name in integrators.FIXED
    }
    cases[_PAIR] = pair_change
    cases[_ENGINE] = partial(engine_change, tolerance=TOLERANCE)
    cases[_TIGHT] = partial(engine_change, tolerance=TIGHT)
    counts = QUICK_STEPS if quick else STEPS
    rows: list[Row] = []
    broken: list[Row] = []
    for name, tick in tables.each_case(progress, list(cases)):
        for j, count in enumerate(counts):
            tick(j / len(counts))
            step = 1.0 / (quoted.FRAME_RATE * count)
            case: Row = {"integrator": name, "steps per frame": count, STEP: 1e3 * step}
            found = cases[name](step)
            if math.isfinite(found):
                rows.append(case | {CHANGE: 100.0 * found})
            else:
                broken.append(case)
    return {"energy": rows, "broke-down": broken}


def drift_tables(measured: Measured) -> list[Table]:
    """Return one row per time step and one column per integrator."""
    shown = pivot(measured["energy"], STEP, "integrator", CHANGE, "broke down")
    return [Table("Mean change of the energy from one time step to the next [%]", shown)]


def drift_claims(measured: Measured) -> list[Claim]:
    """Compare the changes with the statements in sections 5.3, 7 and 8."""
    rows = measured["energy"]
    changes = {
        name: {float(r[STEP]): float(r[CHANGE]) for r in select(rows, integrator=name)}
        for name in tables.distinct(rows, "integrator")
    }
    euler = changes[integrators.EULER]
    steps, change = list(euler), list(euler.values())
    falls, slope = bool((np.diff(change) < 0.0).all()), tables.power(steps, change)
    mine = select(rows, integrator=integrators.EULER)
    chosen = next(row for row in mine if row["steps per frame"] == quoted.COMPUTATIONS)
    lost = select(measured["broke-down"], integrator=integrators.EULER)
    best = max(changes[_TIGHT].values())
    better = [
        name
        for name, found in changes.items()
        if name != integrators.EULER
        and all(found.get(step, np.inf) < euler[step] for step in euler)
    ]
    return [
        Claim(
            "the error in the energy falls with the time step.",
            f"double Euler's error falls {'everywhere' if falls else 'not everywhere'}, from "
            f"{change[0]:.2g} to {change[-1]:.2g} % per step, as Δt to the power "
            f"{slope:.1f}; at the paper's {quoted.COMPUTATIONS} steps per frame it is "
            f"{float(chosen[CHANGE]):.2g} %."
            + "".join(f" At {float(row[STEP]):.2g} ms it breaks down." for row in lost),
            falls,
        ),
        Claim(
            "equation 39 conserves energy; changes come from the integration.",
            f"solved to a tolerance of {TIGHT:g} rad, the same equation changes it by "
            f"{best:.1g} % per step at most.",
            best < KEPT,
        ),
        Claim(
            "a better integration than Euler's might lower the error.",
            f"at every time step these change the energy less: {'; '.join(better) or 'none'}.",
            bool(better),
        ),
    ]


def drift_plots(measured: Measured) -> list[Plot]:
    """Draw the change against the time step, one line per integrator."""
    title = "Pendulum of 3: mean change of the energy per time step"
    figure = Lines(title, STEP, CHANGE, "integrator").draw(measured["energy"])
    caption = (
        f"Mean over {quoted.PENDULUM_STEPS} time steps. Methods with a tolerance take as many "
        "internal steps within a time step as they need, at least one; this project's solver "
        "takes its steps over the whole run and is sampled at every time step."
    )
    return [Plot.of("figure-15", figure, caption)]


FIGURE_15 = Reproduction(
    "figure-15",
    "Figure 15: energy of a pendulum against the time step",
    "The solver",
    shows="The percentage by which a three-component pendulum's kinetic plus potential energy "
    f"changes per time step, averaged over {quoted.PENDULUM_STEPS} time steps, against the "
    "time step; the text gives no numbers.",
    computed="The same pendulum, from a horizontal line, with the paper's double Euler, two other "
    "methods with equal steps, an adaptive one, and this project's solver. Percentages are of the "
    "energy between the start and hanging straight down: the total has no natural zero.",
    missing="The paper's text does not give masses, sizes and start; the components are those in "
    "the magnetic chain.",
    measure=drift,
    tables=drift_tables,
    claims=drift_claims,
    plots=drift_plots,
    inputs="assumed masses, sizes and start; no magnets, friction or sequence.",
)


# --- Figure 16: computing time against the number of components -------------------------------

NEAR = 0.25
"""Difference below which two exponents of n count as equal."""
SHORTEST = 6
"""Length from which growth is judged: in shorter chains, a call costs more than its work."""
TIME = "time [µs]"


def times(quick: bool, progress: Progress) -> Measured:
    """Time the accelerations of a pinned chain, like `magfold bench dynamics --only scaling`."""
    rows = scaling.measure(quick, progress)
    return {"times": rows, "absent": [{"peer": name} for name in scaling.missing()]}


def times_tables(measured: Measured) -> list[Table]:
    """Return one row per length and one column per contender."""
    title = "Accelerations of one chain [µs], or 1000 time steps [ms]"
    return [Table(title, pivot(measured["times"], "n", "contender", TIME, ""))]


def times_claims(measured: Measured) -> list[Claim]:
    """Compare the growth of the times with the paper's, and the dense method with the recursion."""
    rows = measured["times"]
    up_to, beyond = (quoted.NEAR_LINEAR_UP_TO, quoted.LONGEST)
    dense = select(rows, contender=scaling.DENSE)
    recursion = select(rows, contender=scaling.SCALAR)
    short, long = tables.growth(dense, SHORTEST, up_to), tables.growth(dense, up_to, beyond)
    whole, ours = tables.growth(dense, SHORTEST, beyond), tables.growth(recursion, up_to, beyond)
    times = {
        n: float(row["times one chain's"])
        for n in (SHORTEST, up_to, beyond)
        for row in select(dense, n=n)
    }
    listed = ", ".join(f"{ratio:.0f} times at n = {n}" for n, ratio in times.items())
    return [
        Claim(
            f"up to about {up_to} components the time grows nearly linearly.",
            f"the same method's time grows as n to the {short:.2f} from {SHORTEST} to {up_to}.",
            abs(short - quoted.NEAR_LINEAR) < NEAR,
            "Operations on so few numbers take less time than the calls that start them.",
        ),
        Claim(
            f"up to {beyond} components it grows about as n to the power {quoted.LONG_POWER:g}.",
            f"fitted to all lengths from {SHORTEST} to {beyond}, it grows as n to the power "
            f"{whole:.2f}; fitted from {up_to} on, as n to the power {long:.2f}.",
            abs(whole - quoted.LONG_POWER) < NEAR,
            "Filling a dense matrix takes n² operations and solving with it n³, so the power "
            "grows with the length, and a fit depends on where it begins; the paper does not say "
            "where.",
        ),
        Claim(
            "the vectorised equation speeds up the computation; recursion, component by "
            "component, is known as the efficient way.",
            f"the compiled recursion's time grows as n to the power {ours:.2f} from {up_to} to "
            f"{beyond}, and the dense equation in NumPy takes {listed} as long.",
            None,
            "The paper gives no times for other methods.",
        ),
    ]


def times_plots(measured: Measured) -> list[Plot]:
    """Draw the times as the benchmark does."""
    absent = ", ".join(str(row["peer"]) for row in measured["absent"])
    caption = (
        "Time of one chain's accelerations; 1 µs means 1 ms for the 1000 time steps that the "
        "paper times." + (f" Not installed, so not measured: {absent}." if absent else "")
    )
    return [Plot.of("figure-16", scaling.draw(measured["times"]), caption)]


FIGURE_16 = Reproduction(
    "figure-16",
    "Figure 16: computing time against the number of components",
    "The solver",
    shows="The time of 1000 time steps of a pendulum of n components, by equation 39 in NumPy, up "
    f"to {quoted.NEAR_LINEAR_UP_TO} and up to {quoted.LONGEST} components, on a processor with "
    f"twelve cores. Stated: nearly linear, then about n to the power {quoted.LONG_POWER:g}.",
    computed="The accelerations of one pinned chain, which is what a time step consists of: "
    "equation 39 as a dense system in NumPy, this project's recursion for one chain and for many, "
    "and two other engines (Pinocchio, MuJoCo) if they are installed. All must agree before "
    "they are timed, and they take turns.",
    missing="The paper's own code and processor: only the growth of times is compared, not times "
    "themselves.",
    measure=times,
    tables=times_tables,
    claims=times_claims,
    plots=times_plots,
    inputs="processor and libraries; no magnets, friction or sequence.",
)
