"""Figure 12: the error against the number of charges on a pole face."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from magfold_env.laws.exact_magnets import CHARGES as COUNTS
from magfold_env.laws.exact_magnets import force_rows, rows_at
from magfold_env.paper import motions
from magfold_env.paper.quoted import ANGLE, CHARGES, MANY_CHARGES
from magfold_env.paper.reproduction import Claim, Measured, Reproduction, select
from magfold_env.reporting.page import Picture
from magfold_env.reporting.plotting import COLOURS, MARKERS, numbers, panels, save_figure
from magfold_env.reporting.tables import Progress, Row, Table

SMALL = 0.1
"""A difference below this share of the paper's own distance from its film is minimal."""
NEAR_FORCE = 0.1
"""Within this share of the exact force points count as right."""
GAP = 0.001  # [m] between two faces that touch, each magnet being 0.5 mm inside its casing

LEAST = 1e-5  # [rad²] that is drawn

ERROR, MANY = "error [rad²]", "from 30 charges [rad²]"
EARLY = "before the first snap: "


def measure(quick: bool, progress: Progress) -> Measured:
    """Follow the fold with ever more charges on a face; the reference has rectangles."""
    over_time: list[Row] = []
    means: list[Row] = []
    charges = motions.charges()
    for k, (name, charge) in enumerate(charges.items()):
        scene = motions.default_steps(charge)
        reference = motions.follow(motions.rectangles(motions.exact(scene)))
        found: dict[int, motions.Motion] = {}
        for j, count in enumerate(COUNTS):
            progress((k + j / len(COUNTS)) / len(charges), f"{name}, h = {count}")
            found[count] = motions.follow(scene.replace(magnets={"nodes": count}))
        many = found[MANY_CHARGES]
        for count, motion in found.items():
            error = motions.squared_error(motion, reference)
            case: Row = {"charge": name, "h": count}
            over_time += [
                {**case, "time [s]": t, ERROR: e}
                for t, e in zip(motion.time.tolist(), error.tolist(), strict=True)
            ]
            early = motions.before_snap(motion, many)
            means.append(
                {
                    **case,
                    ERROR: float(error.mean()),
                    EARLY + ERROR: _mean(error, motions.before_snap(motion, reference)),
                    EARLY + MANY: _mean(motions.squared_error(motion, many), early),
                    "whole fold, " + MANY: float(motions.squared_error(motion, many).mean()),
                    "word": motion.word,
                    "ended": motion.ended,
                    "reference": reference.word,
                    "reference ended": reference.ended,
                }
            )
    return {"over-time": over_time, "means": means, "forces": force_rows()}


def _mean(error: motions.Floats, frames: npt.NDArray[np.bool_]) -> float:
    return float(error[frames].mean())


def tables(measured: Measured) -> list[Table]:
    """Return errors and ends, a row a number of charges, and the forces at contact."""
    found: list[Table] = []
    for name in motions.charges():
        rows = [
            {key: cell for key, cell in row.items() if key != "charge"}
            for row in select(measured["means"], charge=name)
        ]
        found.append(
            Table(f"{name.capitalize()}: mean squared errors, and how the fold ends", rows)
        )
    near: list[Row] = [
        {"h": row["h"], "force / exact": row["magnets / exact"]}
        for row in rows_at(measured["forces"], GAP)
    ]
    found.append(Table(f"Two magnets, {1e3 * GAP:.0f} mm apart as where casings touch", near))
    return found


def claims(measured: Measured) -> list[Claim]:
    """Judge whether three charges do as well as thirty, and whether either is right."""
    judged: list[Claim] = []
    for name in motions.charges():
        judged += _claims(name, select(measured["means"], charge=name))
    return [*judged, _force_claim(measured["forces"])]


