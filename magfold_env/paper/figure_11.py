"""Figure 11: the error of the paper's solver against its time step."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from magfold_env.paper import motions
from magfold_env.paper.quoted import ANGLE, COMPUTATIONS, FRAME_RATE
from magfold_env.paper.reproduction import Claim, Measured, Reproduction, select
from magfold_env.reporting.page import Picture
from magfold_env.reporting.plotting import COLOURS, MARKERS, numbers, panels, save_figure
from magfold_env.reporting.tables import Progress, Row, Table

STEPS, FINEST = (1, 2, 5, 10, 20, 50, 100), 1000
QUICK_STEPS, QUICK_FINEST = (1, 2, 5, 10, 20), 200
SMALL = 0.1
"""An error below this share of the paper's own distance from its film is small."""

LEAST = 1e-5  # [rad²] that is drawn

ERROR, OWN, SMOOTH = "error [rad²]", "from its limit [rad²]", "without friction [rad²]"
EARLY = "before the first snap: "
LABELS = {
    EARLY + ERROR: "this project's solver",
    EARLY + SMOOTH: "the same, without friction",
    EARLY + OWN: "the scheme's own limit",
}


def measure(quick: bool, progress: Progress) -> Measured:
    """Follow the fold with ever smaller steps of the paper's solver."""
    steps, finest = (QUICK_STEPS, QUICK_FINEST) if quick else (STEPS, FINEST)
    over_time: list[Row] = []
    means: list[Row] = []
    charges = motions.charges()
    for k, (name, charge) in enumerate(charges.items()):
        scene = motions.literal(charge)
        smooth = scene.replace(friction=0.0)
        ours, ours_smooth = (motions.follow(motions.exact(each)) for each in (scene, smooth))
        limit = motions.follow(motions.stepped(scene, finest))
        early = motions.before_snap(ours, limit)
        for j, count in enumerate(steps):
            progress((k + j / len(steps)) / len(charges), f"{name}, {count} steps a frame")
            found, free = (motions.follow(motions.stepped(each, count)) for each in (scene, smooth))
            error = motions.squared_error(found, ours)
            case: Row = {"charge": name, "steps a frame": count}
            over_time += [
                {**case, "time [s]": t, ERROR: e}
                for t, e in zip(found.time.tolist(), error.tolist(), strict=True)
            ]
            early_free = motions.before_snap(free, ours_smooth)
            means.append(
                {
                    **case,
                    "Δt [ms]": 1e3 / (FRAME_RATE * count),
                    ERROR: float(error.mean()),
                    EARLY + ERROR: _mean(found, ours, early),
                    EARLY + OWN: _mean(found, limit, early),
                    EARLY + SMOOTH: _mean(free, ours_smooth, early_free),
                    "word": found.word,
                    "ended": found.ended,
                    "reference": ours.word,
                    "reference ended": ours.ended,
                }
            )
    return {"over-time": over_time, "means": means}


def _mean(one: motions.Motion, other: motions.Motion, frames: npt.NDArray[np.bool_]) -> float:
    return float(motions.squared_error(one, other)[frames].mean())


def tables(measured: Measured) -> list[Table]:
    """Return errors and ends, a row a time step."""
    found: list[Table] = []
    for name in motions.charges():
        rows = [
            {key: cell for key, cell in row.items() if key not in ("charge", "Δt [ms]")}
            for row in select(measured["means"], charge=name)
        ]
        found.append(
            Table(f"{name.capitalize()}: mean squared errors, and how the fold ends", rows)
        )
    return found


def claims(measured: Measured) -> list[Claim]:
    """Judge the chosen step, until joints snap and on the whole."""
    means = measured["means"]
    return [
        claim for name in motions.charges() for claim in _claims(name, select(means, charge=name))
    ]


def _claims(name: str, rows: list[Row]) -> list[Claim]:
    (chosen,) = select(rows, **{"steps a frame": COMPUTATIONS})
    stated = f"{COMPUTATIONS} time steps a frame of the film are fine enough to go on with."
    own, ours, smooth = (math.sqrt(float(chosen[EARLY + key])) for key in (OWN, ERROR, SMOOTH))
    finest = math.sqrt(float(rows[-1][EARLY + SMOOTH]))
    before = Claim(
        f"{stated[:-1]} ({name}, until the first joint snaps).",
        f"with them the angles are {own:.2g} rad from where the scheme itself ends up with ever "
        f"smaller steps (root mean square); its squared error falls like Δt to the "
        f"{power(rows, EARLY + OWN):.1f}, as a scheme of first order does.",
        own < SMALL * ANGLE,
        f"From this project's solver they are {ours:.2g} rad; without friction {smooth:.2g} rad, "
        f"and {finest:.2g} rad with the smallest steps"
        + (": both solve the same equation" if finest < SMALL * ANGLE else "")
        + ". Equation 41 gives friction neither a torque nor a static part.",
    )
    finer = [row for row in rows if int(row["steps a frame"]) >= COMPUTATIONS]
    words = list(dict.fromkeys(str(row["word"]) for row in finer))
    whole = Claim(
        f"{stated[:-1]} ({name}, the whole fold).",
        f"from there on, smaller steps end in {', '.join(words)}; this project's solver in "
        f"{rows[0]['reference']} ({rows[0]['reference ended']}).",
        len(words) == 1,
        ""
        if len(words) == 1
        else "A snap moves a joint by up to 9° at once and averages two rates, and nothing keeps "
        "components apart that are not neighbours: point charges of either sign come as near to "
        "each other as the step lets them. What follows the first snaps depends on the step.",
    )
    return [before, whole]


