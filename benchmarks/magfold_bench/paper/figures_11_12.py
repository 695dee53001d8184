"""Figures 11 and 12: the error of the paper's solver, by time step and number of charges."""

import math
from collections.abc import Callable
from functools import partial

import numpy as np

from magfold_bench import tables
from magfold_bench.laws.exact_magnets import face_force
from magfold_bench.paper import motions, quoted
from magfold_bench.paper.reproduction import Claim, Measured, Plot, Reproduction
from magfold_bench.presentation import Lines
from magfold_bench.tables import Progress, Row, Table, numbers, select
from magfold_env.engine.magnets import laws
from magfold_env.engine.magnets.laws import FacePair
from magfold_env.engine.magnets.pairs import level_sum
from magfold_env.engine.state import Magnets as Packed
from magfold_env.engine.state import Nodes
from magfold_env.engine.workspace import new_nodes
from magfold_env.scene import Magnets, Scene
from magfold_env.shapes import BoolArray
from magfold_env.simulation.pack import pack_magnets

SMALL = 0.1
"""Distances below this share of the paper's distance between simulation and film are small."""


ERROR, EARLY = "error [rad²]", "before the first snap: "


def _over_time(case: Row, found: motions.Motion, reference: motions.Motion) -> list[Row]:
    error = motions.squared_error(found, reference)
    times = zip(found.time.tolist(), error.tolist(), strict=True)
    return [{**case, "time [s]": time, ERROR: each} for time, each in times]


def _mean(one: motions.Motion, other: motions.Motion, frames: BoolArray | None = None) -> float:
    """Return the mean squared difference [rad²] over all frames or some."""
    error = motions.squared_error(one, other)
    return float((error if frames is None else error[frames]).mean())


def _ends(found: motions.Motion, reference: motions.Motion) -> Row:
    ends: Row = {"word": found.word, "ended": found.ended}
    return ends | {"reference": reference.word, "reference ended": reference.ended}


def _tables(measured: Measured, *left_out: str) -> list[Table]:
    """Return the means, one table per strength of magnets, without redundant columns."""
    return [
        Table(
            f"{name.capitalize()}: mean squared errors and ends of folds",
            [
                {key: cell for key, cell in row.items() if key not in ("charge", *left_out)}
                for row in rows
            ],
        )
        for name, rows in motions.by_charge(measured["means"]).items()
    ]


def _for_each_charge(
    judge: Callable[[str, list[Row]], list[Claim]], measured: Measured
) -> list[Claim]:
    cases = motions.by_charge(measured["means"])
    return [claim for name, rows in cases.items() for claim in judge(name, rows)]


def _over_time_plot(name: str, measured: Measured, line: str) -> Plot:
    """Draw the error over time, one panel per strength of magnets."""
    title = "The paper's solver: squared error of the angles"
    moved = [row for row in measured["over-time"] if float(row[ERROR]) > 0.0]
    figure = Lines(title, "time [s]", ERROR, line, ("charge",), linear="x").draw(moved)
    return Plot.of(name, figure, f"Squared error over time from this project's, by {line}.")


# --- Figure 11: the time step ----------------------------------------------------------------

STEPS, FINEST = (1, 2, 5, 10, 20, 50, 100), 1000
QUICK_STEPS, QUICK_FINEST = (1, 2, 5, 10, 20), 200

OWN, SMOOTH = "from its limit [rad²]", "without friction [rad²]"


