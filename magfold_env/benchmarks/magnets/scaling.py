"""How the time of all magnet forces grows with the length of the chain, and what a pair costs.

Chains are unfolded, folded into a block with every joint a little off its stop, so that nothing
is at rest against its neighbour, or folded with every joint at its stop, where what rigidly joined
components do to each other is kept. Under an error bound far components act on each other in
segments, and time grows little faster than length; a block has more neighbours to sum over. With a
fixed number of nodes every pair is summed and the work is known: it gives the time of a pair of
nodes.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from magfold_env.benchmarks.magnets.chains import Chain, pinned_states
from magfold_env.benchmarks.magnets.poses import folded, random_sequence, unfolded
from magfold_env.engine.state import Array
from magfold_env.laws.exact_magnets import FACES
from magfold_env.reporting.tables import Measurement, Progress, Row, Table, Tick, begin_case
from magfold_env.reporting.timing import take_turns
from magfold_env.scene import Magnets, Scene

NAME = "scaling"
LENGTHS = (2, 6, 20, 60, 200, 450, 1000, 3000, 10_000)
QUICK_LENGTHS = (2, 6, 60, 200)
BOUNDS = (1e-2, 1e-4)
UNFOLDED, FOLDED, AT_STOPS = "unfolded", "folded", "folded, at its stops"
OFF_STOP = 1e-6  # [rad]
LONG, STEEPEST = 60, 1.2
NODES_AT = 60  # components, for the price of a pair of nodes
FIXED = {
    **{f"points, h = {h}": Magnets(model="points", nodes=h) for h in (1, 3, 10, 30)},
    **{f"strips, {h} nodes": Magnets(nodes=h) for h in (1, 3, 8, 16)},
}
SEED = 11


def run(quick: bool, progress: Progress) -> Measurement:
    """Measure all lengths, then the price of a pair of nodes."""
    rows: list[Row] = []
    lengths, rounds = (QUICK_LENGTHS, 2) if quick else (LENGTHS, 7)
    for k, n in enumerate(lengths):
        tick = begin_case(progress, k, len(lengths) + 1, f"n = {n}")
        rows += _measure(n, rounds, tick)
    progress(len(lengths) / (len(lengths) + 1), "pairs of nodes")
    fixed = measure_nodes(NODES_AT, rounds)
    tables = [_table(rows), _node_table(fixed)]
    return Measurement(NAME, [*rows, *fixed], tables, _findings(rows))


def shapes(n: int) -> dict[str, Array]:
    """Return headings (n,) [rad] by the name of the shape."""
    block = folded(n)
    return {
        UNFOLDED: unfolded(n),
        FOLDED: block + OFF_STOP * (np.arange(n) % 2),
        AT_STOPS: block,
    }


def _measure(n: int, rounds: int, tick: Tick) -> list[Row]:
    """Rows of all shapes and accuracies at one length."""
    rng = np.random.default_rng(SEED)
    scene = Scene(sequence=random_sequence(rng, n), magnets=Magnets(), friction=0.0)
    chains: dict[tuple[str, str], Chain] = {}
    for shape, headings in shapes(n).items():
        for bound in BOUNDS:
            changed = scene.replace(magnets={"accuracy": bound})
            states = pinned_states([headings], scene.casing.side)
            chains[shape, _label(bound)] = Chain(changed, states)
    return _time(n, chains, rounds, tick)


def measure_nodes(n: int, rounds: int) -> list[Row]:
    """Rows of an unfolded chain with fixed numbers of nodes: every pair of nodes is summed."""
    rng = np.random.default_rng(SEED)
    scene = Scene(sequence=random_sequence(rng, n), magnets=Magnets(), friction=0.0)
    states = pinned_states([unfolded(n)], scene.casing.side)
    chains = {
        (UNFOLDED, name): Chain(scene.replace(magnets=magnets), states)
        for name, magnets in FIXED.items()
    }
    rows = _time(n, chains, rounds, lambda _: None)
    for row in rows:
        nodes = FIXED[str(row["magnets"])].nodes
        assert nodes is not None
        row["ns a pair of nodes"] = float(row["ns a pair"]) / (FACES * nodes) ** 2
    return rows


def _time(
    n: int,
    chains: dict[tuple[str, str], Chain],
    rounds: int,
    tick: Tick,
) -> list[Row]:
    """Time chains by shape and magnets, in turns."""
    tasks = {f"{shape}; {magnets}": chain.task() for (shape, magnets), chain in chains.items()}
    times = take_turns(tasks, rounds, tick=tick)
    rows: list[Row] = []
    for (shape, magnets), chain in chains.items():
        taken = times[f"{shape}; {magnets}"].spread
        each = 1e6 / chain.evaluations
        rows.append(
            {
                "shape": shape,
                "magnets": magnets,
                "n": n,
                **taken.time_cells("µs", each),
                "ns a pair": 1e3 * each * taken.median / (n * (n - 1) / 2),
                "ns a pair of nodes": float("nan"),
            }
        )
    return rows


def slope(rows: list[Row], shape: str, magnets: str) -> float:
    """Log-log slope of the time against n from `LONG` on, by least squares; nan if too few."""
    chosen = [
        row
        for row in rows
        if (row["shape"], row["magnets"]) == (shape, magnets) and int(row["n"]) >= LONG
    ]
    if len(chosen) < 2:
        return float("nan")
    n, time = (np.log([float(row[key]) for row in chosen]) for key in ("n", "time [µs]"))
    return float(np.polyfit(n, time, 1)[0])


def _label(bound: float) -> str:
    return f"accuracy {bound:g}"


def _table(rows: list[Row]) -> Table:
    """Return the times, a row a length and a column a shape and accuracy."""
    shown: list[Row] = []
    for n in dict.fromkeys(int(row["n"]) for row in rows):
        mine = [row for row in rows if row["n"] == n]
        line: Row = {"n": n}
        for row in mine:
            line[f"{row['shape']}, {row['magnets']}"] = f"{float(row['time [µs]']):.3g}"
        line["µs a component, unfolded"] = float(mine[0]["time [µs]"]) / n
        shown.append(line)
    return Table("All magnet forces of a chain: µs an evaluation", shown)


def _node_table(rows: list[Row]) -> Table:
    keys = ("magnets", "n", "time [µs]", "ns a pair", "ns a pair of nodes")
    shown: list[Row] = [{key: row[key] for key in keys} for row in rows]
    return Table("Fixed numbers of nodes a face: the price of a pair", shown)


def _findings(rows: list[Row]) -> list[str]:
    found: list[str] = []
    longest = max(int(row["n"]) for row in rows)
    for shape, bound in product((UNFOLDED, FOLDED, AT_STOPS), BOUNDS):
        steepness = slope(rows, shape, _label(bound))
        if not np.isfinite(steepness):
            continue
        asked = ""
        if shape == UNFOLDED:
            verdict = "holds" if steepness <= STEEPEST else "FAILS"
            asked = f"; at most {STEEPEST} is asked for: {verdict}"
        found.append(
            f"{shape}, accuracy {bound:g}: the time grows like n to the {steepness:.2f} "
            f"from n = {LONG} to {longest}{asked}"
        )
    return found
