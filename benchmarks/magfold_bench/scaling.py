"""How the cost of a chain grows with its length: of its accelerations, then of its magnets.

For magnets, chains are unfolded, folded into a block with every joint a little off its stop, so
that nothing is at rest against its neighbour, or folded with every joint at its stop, where what
rigidly joined components do to each other is kept. Under an error bound far components act on each
other in segments, and time grows little faster than length; a block has more neighbours to sum
over. With a fixed number of nodes every pair is summed and the work is known: it gives the time of
a pair of nodes.
"""

import math
from collections.abc import Mapping
from itertools import product
from typing import Any

import numpy as np

from magfold_bench.laws import pinned_chain
from magfold_bench.laws.exact_magnets import FACES
from magfold_bench.laws.pinned_chain import LANES, LONG, MUJOCO, PINOCCHIO, SCALAR
from magfold_bench.magnets import samples
from magfold_bench.magnets.samples import AT_STOPS, FOLDED, UNFOLDED, Chain
from magfold_env.reporting import plotting, tables, timing
from magfold_env.reporting.tables import Measurement, Progress, Row, Table, Tick
from magfold_env.scene import Magnets

# At these lengths: how many times faster than Pinocchio one chain must be.
PINOCCHIO_FACTORS = {6: 6.0, 60: 12.0, 450: 12.0}
LANES_AT, LANES_FACTOR = 6, 8.0
STEEPEST, STEEPEST_MAGNETS = 1.1, 1.2  # powers of n
QUARTILES = ("times one chain's", "lower quartile", "upper quartile")

LENGTHS = (2, 6, 20, 60, 200, 450, 1000, 3000, 10_000)
QUICK_LENGTHS = (2, 6, 60, 200)
BOUNDS = {f"accuracy {bound:g}": Magnets(accuracy=bound) for bound in (1e-2, 1e-4)}
NODES_AT = 60  # components, for the price of a pair of nodes
FIXED = {
    **{f"points, h = {h}": Magnets(model="points", nodes=h) for h in (1, 3, 10, 30)},
    **{f"strips, {h} nodes": Magnets(nodes=h) for h in (1, 3, 8, 16)},
}
PAIR = "ns a pair of nodes"
SEED = 11
SLOPES = {STEEPEST_MAGNETS: ":", 2.0: "-."}  # powers of n beside the times, and their lines


def accelerations(quick: bool, progress: Progress) -> Measurement:
    """Measure every contender at every length, as `pinned_chain.measure` does.

    Peers that are not installed have no rows, and a finding says that they are absent.
    """
    rows = pinned_chain.measure(quick, progress)
    names = tables.distinct(rows, "contender")
    lines = _by_length(rows, "contender")
    shown: list[Row] = [
        {"n": n, **{name: line.get(name, "") for name in names}} for n, line in lines.items()
    ]
    found = _findings(rows)
    found += [f"{name} is absent" for name in pinned_chain.missing()]
    title = "Accelerations of a pinned chain: µs an evaluation and chain"
    return Measurement(rows, [Table(title, shown)], found)


def _by_length(rows: list[Row], *columns: str) -> dict[int, dict[str, str]]:
    """Return the times of each length as texts, by what stands in some columns."""
    lines: dict[int, dict[str, str]] = {}
    for row in rows:
        name = ", ".join(str(row[column]) for column in columns)
        lines.setdefault(int(row["n"]), {})[name] = f"{float(row['time [µs]']):.3g}"
    return lines


def _findings(rows: list[Row]) -> list[str]:
    """Say what must hold of the accelerations and what was found."""
    found: list[str] = []
    for n, factor in PINOCCHIO_FACTORS.items():
        for row in tables.select(rows, contender=PINOCCHIO, n=n):
            times = timing.Spread(*(float(row[key]) for key in QUARTILES))
            found.append(
                f"n = {n}: {times} times faster than Pinocchio; at least {factor} is asked for: "
                f"{tables.verdict(times.median >= factor)}"
            )
    for row in tables.select(rows, contender=LANES, n=LANES_AT):
        middle, low, high = (1.0 / float(row[key]) for key in QUARTILES)
        times = timing.Spread(middle, high, low)  # a reciprocal turns the quartiles around
        found.append(
            f"n = {LANES_AT}: in lanes {times} times faster than one chain after the other; at "
            f"least {LANES_FACTOR} is asked for: {tables.verdict(times.median >= LANES_FACTOR)}"
        )
    steps = tables.numbers(tables.select(rows, contender=MUJOCO), "times one chain's")
    if steps.size:
        found.append(f"at least {steps.min():.3g} times faster than a MuJoCo step at all lengths")
    # The rows of many long chains outgrow the processor's cache: nothing is asked of their slope.
    for name in (SCALAR, LANES):
        slope = tables.growth(tables.select(rows, contender=name), LONG)
        if math.isfinite(slope):
            said = f"{name}: the time grows like n to the {slope:.3f} from n = {LONG} on"
            if name == SCALAR:
                said += f"; at most {STEEPEST} is asked for: {tables.verdict(slope <= STEEPEST)}"
            found.append(said)
    return found


def magnets(quick: bool, progress: Progress) -> Measurement:
    """Measure all lengths, then the price of a pair of nodes."""
    lengths, rounds = (QUICK_LENGTHS, 2) if quick else (LENGTHS, 7)
    rows: list[Row] = []
    for n, tick in tables.each_case(progress, lengths, lambda n: f"n = {n}"):
        rows += _time(n, list(samples.shapes(n)), BOUNDS, rounds, tick)
    shown: list[Row] = []
    for n, line in _by_length(rows, "shape", "magnets").items():
        unfolded = float(tables.select(rows, n=n)[0]["time [µs]"])
        shown.append({"n": n, **line, "µs a component, unfolded": unfolded / n})
    progress(1.0, "pairs of nodes")
    # Every pair of nodes is summed.
    fixed = _time(NODES_AT, [UNFOLDED], FIXED, rounds, lambda _: None)
    for row in fixed:
        nodes = FIXED[str(row["magnets"])].nodes
        assert nodes is not None
        row[PAIR] = float(row["ns a pair"]) / (FACES * nodes) ** 2
    prices = tables.without_quartiles(fixed, "shape")
    found = [
        Table("All magnet forces of a chain: µs an evaluation", shown),
        Table("Fixed numbers of nodes a face: the price of a pair", prices),
    ]
    return Measurement([*rows, *fixed], found, _magnets_findings(rows))


def _time(
    n: int, names: list[str], magnets: Mapping[str, Magnets], rounds: int, tick: Tick
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
            PAIR: math.nan,
        }
        for (shape, name), taken in samples.time_each(chains, rounds, tick).items()
    ]


def _magnets_findings(rows: list[Row]) -> list[str]:
    found: list[str] = []
    longest = max(int(row["n"]) for row in rows)
    for shape, bound in product((UNFOLDED, FOLDED, AT_STOPS), BOUNDS):
        slope = tables.growth(tables.select(rows, shape=shape, magnets=bound), LONG)
        if math.isfinite(slope):
            held = tables.verdict(slope <= STEEPEST_MAGNETS)
            asked = f"; at most {STEEPEST_MAGNETS} is asked for: {held}"
            found.append(
                f"{shape}, {bound}: the time grows like n to the {slope:.2f} "
                f"from n = {LONG} to {longest}{asked if shape == UNFOLDED else ''}"
            )
    return found


def draw_magnets(rows: list[Row]) -> Any:
    """Time of all magnet forces against the length, log against log."""
    figure, (axis,) = plotting.panels(1, "All magnet forces of a chain", width=7.5, height=5.0)
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
