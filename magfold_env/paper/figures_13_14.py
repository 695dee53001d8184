"""Figures 13 and 14: the paper's solver over time, beside a better solution of the same fold."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from magfold_env.paper import motions
from magfold_env.paper.both_solvers import DEVICE, OURS, PAIRS, PAPER, measure
from magfold_env.paper.quoted import ANGLE, DISPLACEMENT, SNAP
from magfold_env.paper.reproduction import Claim, Measured, Reproduction, select
from magfold_env.paper.states import word_of
from magfold_env.reporting.page import Picture, cell_text
from magfold_env.reporting.plotting import (
    COLOURS,
    GRID,
    INK,
    figure_class,
    numbers,
    panels,
    save_figure,
)
from magfold_env.reporting.tables import Row, Table

LIKE = 2.0
"""Distances within this factor of the paper's count as like it."""
WINS = 1e-3
"""Energy [mJ] that is none: of the order of what a solver's tolerance lets through."""


def tables(measured: Measured) -> list[Table]:
    """Return how each fold ends, and how far apart they are on average."""
    return [
        Table("How the fold ends", measured["folds"]),
        Table(
            f"Mean differences over {motions.UNTIL:g} s and all components, by what differs",
            measured["differences"],
        ),
    ]


def claims(measured: Measured) -> list[Claim]:
    """Compare with what section 5.3 says of the two figures."""
    by_charge = {
        name: {str(row["made by"]): row for row in select(measured["folds"], charge=name)}
        for name in motions.charges()
    }
    shapes = [_shape(name, folds) for name, folds in by_charge.items()]
    # With half of the charge hardly anything folds: what is left is said of the whole charge.
    folds = by_charge[motions.WHOLE]
    (apart,) = select(measured["differences"], charge=motions.WHOLE, different="both")
    passive = [_passive(name, folds) for name, folds in by_charge.items()]
    return [*shapes, *passive, *_distances(folds, apart), _order(folds), _jumps(apart)]


def _shape(name: str, folds: dict[str, Row]) -> Claim:
    wanted = word_of("S3A")
    paper, ours, device = (folds[made_by] for made_by in (PAPER, OURS, DEVICE))
    holds = paper["word"] == wanted
    return Claim(
        f"the simulation ends in the right shape, S3A = {wanted} ({name}).",
        f"the paper's solver ends in {_end(paper)}, this project's in {_end(ours)} with the same "
        f"points and in {_end(device)} with rectangles.",
        holds,
        ""
        if holds
        else "Sequence and mass are not the paper's but reconstructed and assumed, and every "
        "magnet counts: the point charges pull several times too hard where casings touch (Figure "
        "12), and what the paper's solver ends in depends on its time step (Figure 11).",
    )


def _passive(name: str, folds: dict[str, Row]) -> Claim:
    """Judge whether the collision handling takes energy away, as what it stands for does."""
    won = {made_by: float(row["energy won [mJ]"]) for made_by, row in folds.items()}
    return Claim(
        f"components snap together without bouncing, and the collision handling approximates the "
        f"transfer of impulse ({name}).",
        "kinetic and magnetic energy, which friction and impacts can only lessen, rise above those "
        f"at the start by {cell_text(won[PAPER])} mJ with the paper's solver, by "
        f"{cell_text(max(won[OURS], won[DEVICE]))} mJ at most with this project's, whose fold with "
        f"the same points sets {cell_text(folds[OURS]['magnets set free [mJ]'])} mJ free.",
        won[PAPER] <= WINS,
        ""
        if won[PAPER] <= WINS
        else "To set an angle and to average two rates keeps neither momentum nor energy, and "
        "point charges that pass close by each other in one step may win any amount: the chain is "
        "thrown about.",
    )


def _end(row: Row) -> str:
    return f"{row['word']} ({row['ended']})"


def _distances(folds: dict[str, Row], row: Row) -> list[Claim]:
    """Compare the mean distances with those of simulation and film, if the shapes are the same."""
    same = folds[PAPER]["word"] == folds[DEVICE]["word"]
    why = (
        "The paper's is a distance between a simulation and a film, this one between two "
        "simulations: not the same thing, but a like thing."
        if same
        else "The two end in different shapes, so a mean over the whole time says just that."
    )
    cases = (
        ("displacement", "mm", 1e3 * DISPLACEMENT),
        ("difference of the relative angles", "rad", ANGLE),
    )
    judged: list[Claim] = []
    for what, unit, stated in cases:
        value = float(row[f"{'displacement' if unit == 'mm' else 'angle'} [{unit}]"])
        early = float(row[f"before the first snap [{unit}]"])
        judged.append(
            Claim(
                f"the mean {what} from the film is {stated:g} {unit}.",
                f"the mean {what} of the paper's solver from this project's with rectangles is "
                f"{value:.3g} {unit} ({motions.WHOLE}); until the first joint snaps, {early:.2g} "
                f"{unit}.",
                stated / LIKE < value < stated * LIKE if same else None,
                why,
            )
        )
    return judged