def steps(quick: bool, progress: Progress) -> Measured:
    """Simulate the fold with smaller and smaller steps of the paper's solver."""
    counts, finest = (QUICK_STEPS, QUICK_FINEST) if quick else (STEPS, FINEST)
    over_time: list[Row] = []
    means: list[Row] = []
    for (name, charge), tick in motions.each_charge(progress):
        scene = motions.literal(charge)
        smooth = scene.replace(friction=0.0)
        ours, ours_smooth = (motions.follow(motions.exact(each)) for each in (scene, smooth))
        limit = motions.follow(motions.stepped(scene, finest))
        early = motions.before_snap(ours, limit)
        for j, count in enumerate(counts):
            tick(j / len(counts))
            found, free = (motions.follow(motions.stepped(each, count)) for each in (scene, smooth))
            case: Row = {"charge": name, "steps per frame": count}
            over_time += _over_time(case, found, ours)
            errors: Row = {
                "Δt [ms]": 1e3 / (quoted.FRAME_RATE * count),
                ERROR: _mean(found, ours),
                EARLY + ERROR: _mean(found, ours, early),
                EARLY + OWN: _mean(found, limit, early),
                EARLY + SMOOTH: _mean(free, ours_smooth, motions.before_snap(free, ours_smooth)),
            }
            means.append(case | errors | _ends(found, ours))
    return {"over-time": over_time, "means": means}


def steps_claims(name: str, rows: list[Row]) -> list[Claim]:
    """Judge the paper's time step for one charge, up to the first snap and for the whole fold."""
    (chosen,) = select(rows, {"steps per frame": quoted.COMPUTATIONS})
    stated = f"{quoted.COMPUTATIONS} steps per frame of the film are fine enough to continue with"
    own, ours, smooth = (math.sqrt(float(chosen[EARLY + key])) for key in (OWN, ERROR, SMOOTH))
    finest = math.sqrt(float(rows[-1][EARLY + SMOOTH]))
    growth = tables.power(numbers(rows, "Δt [ms]"), numbers(rows, EARLY + OWN))
    before = Claim(
        f"{stated} ({name}, until the first joint snaps).",
        f"with them, the angles are {own:.2g} rad (root mean square) from the limit that it "
        f"approaches with smaller and smaller steps; its squared error falls as Δt to the power "
        f"{growth:.1f}, as for a first-order scheme.",
        own < SMALL * quoted.ANGLE,
        f"From our solver, they are {ours:.2g} rad off; without friction {smooth:.2g} rad, "
        f"and {finest:.2g} rad with the smallest steps"
        + (": both solve the same equation" if finest < SMALL * quoted.ANGLE else "")
        + ". Equation 41 includes neither static friction nor friction torques.",
    )
    finer = [row for row in rows if int(row["steps per frame"]) >= quoted.COMPUTATIONS]
    words = tables.distinct(finer, "word")
    whole = Claim.unless(
        f"{stated} ({name}, the whole fold).",
        f"from there on, smaller steps end in {', '.join(words)}; this project's solver ends in "
        f"{rows[0]['reference']} ({rows[0]['reference ended']}).",
        len(words) == 1,
        "A snap moves a joint by up to 9° at once and averages two rates, and nothing keeps "
        "components apart that are not neighbours: point charges of either sign come as close to "
        "each other as the step allows. What follows the first snaps depends on the step.",
    )
    return [before, whole]


def steps_plots(measured: Measured) -> list[Plot]:
    """Draw the error over time for each step, and the mean error before the first snap by step."""
    title = "Before the first snap: squared error relative to this project's solver"
    means = Lines(title, "Δt [ms]", EARLY + ERROR, "charge").draw(measured["means"])
    return [
        _over_time_plot("figure-11", measured, "steps per frame"),
        Plot.of("figure-11-means", means, "Mean until the first joint snaps, by time step."),
    ]


FIGURE_11 = Reproduction(
    "figure-11",
    "Figure 11: error against the time step",
    "The solver",
    shows="The mean squared error of the angles over time between the simulation of sequence 3, "
    "its first component held, and a film of it, for several time steps, with three charges per "
    "pole face. The text gives no numbers; it continues with 5 steps per frame of 1/240 s.",
    computed="The paper's solver (double Euler, neighbours snapping at 81°, equation 41's "
    "friction) with the same time steps, from a straight chain; the reference is this project's "
    "solver with the same point charges, hard contact and Coulomb friction with sticking, at a "
    f"tolerance of {motions.EXACT:g} rad. Done twice: with the charges in equation 7 (half "
    "charge) and with the charges of a 0.6 T magnet (whole charge).",
    missing="The film: the error here is known only relative to a better solution "
    "of the same model. Mass and sizes are assumed.",
    measure=steps,
    tables=lambda measured: _tables(measured, "Δt [ms]"),
    claims=lambda measured: _for_each_charge(steps_claims, measured),
    plots=steps_plots,
    inputs=motions.INPUTS,
)


