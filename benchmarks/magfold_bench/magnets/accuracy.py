"""Time against error, for both models of magnets and every way to choose nodes.

Errors are of forces and torques of casings against `laws.exact_magnets`, relative to the force
between two flush opposite faces, torques over the side: the quantity that the scene's accuracy
bounds. Pairs of casings are random, touching ones among them; chains of six are unfolded, folded or
on the way, and long chains either.

Then what the point model gets wrong: the force between two magnets, and which fold wins. A pole
face as a row of h charges, the paper's model, is a line: near another face it is far too strong,
with any h, because a sheet spreads its charge over its height as well. Of two magnets that look at
each other the far faces weaken the near ones' pull, but not its error.
"""

from typing import Any, NamedTuple

import numpy as np

from magfold_bench.laws.exact_magnets import CHARGES, force_rows, rows_at
from magfold_bench.magnets import samples
from magfold_bench.presentation import panels_by
from magfold_env.engine.state import Array
from magfold_env.minimiser import minimise
from magfold_env.reporting import plotting, tables
from magfold_env.reporting.tables import Measurement, Progress, Row, Table, Tick
from magfold_env.scene import Casing, Magnets, Scene
from magfold_env.shapes import centres

PAIRS, FOLDS, LONG = "pairs of casings", "chains of 6", "chains of 60"
POINTS, NODES, BOUND = "points", "strips, fixed nodes", "strips, error bound"
SEED = 4
LENGTH, LONG_LENGTH = 6, 60
FLUSH = "force between two flush opposite faces"
SMALLEST = 1e-8  # error that is drawn; below it the reference's own may show
DRAWN = {POINTS: "charges a face", NODES: "nodes a face", BOUND: "bound"}
"""What the settings are, by the way to choose nodes."""

SHOWN = (0.001, 0.0032, 0.01)  # [m] in the table
PAPER = 3  # charges a face
SEQUENCES_SEED = 7
SEQUENCES, QUICK_SEQUENCES = 500, 20


class Effort(NamedTuple):
    """How much work a run of the benchmark may be."""

    pairs: int
    folds: int
    long: int
    charges: tuple[int, ...]  # of the point model, a pole face
    nodes: tuple[int, ...]  # of the strips, a pole face
    bounds: tuple[float, ...]
    rounds: int  # samples of every timing


QUICK = Effort(60, 6, 1, (1, 3, 30), (3, 16), (1e-2, 1e-4), 2)
FULL = Effort(
    2000,
    100,
    6,
    (1, 2, 3, 5, 8, 12, 20, 30),
    (1, 2, 3, 4, 6, 8, 12, 16, 24),
    (5e-2, 1e-2, 1e-3, 1e-4, 1e-5),
    7,
)


def run(quick: bool, progress: Progress) -> Measurement:
    """Measure all settings on pairs and on chains."""
    effort = QUICK if quick else FULL
    rng = np.random.default_rng(SEED)
    found, side = Measurement(), Casing().side
    sets = {
        PAIRS: [
            (samples.random_scene(rng, 2), samples.random_pair(rng, side))
            for _ in range(effort.pairs)
        ],
        FOLDS: [draw_chain(rng, LENGTH) for _ in range(effort.folds)],
        LONG: [
            draw_chain(rng, LONG_LENGTH, (samples.folded, samples.unfolded)[k % 2](LONG_LENGTH))
            for k in range(effort.long)
        ],
    }
    for name, tick in tables.each_case(progress, list(sets)):
        scenes, poses = zip(*sets[name], strict=True)
        sample = samples.sample_of(scenes, poses)
        rows = measure(name, sample, effort, tick)
        found.rows.extend(rows)
        title = f"Forces and torques of {sample.size} {name}: errors in flush forces, µs a state"
        found.tables.append(Table(title, tables.without_quartiles(rows, "states")))
        found.findings.extend(_findings(name, sample, rows))
    return found


def draw_chain(
    rng: np.random.Generator, n: int, headings: Array | None = None
) -> tuple[Scene, tuple[Array, Array]]:
    """Draw the poles of a chain, and its pose if no headings (n,) are given."""
    scene = samples.random_scene(rng, n)
    if headings is None:
        headings = samples.random_shape(rng, n, scene.casing.side)
    return scene, (centres(headings, scene.casing.side), headings)


def measure(name: str, sample: samples.Sample, effort: Effort, tick: Tick) -> list[Row]:
    """Return a row for every setting of every way to choose nodes."""
    settings: dict[tuple[str, float], Magnets] = {
        **{(POINTS, count): Magnets(model="points", nodes=count) for count in effort.charges},
        **{(NODES, count): Magnets(nodes=count) for count in effort.nodes},
        **{(BOUND, bound): Magnets(accuracy=bound) for bound in effort.bounds},
    }
    sums = {key: samples.Sums(sample, magnets) for key, magnets in settings.items()}
    errors = {key: sample.errors(each.loads()) for key, each in sums.items()}
    times = samples.time_each(sums, effort.rounds, tick)
    return [
        {
            "states": name,
            "model": model,
            "setting": setting,
            "worst error": float(errors[model, setting].max()),
            "median error": float(np.median(errors[model, setting])),
            **time.spread.time_cells("µs", 1e6),
        }
        for (model, setting), time in times.items()
    ]