def _claims(name: str, rows: list[Row]) -> list[Claim]:
    (few,), (many,) = select(rows, h=CHARGES), select(rows, h=MANY_CHARGES)
    stated = f"the difference between h = {CHARGES} and h = {MANY_CHARGES} is minimal"
    early, whole = (math.sqrt(float(few[key + MANY])) for key in (EARLY, "whole fold, "))
    same = few["word"] == many["word"]
    return [
        Claim(
            f"{stated} ({name}, until the first joint snaps).",
            f"they differ by {early:.2g} rad (root mean square).",
            early < SMALL * ANGLE,
        ),
        Claim(
            f"{stated} ({name}, the whole fold).",
            f"they differ by {whole:.2g} rad and end in {few['word']} and {many['word']}; "
            f"rectangles of the same charge, in this project's solver, in "
            f"{few['reference']} ({few['reference ended']}).",
            same and whole < SMALL * ANGLE,
            ""
            if same and whole < SMALL * ANGLE
            else "After the first snaps the paper's solver amplifies any difference, see Figure "
            "11: how a fold goes on says little about the number of charges.",
        ),
    ]


def _force_claim(forces: list[Row]) -> Claim:
    at = {int(row["h"]): float(row["magnets / exact"]) for row in rows_at(forces, GAP)}
    return Claim(
        f"h = {CHARGES} stands for the magnets well enough to go on with.",
        f"where casings touch, {CHARGES} charges a face pull {at[CHARGES]:.1f} times as hard as "
        f"magnets of the same charge do, {MANY_CHARGES} charges {at[MANY_CHARGES]:.1f} times.",
        abs(at[CHARGES] - 1.0) < NEAR_FORCE,
        "More charges on a line converge, but not to the force of a magnet, which is as high as it "
        "is wide: a line's field is stronger near it.",
    )


def draw(measured: Measured, folder: Path) -> list[Picture]:
    """Draw the error over time for each number of charges, and the force over the gap."""
    figure, axes = panels(3, "The paper's point charges, h on a pole face", 4.7, shared=False)
    for axis, name in zip(axes, motions.charges(), strict=False):
        _draw_over_time(axis, name, select(measured["over-time"], charge=name))
    axes[0].set_ylabel("mean squared error of the relative angles [rad²]")
    for k, count in enumerate(COUNTS):
        rows = select(measured["forces"], h=count)
        gap, force = numbers(rows, "gap [mm]"), numbers(rows, "magnets / exact")
        axes[2].loglog(gap, force, color=COLOURS[k], label=f"h = {count}")
    axes[2].axhline(1.0, color="#808080", linewidth=0.8)
    axes[2].axvline(1e3 * GAP, color="#808080", linewidth=0.8, linestyle=":")
    axes[2].set_title("force between two magnets; dotted: touching casings", fontsize=10)
    axes[2].set_xlabel("gap [mm]")
    axes[2].set_ylabel("points / charged rectangles")
    axes[2].legend(fontsize=8, frameon=False)
    path = folder / "figure-12.png"
    save_figure(figure, path)
    return [
        Picture(
            path,
            "Left, middle: squared error over time of the paper's solver with h charges a pole "
            "face, against this project's solver with rectangles of the same charge. Right: what "
            "the points get wrong, without any dynamics.",
        )
    ]


def _draw_over_time(axis: Any, name: str, rows: list[Row]) -> None:
    for k, count in enumerate(COUNTS):
        mine = select(rows, h=count)
        time = numbers(mine, "time [s]")
        error = np.maximum(numbers(mine, ERROR), LEAST)
        axis.semilogy(
            time,
            error,
            color=COLOURS[k],
            marker=MARKERS[k],
            markersize=3.5,
            markevery=(k, 12),
            linewidth=2.2 if count == CHARGES else 1.1,
            label=f"{count}, the paper's choice" if count == CHARGES else f"{count}",
        )
    axis.set_title(f"{name} on a pole face", fontsize=10)
    axis.set_xlabel("time [s]")
    axis.set_ylim(LEAST, 30.0)
    axis.legend(fontsize=8, frameon=False, title="charges h", title_fontsize=8)


REPRODUCTION = Reproduction(
    "figure-12",
    "Figure 12: error against the number of charges",
    shows="The mean squared error of the angles over time against the film, for several numbers h "
    "of point charges on a pole face; no numbers in the text.",
    computed="The paper's solver at its own time step with h charges; the reference is this "
    "project's solver with charged rectangles, 6 mm by 6 mm, of the same charge. Beside it the "
    "force between two magnets over the exact one.",
    missing="The film, as in Figure 11; the sizes of magnets and casing are assumed.",
    measure=measure,
    tables=tables,
    claims=claims,
    draw=draw,
)