# --- Figure 12: the number of charges on a pole face -----------------------------------------

COUNTS = (1, 2, 3, 5, 10, 30)
GAPS = 1e-3 * 10.0 ** np.linspace(-0.5, 1.5, 41)  # [m]; one of them is 1 mm
NEAR_FORCE = 0.1
"""Relative error of the force below which point charges count as accurate."""
GAP = 0.001  # [m] between the magnets of two touching faces, each 0.5 mm inside its casing

MANY = "from 30 charges [rad²]"


def points(quick: bool, progress: Progress) -> Measured:
    """Simulate the fold with more and more charges per face; the reference has rectangles."""
    over_time: list[Row] = []
    means: list[Row] = []
    for (name, charge), tick in motions.each_charge(progress):
        scene = motions.default_steps(charge)
        reference = motions.follow(motions.rectangles(motions.exact(scene)))
        found: dict[int, motions.Motion] = {}
        for j, count in enumerate(COUNTS):
            tick(j / len(COUNTS))
            found[count] = motions.follow(scene.replace(magnets={"nodes": count}))
        many = found[quoted.MANY_CHARGES]
        for count, motion in found.items():
            case: Row = {"charge": name, "h": count}
            over_time += _over_time(case, motion, reference)
            early = motions.before_snap(motion, reference)
            errors: Row = {
                ERROR: _mean(motion, reference),
                EARLY + ERROR: _mean(motion, reference, early),
                EARLY + MANY: _mean(motion, many, motions.before_snap(motion, many)),
                "whole fold, " + MANY: _mean(motion, many),
            }
            means.append(case | errors | _ends(motion, reference))
    return {"over-time": over_time, "means": means, "forces": force_rows()}


def force_rows() -> list[Row]:
    """Return one row per gap and number of charges, with the force relative to the exact force.

    The force acts between two equal magnets that face each other.
    """
    scene = Scene(sequence=("NNNN",), magnets=Magnets())
    thickness, charge = float(Magnets().by_face("thickness")[0]), Magnets().charge
    rows: list[Row] = []
    for count in COUNTS:
        magnets = pack_magnets(scene.replace(magnets=Magnets(model="points", nodes=count)))
        points = partial(_points_force, magnets, charge, new_nodes(magnets, 1))
        for gap in GAPS.tolist():
            right = _magnet_force(partial(face_force, scene), gap, thickness)
            rows.append(
                {
                    "gap [mm]": 1e3 * gap,
                    "h": count,
                    "exact [N]": right,
                    "magnets / exact": _magnet_force(points, gap, thickness) / right,
                }
            )
    return rows


def _magnet_force(face: Callable[[float], float], gap: float, thickness: float) -> float:
    """Return the force between two magnets [N], given that between faces by their gap [m].

    Each magnet has two faces of opposite sign, a thickness [m] apart.
    """
    return face(gap) - 2.0 * face(gap + thickness) + face(gap + 2.0 * thickness)


def _points_force(magnets: Packed, charge: float, nodes: Nodes, gap: float) -> float:
    """Return the force [N] between two opposite pole faces, each with a charge [A m].

    Both have the nodes of level 0, which are all their nodes if a scene gives the number of nodes.
    """
    width = math.hypot(magnets.face_tx[0], magnets.face_ty[0])
    half = magnets.face_half[0]
    faces = FacePair(magnets.even, half, half, 0.0, gap, width, 0.0, width, 0.0)
    return laws.COULOMB * charge**2 * level_sum(magnets, 0, faces, False, nodes)[2]


