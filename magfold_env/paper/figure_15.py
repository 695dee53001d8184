"""Figure 15: how well integrators keep the energy of a pendulum, against the time step."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np

from magfold_env.laws.smooth_motion import ADAPTIVE, EULER, FIXED
from magfold_env.paper.pendulum import Floats, engine_change, integrator_change
from magfold_env.paper.quoted import COMPUTATIONS, FRAME_RATE, PENDULUM_STEPS
from magfold_env.paper.reproduction import Claim, Measured, Reproduction, select
from magfold_env.reporting.page import Picture
from magfold_env.reporting.plotting import COLOURS, MARKERS, numbers, panels, save_figure
from magfold_env.reporting.tables import Progress, Row, Table

STEPS = (1, 2, 5, 10, 20, 50, 100, 200)
QUICK_STEPS = (1, 5, 20, 100)
TOLERANCE, TIGHT = 1e-4, 1e-10  # [rad]; the first is the engine's default
CHANGE = "change a step [%]"
KEPT = 1e-6
"""Per cent a step; an integrator that changes the energy by less keeps it, as the equations do."""

_ENGINE = f"this project's solver, tolerance {TOLERANCE:g}"
_TIGHT = f"this project's solver, tolerance {TIGHT:g}"


def measure(quick: bool, progress: Progress) -> Measured:
    """Let every integrator take so many steps as the paper's, for each time step."""
    cases: dict[str, Callable[[float], float]] = {}
    for method in FIXED:
        cases[method.name] = lambda step, method=method: integrator_change(method, step, TOLERANCE)
    for method in ADAPTIVE:
        cases[f"{method.name}, tolerance {TOLERANCE:g}"] = lambda step, method=method: (
            integrator_change(method, step, TOLERANCE)
        )
    cases[_ENGINE] = lambda step: engine_change(step, TOLERANCE)
    cases[_TIGHT] = lambda step: engine_change(step, TIGHT)
    counts = QUICK_STEPS if quick else STEPS
    rows: list[Row] = []
    broken: list[Row] = []
    for k, (name, find) in enumerate(cases.items()):
        for j, count in enumerate(counts):
            progress((k + j / len(counts)) / len(cases), name)
            step = 1.0 / (FRAME_RATE * count)
            case: Row = {"integrator": name, "steps a frame": count, "Δt [ms]": 1e3 * step}
            change = find(step)
            if math.isfinite(change):
                rows.append(case | {CHANGE: 100.0 * change})
            else:
                broken.append(case)
    return {"energy": rows, "broke-down": broken}


def tables(measured: Measured) -> list[Table]:
    """Return a row a time step and a column an integrator."""
    rows = measured["energy"]
    shown: list[Row] = []
    for step in dict.fromkeys(float(row["Δt [ms]"]) for row in rows):
        found = {row["integrator"]: row[CHANGE] for row in select(rows, **{"Δt [ms]": step})}
        line: Row = {"Δt [ms]": f"{step:.3g}"}
        line |= {name: found.get(name, "broke down") for name in _integrators(rows)}
        shown.append(line)
    return [Table("Mean change of the energy from one time step to the next [%]", shown)]


def _integrators(rows: list[Row]) -> list[str]:
    return list(dict.fromkeys(str(row["integrator"]) for row in rows))


def claims(measured: Measured) -> list[Claim]:
    """Compare with sections 5.3, 7 and 8."""
    rows = measured["energy"]
    changes = {name: _changes(rows, name) for name in _integrators(rows)}
    euler = changes[EULER.name]
    steps, change = np.array(list(euler)), np.array(list(euler.values()))
    falls = bool((np.diff(change) < 0.0).all())
    chosen = next(
        r for r in select(rows, integrator=EULER.name) if r["steps a frame"] == COMPUTATIONS
    )
    lost = select(measured["broke-down"], integrator=EULER.name)
    best = max(changes[_TIGHT].values())
    better = [
        name
        for name, found in changes.items()
        if name != EULER.name and all(found.get(step, np.inf) < euler[step] for step in euler)
    ]
    return [
        Claim(
            "the error of the energy falls with the time step.",
            f"double Euler's falls {'all along' if falls else 'not everywhere'}, from "
            f"{change[0]:.2g} to {change[-1]:.2g} % a step, like Δt to the "
            f"{_power(steps, change):.1f}; at the paper's {COMPUTATIONS} steps a frame it is "
            f"{float(chosen[CHANGE]):.2g} %."
            + "".join(f" At {float(row['Δt [ms]']):.2g} ms it breaks down." for row in lost),
            falls,
        ),
        Claim(
            "equation 39 keeps the energy; what changes comes from the integration.",
            f"solved to a tolerance of {TIGHT:g} rad, the same equation changes it by "
            f"{best:.1g} % a step at most.",
            best < KEPT,
        ),
        Claim(
            "a better integration than Euler's might lower the error.",
            f"at every time step these change the energy less: {'; '.join(better) or 'none'}.",
            bool(better),
        ),
    ]


def _changes(rows: list[Row], name: str) -> dict[float, float]:
    """Return an integrator's changes [%] by time step [ms]."""
    return {float(r["Δt [ms]"]): float(r[CHANGE]) for r in select(rows, integrator=name)}


def _power(steps: Floats, change: Floats) -> float:
    return float(np.polyfit(np.log(steps), np.log(change), 1)[0])


def draw(measured: Measured, folder: Path) -> list[Picture]:
    """Draw the change against the time step, a line an integrator."""
    rows = measured["energy"]
    figure, axes = panels(1, "Pendulum of 3: change of energy a time step", width=9.5, height=5.4)
    axis = axes[0]
    for k, name in enumerate(_integrators(rows)):
        mine = select(rows, integrator=name)
        ours = name in (_ENGINE, _TIGHT)
        axis.loglog(
            numbers(mine, "Δt [ms]"),
            np.maximum(numbers(mine, CHANGE), 1e-16),
            color=COLOURS[3] if ours else COLOURS[(0, 1, 2, 4, 5, 6)[k % 6]],
            marker=MARKERS[k % len(MARKERS)],
            markersize=5,
            linewidth=2.2 if ours or name == EULER.name else 1.3,
            linestyle="--" if name == _TIGHT else "-",
            label=name,
        )
    axis.set_xlabel("time step Δt [ms]")
    axis.set_ylabel("mean change of the energy a time step\n[% of what it swings with]")
    figure.legend(loc="outside right center", fontsize=9, frameon=False)
    path = folder / "figure-15.png"
    save_figure(figure, path)
    return [
        Picture(
            path,
            f"Mean over {PENDULUM_STEPS} time steps. Methods with a tolerance take as many steps "
            "of their own within a time step as they need, at least one; this project's solver "
            "takes its steps over the whole run, and is looked at every time step.",
        )
    ]


REPRODUCTION = Reproduction(
    "figure-15",
    "Figure 15: energy of a pendulum against the time step",
    shows="The percentage by which kinetic plus potential energy of a pendulum of three components "
    f"changes between two time steps, averaged over {PENDULUM_STEPS} of them, against the time "
    "step; no numbers in the text.",
    computed="The same pendulum, from a horizontal line, with the paper's double Euler, two other "
    "methods of equal steps, three adaptive ones, and this project's solver. Per cent are of the "
    "energy between the start and hanging straight down: the total alone has no natural zero.",
    missing="The paper's masses, sizes and start are not in its text; the components are those of "
    "the magnetic chain.",
    measure=measure,
    tables=tables,
    claims=claims,
    draw=draw,
)
