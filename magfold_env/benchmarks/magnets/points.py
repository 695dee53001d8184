"""What the point model gets wrong: the force between two magnets, and which fold wins.

A pole face as a row of h charges, the paper's model, is a line: near another face it is far too
strong, with any h, because a sheet spreads its charge over its height as well. Of two magnets
that look at each other the far faces weaken the near ones' pull, but not its error.
"""

from __future__ import annotations

import numpy as np

from magfold_env.benchmarks.magnets.poses import random_scene
from magfold_env.laws.exact_magnets import force_rows, rows_at
from magfold_env.minimiser import minimise
from magfold_env.reporting.tables import Measurement, Progress, Row, Table
from magfold_env.scene import Magnets

NAME = "points"
SHOWN = (0.001, 0.0032, 0.01)  # [m] in the table
PAPER = 3  # charges a face
SEED = 7
LENGTH = 6


def run(quick: bool, progress: Progress) -> Measurement:
    """Compare forces over gaps, and ground states of random sequences."""
    rows = force_rows()
    count = 20 if quick else 500
    other = other_ground_states(count, progress)
    near = next(row for row in rows_at(rows, SHOWN[0]) if row["h"] == PAPER)
    findings = [
        f"two magnets {near['gap [mm]']:.0f} mm apart, {PAPER} point charges a face: "
        f"{float(near['magnets / exact']):.3g} times the force (their near faces alone: "
        f"{float(near['faces / exact']):.3g} times)",
        f"{other} of {count} random sequences of {LENGTH} have another ground state with "
        f"{PAPER} point charges a face: {other / count:.0%}",
    ]
    return Measurement(NAME, rows, [_table(rows)], findings)


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