def power(rows: list[Row], column: str) -> float:
    """Return with which power of the time step a column grows, by least squares."""
    step, error = (np.log([float(row[key]) for row in rows]) for key in ("Δt [ms]", column))
    return float(np.polyfit(step, error, 1)[0])


def draw(measured: Measured, folder: Path) -> list[Picture]:
    """Draw the error over time for each step, and its mean before the first snap over the step."""
    figure, axes = panels(3, "The paper's solver: squared error of the angles", 4.7, shared=False)
    for axis, name in zip(axes, motions.charges(), strict=False):
        _draw_over_time(axis, name, select(measured["over-time"], charge=name))
    for k, name in enumerate(motions.charges()):
        rows = select(measured["means"], charge=name)
        for j, (column, label) in enumerate(LABELS.items()):
            axes[2].loglog(
                numbers(rows, "Δt [ms]"),
                numbers(rows, column),
                color=COLOURS[j + 1],
                marker=MARKERS[j],
                markersize=4,
                linestyle=("-", "--")[k],
                label=label if k == 0 else None,
            )
    axes[2].plot([], [], color=COLOURS[0], linestyle="--", label="dashed: whole charge")
    axes[2].set_title("before the first snap, by what it is measured from", fontsize=10)
    axes[2].set_xlabel("time step Δt [ms]")
    steps = dict.fromkeys(float(row["Δt [ms]"]) for row in measured["means"])
    axes[2].set_xticks(list(steps), [f"{step:.2g}" for step in steps])
    axes[2].minorticks_off()
    axes[2].legend(fontsize=8, frameon=False)
    axes[0].set_ylabel("mean squared error of the relative angles [rad²]")
    path = folder / "figure-11.png"
    save_figure(figure, path)
    return [
        Picture(
            path,
            "Left, middle: squared error over time against this project's solver with the same "
            "point charges, by the number of time steps a frame (1/240 s). Right: its mean until "
            "the first joint snaps.",
        )
    ]


def _draw_over_time(axis: Any, name: str, rows: list[Row]) -> None:
    counts = list(dict.fromkeys(int(row["steps a frame"]) for row in rows))
    for k, count in enumerate(counts):
        mine = select(rows, **{"steps a frame": count})
        error = np.maximum(numbers(mine, ERROR), LEAST)
        chosen = count == COMPUTATIONS
        axis.semilogy(
            numbers(mine, "time [s]"),
            error,
            color=COLOURS[k],
            linewidth=2.2 if chosen else 1.1,
            label=f"{count}, the paper's choice" if chosen else f"{count}",
        )
    axis.set_title(f"{name} on a pole face", fontsize=10)
    axis.set_xlabel("time [s]")
    axis.set_ylim(LEAST, 30.0)
    axis.legend(fontsize=8, frameon=False, title="steps a frame", title_fontsize=8)


REPRODUCTION = Reproduction(
    "figure-11",
    "Figure 11: error against the time step",
    shows="The mean squared error of the angles over time between the simulation of sequence 3, "
    "its first component held, and a film of it, for several time steps, with three charges a pole "
    "face. The text gives no numbers; it goes on with 5 steps a frame of 1/240 s.",
    computed="The paper's solver (double Euler, neighbours snapping at 81°, equation 41's "
    "friction) with the same time steps, from a straight chain; the reference is this project's "
    "solver on the same point charges, with hard contact and Coulomb friction that sticks, at a "
    f"tolerance of {motions.EXACT:g} rad. Twice: with the charges that equation 7 prints (half "
    "charge), and with those a magnet of 0.6 T has (whole charge).",
    missing="The film: the error against it is not known here, only that against a better solution "
    "of the same model. Mass and sizes are assumed.",
    measure=measure,
    tables=tables,
    claims=claims,
    draw=draw,
)