def _findings(name: str, sample: samples.Sample, rows: list[Row]) -> list[str]:
    """Say whether the bounds hold, and what the point model is off by."""
    bounded = tables.select(rows, model=BOUND)
    used = tables.numbers(bounded, "worst error") / tables.numbers(bounded, "setting")
    shares = ", ".join(
        f"{share:.0%} of {float(row['setting']):g}"
        for share, row in zip(used, bounded, strict=True)
    )
    best = min(tables.select(rows, model=POINTS), key=lambda row: float(row["worst error"]))
    return [
        f"{sample.size} {name}: the worst errors are {shares}; the bound "
        f"{tables.verdict((used <= 1.0).all())}",
        f"{sample.size} {name}: no number of point charges has a smaller worst error than "
        f"{float(best['worst error']):.2g} flush forces (at h = {best['setting']:.0f})",
    ]


def draw(rows: list[Row]) -> Any:
    """Worst error against time, a panel a kind of states; settings are written at the points."""
    rows = [row | {"drawn": max(float(row["worst error"]), SMALLEST)} for row in rows]
    title = "Magnet forces: worst error against time"
    labels = "time of a state [µs]", f"worst error / {FLUSH}"
    figure, panels = panels_by(rows, ("states",), title, labels, shared=False)
    for axis, here in panels:
        for k, model in enumerate(tables.distinct(here, "model")):
            mine = tables.select(here, model=model)
            bold, colour = model == BOUND, plotting.COLOURS[(2, 1, 3)[k % 3]]
            style = {"linewidth": 2.2, "zorder": 3} if bold else {"linewidth": 1.3, "zorder": 2}
            style |= {"color": colour, "label": f"{model} ({DRAWN[model]})"}
            points = plotting.curve(axis, mine, "time [µs]", "drawn", k, **style)
            texts = [f"{float(row['setting']):g}" for row in mine]
            plotting.label_points(axis, zip(*points, strict=True), texts, left=bold, color=colour)
        axis.margins(x=0.13)  # room for the settings beside the outermost points
        axis.set_ylim(SMALLEST / 2.0, 100.0)
    plotting.legend_below(figure, panels[0][0])
    return figure


def points(quick: bool, progress: Progress) -> Measurement:
    """Compare forces over gaps, and ground states of random sequences."""
    rows = force_rows()
    count = QUICK_SEQUENCES if quick else SEQUENCES
    other = other_ground_states(count, progress)
    near = tables.select(rows_at(rows, SHOWN[0]), h=PAPER)[0]
    findings = [
        f"two magnets {near['gap [mm]']:.0f} mm apart, {PAPER} point charges a face: "
        f"{float(near['magnets / exact']):.3g} times the force (their near faces alone: "
        f"{float(near['faces / exact']):.3g} times)",
        f"{other} of {count} random sequences of {LENGTH} have another ground state with "
        f"{PAPER} point charges a face: {other / count:.0%}",
    ]
    shown: list[Row] = []
    for gap in SHOWN:
        mine = rows_at(rows, gap)
        line: Row = {"gap [mm]": mine[0]["gap [mm]"], "exact [N]": mine[0]["exact [N]"]}
        shown.append(line | {f"h = {row['h']}": row["magnets / exact"] for row in mine})
    title = "Two magnets, h point charges a face: force over the exact force"
    return Measurement(rows, [Table(title, shown)], findings)


def other_ground_states(count: int, progress: Progress) -> int:
    """Of so many random sequences, count those whose ground state the point model misses."""
    rng = np.random.default_rng(SEQUENCES_SEED)
    points = Magnets(model="points", nodes=PAPER)
    missed = 0
    for k in range(count):
        progress(k / count, "ground states")
        scene = samples.random_scene(rng, LENGTH)
        best = minimise(scene, top=1).best
        found = minimise(scene.replace(magnets=points), top=1).best
        missed += found.word not in (best.word, *best.tied)
    return missed


def draw_points(rows: list[Row]) -> Any:
    """Draw the force between two magnets over the exact one: against the gap, and against h."""
    title = "Two magnets, h point charges a pole face: force over the exact force"
    figure, axes = plotting.panels(2, title, shared=False)
    for k, count in enumerate(CHARGES):
        mine = tables.select(rows, h=count)
        axes[0].loglog(
            tables.numbers(mine, "gap [mm]"),
            tables.numbers(mine, "magnets / exact"),
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
