"""How the time of all magnet forces grows with the length of the chain, and what a pair costs.

Chains are unfolded, folded into a block with every joint a little off its stop, so that nothing
is at rest against its neighbour, or folded with every joint at its stop, where what rigidly joined
components do to each other is kept. Under an error bound far components act on each other in
segments, and time grows little faster than length; a block has more neighbours to sum over. With a
fixed number of nodes every pair is summed and the work is known: it gives the time of a pair of
nodes.
"""

from __future__ import annotations

import math
from itertools import product
from typing import Any

import numpy as np

from magfold_env.benchmarks.magnets import samples
from magfold_env.benchmarks.magnets.samples import AT_STOPS, FOLDED, UNFOLDED, Chain
from magfold_env.laws.exact_magnets import FACES
from magfold_env.reporting import plotting, tables
from magfold_env.reporting.tables import Measurement, Progress, Row, Table, Tick
from magfold_env.scene import Magnets

LENGTHS = (2, 6, 20, 60, 200, 450, 1000, 3000, 10_000)
QUICK_LENGTHS = (2, 6, 60, 200)
BOUNDS = {f"accuracy {bound:g}": Magnets(accuracy=bound) for bound in (1e-2, 1e-4)}
LONG, STEEPEST = 60, 1.2
NODES_AT = 60  # components, for the price of a pair of nodes
FIXED = {
    **{f"points, h = {h}": Magnets(model="points", nodes=h) for h in (1, 3, 10, 30)},
    **{f"strips, {h} nodes": Magnets(nodes=h) for h in (1, 3, 8, 16)},
}
SEED = 11
SLOPES = {STEEPEST: ":", 2.0: "-."}  # powers of n beside the times, and their lines


def run(quick: bool, progress: Progress) -> Measurement:
    """Measure all lengths, then the price of a pair of nodes."""
    lengths, rounds = (QUICK_LENGTHS, 2) if quick else (LENGTHS, 7)
    rows: list[Row] = []
    for n, tick in tables.each_case(progress, lengths, lambda n: f"n = {n}"):
        rows += _time(n, list(samples.shapes(n)), BOUNDS, rounds, tick)
    progress(1.0, "pairs of nodes")
    fixed = measure_nodes(NODES_AT, rounds)
    return Measurement([*rows, *fixed], [_table(rows), _node_table(fixed)], _findings(rows))


def measure_nodes(n: int, rounds: int) -> list[Row]:
    """Rows of an unfolded chain with fixed numbers of nodes: every pair of nodes is summed."""
    rows = _time(n, [UNFOLDED], FIXED, rounds, lambda _: None)
    for row in rows:
        nodes = FIXED[str(row["magnets"])].nodes
        assert nodes is not None
        row["ns a pair of nodes"] = float(row["ns a pair"]) / (FACES * nodes) ** 2
    return rows


def _time(
    n: int, names: list[str], magnets: dict[str, Magnets], rounds: int, tick: Tick
) -> list[Row]:
    """Time one chain in some shapes with some magnets, in turns."""
    scene = samples.random_scene(np.random.default_rng(SEED), n).replace(friction=0.0)
    headings = samples.shapes(n)
    chains = {
        (shape, name): Chain.pinned(scene.replace(magnets=each), headings[shape])
        for shape, (name, each) in product(names, magnets.items())
    }
    return [
        {
            "shape": shape,
            "magnets": name,
            "n": n,
            **taken.spread.time_cells("µs", 1e6),
            "ns a pair": 1e9 * taken.median / (n * (n - 1) / 2),
            "ns a pair of nodes": math.nan,
        }
        for (shape, name), taken in samples.time_each(chains, rounds, tick).items()
    ]


def _table(rows: list[Row]) -> Table:
    """Return the times, a row a length and a column a shape and accuracy."""
    shown: list[Row] = []
    for n in tables.distinct(rows, "n"):
        mine = tables.select(rows, n=n)
        line: Row = {"n": n}
        for row in mine:
            line[f"{row['shape']}, {row['magnets']}"] = f"{float(row['time [µs]']):.3g}"
        line["µs a component, unfolded"] = float(mine[0]["time [µs]"]) / n
        shown.append(line)
    return Table("All magnet forces of a chain: µs an evaluation", shown)


def _node_table(rows: list[Row]) -> Table:
    keys = ("magnets", "n", "time [µs]", "ns a pair", "ns a pair of nodes")
    title = "Fixed numbers of nodes a face: the price of a pair"
    return Table(title, tables.renamed(rows, dict(zip(keys, keys, strict=True))))


def _findings(rows: list[Row]) -> list[str]:
    found: list[str] = []
    longest = max(int(row["n"]) for row in rows)
    for shape, bound in product((UNFOLDED, FOLDED, AT_STOPS), BOUNDS):
        slope = tables.growth(tables.select(rows, shape=shape, magnets=bound), LONG)
        if math.isfinite(slope):
            asked = f"; at most {STEEPEST} is asked for: {tables.verdict(slope <= STEEPEST)}"
            found.append(
                f"{shape}, {bound}: the time grows like n to the {slope:.2f} "
                f"from n = {LONG} to {longest}{asked if shape == UNFOLDED else ''}"
            )
    return found


def draw(rows: list[Row]) -> Any:
    """Time of all magnet forces against the length, log against log."""
    figure, axes = plotting.panels(1, "All magnet forces of a chain", width=7.5, height=5.0)
    axis = axes[0]
    for k, shape in enumerate(samples.shapes(2)):
        for bound, line in zip(BOUNDS, ("-", "--"), strict=True):
            mine = tables.select(rows, shape=shape, magnets=bound)
            style = {"linestyle": line, "linewidth": 1.6, "label": f"{shape}, {bound}"}
            plotting.curve(axis, mine, "n", "time [µs]", k, **style)
    first = tables.select(rows, shape=UNFOLDED, magnets=next(iter(BOUNDS)))
    longer = [row for row in first if int(row["n"]) >= LONG]
    if longer:
        n = tables.numbers(longer, "n")
        for power, style in SLOPES.items():
            line = float(longer[0]["time [µs]"]) * (n / n[0]) ** power
            label = f"n to the {power:g}"
            axis.loglog(n, line, color=plotting.INK, linewidth=1.2, linestyle=style, label=label)
    axis.set_xlabel("components n")
    axis.set_ylabel("time of an evaluation [µs]")
    plotting.legend(axis, "upper left")
    return figure
