"""What the point model gets wrong: the force between two magnets, and which fold wins.

A pole face as a row of h charges, the paper's model, is a line: near another face it is far too
strong, with any h, because a sheet spreads its charge over its height as well. Of two magnets
that look at each other the far faces weaken the near ones' pull, but not its error.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from magfold_env.benchmarks.magnets.samples import random_scene
from magfold_env.laws.exact_magnets import CHARGES, force_rows, rows_at
from magfold_env.minimiser import minimise
from magfold_env.reporting import plotting
from magfold_env.reporting.tables import Measurement, Progress, Row, Table, select
from magfold_env.scene import Magnets

SHOWN = (0.001, 0.0032, 0.01)  # [m] in the table
PAPER = 3  # charges a face
SEED = 7
LENGTH = 6
SEQUENCES, QUICK_SEQUENCES = 500, 20


def run(quick: bool, progress: Progress) -> Measurement:
    """Compare forces over gaps, and ground states of random sequences."""
    rows = force_rows()
    count = QUICK_SEQUENCES if quick else SEQUENCES
    other = other_ground_states(count, progress)
    near = select(rows_at(rows, SHOWN[0]), h=PAPER)[0]
    findings = [
        f"two magnets {near['gap [mm]']:.0f} mm apart, {PAPER} point charges a face: "
        f"{float(near['magnets / exact']):.3g} times the force (their near faces alone: "
        f"{float(near['faces / exact']):.3g} times)",
        f"{other} of {count} random sequences of {LENGTH} have another ground state with "
        f"{PAPER} point charges a face: {other / count:.0%}",
    ]
    return Measurement(rows, [_table(rows)], findings)


def other_ground_states(count: int, progress: Progress) -> int:
    """Of so many random sequences, count those whose ground state the point model misses."""
    rng = np.random.default_rng(SEED)
    points = Magnets(model="points", nodes=PAPER)
    missed = 0
    for k in range(count):
        progress(k / count, "ground states")
        scene = random_scene(rng, LENGTH)
        best = minimise(scene, top=1).best
        found = minimise(scene.replace(magnets=points), top=1).best
        missed += found.word not in (best.word, *best.tied)
    return missed


def _table(rows: list[Row]) -> Table:
    shown: list[Row] = []
    for gap in SHOWN:
        mine = rows_at(rows, gap)
        line: Row = {"gap [mm]": mine[0]["gap [mm]"], "exact [N]": mine[0]["exact [N]"]}
        shown.append(line | {f"h = {row['h']}": row["magnets / exact"] for row in mine})
    return Table("Two magnets, h point charges a face: force over the exact force", shown)


def draw(rows: list[Row]) -> Any:
    """Draw the force between two magnets over the exact one: against the gap, and against h."""
    figure, axes = plotting.panels(
        2, "Two magnets, h point charges a pole face: force over the exact force", shared=False
    )
    for k, count in enumerate(CHARGES):
        mine = select(rows, h=count)
        axes[0].loglog(
            plotting.numbers(mine, "gap [mm]"),
            plotting.numbers(mine, "magnets / exact"),
            color=plotting.COLOURS[k],
            linewidth=2.2 if count == PAPER else 1.3,
            label=f"h = {count}",
        )
    axes[0].set_xlabel("gap between the magnets [mm]")
    for k, gap in enumerate(SHOWN):
        mine = rows_at(rows, gap)
        label = f"gap {float(mine[0]['gap [mm]']):.2g} mm"
        plotting.curve(axes[1], mine, "h", "magnets / exact", k, label=label)
    axes[1].set_xlabel("point charges a face, h")
    axes[1].set_xticks(CHARGES, [str(count) for count in CHARGES])
    axes[1].minorticks_off()
    for axis in axes:
        axis.axhline(1.0, color=plotting.INK, linewidth=1.0, linestyle="--")
        plotting.legend(axis, "upper right")
    axes[0].set_ylabel("force / force with charged rectangles")
    return figure