def _order(folds: dict[str, Row]) -> Claim:
    column = "joints in the order in which they shut"
    paper, device = str(folds[PAPER][column]), str(folds[DEVICE][column])
    return Claim(
        "joints shut in another order in the simulation than in the film.",
        f"in the order {paper} with the paper's solver, {device} with this project's and "
        "rectangles.",
        paper != device,
    )


def _jumps(row: Row) -> Claim:
    return Claim(
        "the displacement jumps where the collision handling sets angles.",
        f"its largest change from frame to frame, {float(row['largest jump [mm]']):.2g} mm at "
        f"{float(row['jump at [s]']):.3f} s, has "
        f"{'a' if row['snap beside it'] == 'yes' else 'no'} snap beside it.",
        row["snap beside it"] == "yes",
    )


def draw(measured: Measured, folder: Path) -> list[Picture]:
    """Draw displacement over time, then the angles of all joints over time."""
    paths = [folder / f"figure-{number}.png" for number in (13, 14)]
    rows = measured["over-time"]
    save_figure(_draw_displacement(rows), paths[0])
    save_figure(_draw_angles(rows), paths[1])
    return [
        Picture(
            paths[0],
            "Figure 13's counterpart: mean distance of the components' centres between two "
            "simulations, by what differs between them; dotted, the mean that the paper gives for "
            "its own from the film.",
        ),
        Picture(
            paths[1],
            "Figure 14's counterpart: relative angles of the five joints (top: half charge, "
            "bottom: whole charge); dotted, where the paper snaps them.",
        ),
    ]


def _draw_displacement(rows: list[Row]) -> Any:
    figure, axes = panels(2, "", 5.6, 4.2)
    for axis, name in zip(axes, motions.charges(), strict=True):
        mine = select(rows, charge=name)
        for k, (differing, (one, other)) in enumerate(PAIRS.items()):
            axis.plot(
                numbers(mine, "time [s]"),
                numbers(mine, f"{differing} [mm]"),
                color=COLOURS[k + 1],
                label=f"{one} – {other}",
            )
        axis.axhline(1e3 * DISPLACEMENT, color=INK, linestyle=":", linewidth=1.0)
        axis.set_title(f"{name} on a pole face", fontsize=10)
        axis.set_xlabel("time [s]")
    axes[0].set_ylabel("mean distance of the centres [mm]")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(labels), frameon=False)
    return figure


def _draw_angles(rows: list[Row]) -> Any:
    names = list(motions.charges())
    joints = sum(key.startswith(PAPER) for key in rows[0])
    figure = figure_class()(figsize=(13.5, 5.6), layout="constrained")
    axes = figure.subplots(len(names), joints, sharex=True, sharey=True)
    for row, name in zip(axes, names, strict=True):
        mine = select(rows, charge=name)
        for j, axis in enumerate(row, start=1):
            for k, made_by in enumerate((PAPER, OURS, DEVICE)):
                axis.plot(
                    numbers(mine, "time [s]"),
                    numbers(mine, f"{made_by}, joint {j} [°]"),
                    color=COLOURS[(2, 1, 3)[k]],
                    linewidth=1.3,
                    label=made_by,
                )
            for snap in (-np.rad2deg(SNAP), np.rad2deg(SNAP)):
                axis.axhline(snap, color=INK, linestyle=":", linewidth=0.8)
            axis.set_yticks([-90, -45, 0, 45, 90])
            axis.grid(visible=True, color=GRID, linewidth=0.7)
            axis.spines[["top", "right"]].set_visible(False)
        row[0].set_ylabel(f"{name}: angle [°]")
    for j, axis in enumerate(axes[0], start=1):
        axis.set_title(f"joint {j} (components {j} and {j + 1})", fontsize=10)
    for axis in axes[-1]:
        axis.set_xlabel("time [s]")
    handles, labels = axes[0][0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(labels), frameon=False)
    return figure


REPRODUCTION = Reproduction(
    "figures-13-14",
    "Figures 13 and 14: displacement and angles over time",
    shows="Sequence 3, its first component held: the mean distance of the centres between "
    "simulation and film over time, and the relative angles of both. Stated: 8.2 mm and 0.442 rad "
    "on average, 3 mm at the start, the same final shape.",
    computed="The paper's solver at its own time step beside this project's: once on the same "
    "point charges, so that only the solver differs, once with charged rectangles, which stand for "
    "the real magnets. With the charges that equation 7 prints (half) and those of a 0.6 T magnet "
    f"(whole). All start straight; chains at rest stay where they are until {motions.UNTIL:g} s.",
    missing="The film and its tracking. The 3 mm at the start come from the experiment's hinges of "
    "string and have no counterpart: both solvers start from the same chain. Figure 14's caption "
    "prints a friction coefficient of 3.5; 0.35 is taken, as in the text.",
    measure=measure,
    tables=tables,
    claims=claims,
    draw=draw,
)