def _forces(measured: Measured) -> dict[int, float]:
    """Return the force between touching casings over the exact one, by number of charges."""
    rows = measured["forces"]
    at = min((float(row["gap [mm]"]) for row in rows), key=lambda gap: abs(gap - 1e3 * GAP))
    near = select(rows, {"gap [mm]": at})
    return {int(row["h"]): float(row["magnets / exact"]) for row in near}


def points_tables(measured: Measured) -> list[Table]:
    """Return errors and ends, with one row per number of charges, and the forces at contact."""
    near: list[Row] = [{"h": h, "force / exact": force} for h, force in _forces(measured).items()]
    title = f"Two magnets, {1e3 * GAP:.0f} mm apart, as in touching casings"
    return [*_tables(measured), Table(title, near)]


def points_claims(measured: Measured) -> list[Claim]:
    """Judge whether three charges do as well as thirty, and whether either number is accurate."""
    few, many = quoted.CHARGES, quoted.MANY_CHARGES
    at = _forces(measured)
    force = Claim(
        f"h = {few} represents the magnets well enough to continue with.",
        f"where casings touch, {few} charges per face pull {at[few]:.1f} times as hard as "
        f"magnets with the same charge, and {many} charges {at[many]:.1f} times.",
        abs(at[few] - 1.0) < NEAR_FORCE,
        "More charges on a line converge, but not to a magnet's force: the magnet is as high as it "
        "is wide, whereas a line's field is stronger close to it.",
    )
    return [*_for_each_charge(_points_claims, measured), force]


def _points_claims(name: str, rows: list[Row]) -> list[Claim]:
    (few,), (many,) = (select(rows, h=h) for h in (quoted.CHARGES, quoted.MANY_CHARGES))
    stated = f"the difference between h = {few['h']} and h = {many['h']} is minimal"
    early, whole = (math.sqrt(float(few[key + MANY])) for key in (EARLY, "whole fold, "))
    small = SMALL * quoted.ANGLE
    same = few["word"] == many["word"] and whole < small
    return [
        Claim(
            f"{stated} ({name}, until the first joint snaps).",
            f"they differ by {early:.2g} rad (root mean square).",
            early < small,
        ),
        Claim.unless(
            f"{stated} ({name}, the whole fold).",
            f"they differ by {whole:.2g} rad and end in {few['word']} and {many['word']}; "
            f"rectangles of the same charge, in this project's solver, end in "
            f"{few['reference']} ({few['reference ended']}).",
            same,
            "After the first snaps, the paper's solver amplifies any difference (see Figure "
            "11), so how a fold continues says little about the number of charges.",
        ),
    ]


def points_plots(measured: Measured) -> list[Plot]:
    """Draw the error over time for each number of charges, and the force against the gap."""
    title = "Force between two magnets: h points per pole face relative to rectangles"
    forces = Lines(title, "gap [mm]", "magnets / exact", "h").draw(measured["forces"])
    return [
        _over_time_plot("figure-12", measured, "h"),
        Plot.of("figure-12-forces", forces, "Errors of the forces of points, without dynamics."),
    ]


FIGURE_12 = Reproduction(
    "figure-12",
    "Figure 12: error against the number of charges",
    "The solver",
    shows="The mean squared error of the angles over time from the film, for several numbers h "
    "of point charges per pole face; the text gives no numbers.",
    computed="The paper's solver at its own time step with h charges; the reference is this "
    "project's solver with charged rectangles, 6 mm by 6 mm, of the same charge. In addition, the "
    "force between two magnets relative to the exact force.",
    missing="The film, as in Figure 11; the sizes of magnets and casing are assumed.",
    measure=points,
    tables=points_tables,
    claims=points_claims,
    plots=points_plots,
    inputs=motions.INPUTS,
)
