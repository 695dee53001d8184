"""What the point model gets wrong: the force between two magnets, and which fold wins.

A pole face as a row of h charges, the paper's model, is a line: near another face it is far too
strong, with any h, because a sheet spreads its charge over its height as well. Of two magnets
that look at each other the far faces weaken the near ones' pull, but not its error.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from magfold_env.benchmarks.magnets import reference
from magfold_env.benchmarks.magnets.kernels import face_force
from magfold_env.benchmarks.magnets.poses import random_scene
from magfold_env.engine.magnets.laws import COULOMB
from magfold_env.engine.state import Magnets as Faces
from magfold_env.engine.state import Nodes
from magfold_env.engine.workspace import new_nodes
from magfold_env.minimiser import minimise
from magfold_env.reporting.part import Part, Progress, Row, Table
from magfold_env.scene import Magnets, Scene
from magfold_env.simulation.pack import pack_magnets

NAME = "points"
CHARGES = (1, 2, 3, 5, 10, 30)
GAPS = 1e-3 * 10.0 ** np.linspace(-0.5, 1.5, 41)  # [m]; one of them is a millimetre
SHOWN = (0.001, 0.0032, 0.01)  # [m] in the table
PAPER = 3  # charges a face
SEED = 7
LENGTH = 6


def run(quick: bool, progress: Progress) -> Part:
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
    return Part(NAME, rows, [_table(rows)], findings)


def force_rows() -> list[Row]:
    """Return a row a gap and number of charges: what two magnets do to each other, over the exact.

    The magnets are equal and look at each other; beside them stand their near faces alone.
    """
    scene = Scene(sequence=("NNNN",), magnets=Magnets())
    thickness, charge = float(Magnets().by_face("thickness")[0]), Magnets().charge
    rows: list[Row] = []
    for count in CHARGES:
        magnets = pack_magnets(scene.replace(magnets=Magnets(model="points", nodes=count)))
        nodes = new_nodes(magnets, 1)

        def points(gap: float, magnets: Faces = magnets, nodes: Nodes = nodes) -> float:
            return COULOMB * charge**2 * face_force(magnets, gap, nodes)

        def exact(gap: float) -> float:
            return reference.face_force(scene, gap)

        for gap in GAPS.tolist():
            right = magnet_force(exact, gap, thickness)
            rows.append(
                {
                    "gap [mm]": 1e3 * gap,
                    "h": count,
                    "exact [N]": right,
                    "magnets / exact": magnet_force(points, gap, thickness) / right,
                    "faces / exact": points(gap) / exact(gap),
                }
            )
    return rows


def magnet_force(face: Callable[[float], float], gap: float, thickness: float) -> float:
    """Force between two magnets [N] from that between two faces as a function of their gap [m].

    Each has a face of either sign, a thickness [m] apart.
    """
    return face(gap) - 2.0 * face(gap + thickness) + face(gap + 2.0 * thickness)


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


def rows_at(rows: list[Row], gap: float) -> list[Row]:
    """Return the rows of the gap that is nearest to one [m]."""
    nearest = min((float(row["gap [mm]"]) for row in rows), key=lambda g: abs(g - 1e3 * gap))
    return [row for row in rows if row["gap [mm]"] == nearest]


def _table(rows: list[Row]) -> Table:
    shown: list[Row] = []
    for gap in SHOWN:
        mine = rows_at(rows, gap)
        line: Row = {"gap [mm]": mine[0]["gap [mm]"], "exact [N]": mine[0]["exact [N]"]}
        shown.append(line | {f"h = {row['h']}": row["magnets / exact"] for row in mine})
    return Table("Two magnets, h point charges a face: force over the exact force", shown)
