"""What features of real devices cost, and that those a scene does not have cost nothing.

Each is put into the default chain, four equal magnets in every component, one at a time. Times are
of what the dynamics do at one evaluation, in turns with the default chain, which takes part twice
to show the noise.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from magfold_env.benchmarks.magnets import samples
from magfold_env.benchmarks.magnets.samples import AT_STOPS, FOLDED, Chain
from magfold_env.benchmarks.presentation import name_bars
from magfold_env.reporting import plotting, tables, timing
from magfold_env.reporting.tables import Measurement, Progress, Row, Table, Tick
from magfold_env.scene import Scene

LENGTHS, QUICK_LENGTHS = (6, 60), (6,)
DEFAULT, AGAIN = "default chain", "default chain again"
STOPS = "all joints at stops"
COSTLY = ("unequal heights", "unequal sizes", "an even field", "a fixed magnet")  # may take longer
NOISE = 1.05  # a ratio that counts as 1
EMPTY = "-"
FIXED = {
    "position": (0.03, -0.04),
    "heading": 0.7,
    "width": 0.02,
    "height": 0.02,
    "thickness": 0.01,
}
SEED = 13


def run(quick: bool, progress: Progress) -> Measurement:
    """Measure every feature on unfolded and folded chains."""
    lengths, rounds = (QUICK_LENGTHS, 2) if quick else (LENGTHS, 9)
    found = Measurement()
    for (n, shape), tick in samples.each_chain(progress, lengths):
        found.rows.extend(_measure(n, shape, rounds, tick))
    found.tables.extend(_table(n, tables.select(found.rows, n=n)) for n in lengths)
    found.findings.extend(_findings(found.rows))
    return found


def features(n: int) -> dict[str, Scene]:
    """Return the default chain of n components, and with one feature each, by their names."""
    rng = np.random.default_rng(SEED)
    scene = samples.random_scene(rng, n).replace(friction=0.0)
    faces = np.array([list(letters) for letters in scene.sequence])
    gaps = rng.permuted(np.tile(np.arange(4), (n, 1)), axis=1)  # the faces, in any order

    def without(count: int, every: int = 1) -> Scene:
        """Leave out so many faces of every so many-th component."""
        left = faces.copy()
        for i in range(0, n, every):
            left[i, gaps[i, :count]] = EMPTY
        return scene.replace(sequence=tuple("".join(letters) for letters in left))

    heights = (0.004, 0.005, 0.006, 0.007)
    sizes = {
        "height": heights,
        "width": (0.006, 0.005, 0.004, 0.005),
        "thickness": (0.002, 0.0025, 0.0015, 0.002),
        "inset": (0.0005, 0.0006, 0.0008, 0.0005),
    }
    strengths = rng.uniform(0.3, 0.9, (n, 4)).tolist()
    return {
        DEFAULT: scene,
        AGAIN: scene,
        "one face in four empty": without(1),
        "two faces in four empty": without(2),
        "every other component without magnets": without(4, 2),
        "no component with magnets": without(4),
        "no magnets in the scene": scene.replace(magnets=None),
        "unequal strengths": scene.replace(magnets={"remanence": strengths}),
        "unequal heights": scene.replace(magnets={"height": heights}),
        "unequal sizes": scene.replace(magnets=sizes),
        "an even field": scene.replace(field={"uniform": (0.01, 0.02)}),
        "a fixed magnet": scene.replace(field={"magnet": FIXED}),
    }


def _measure(n: int, shape: str, rounds: int, tick: Tick) -> list[Row]:
    """Rows of all features in one shape; joints at their stops belong to the folded one."""
    scenes, headings = features(n), samples.shapes(n)
    chains = {name: Chain.pinned(scene, headings[shape]) for name, scene in scenes.items()}
    if shape == FOLDED:
        chains[STOPS] = Chain.pinned(scenes[DEFAULT], headings[AT_STOPS])
    times = samples.time_each(chains, rounds, tick)
    return [
        {
            "n": n,
            "shape": shape,
            "feature": name,
            **time.spread.time_cells("µs", 1e6),
            **timing.ratio(time, times[DEFAULT]).cells("time / default"),
        }
        for name, time in times.items()
    ]


def _table(n: int, rows: list[Row]) -> Table:
    """Return times and ratios of one length, a row a feature and two columns a shape."""
    lines: dict[str, Row] = {}
    for row in rows:
        line = lines.setdefault(str(row["feature"]), {"feature": row["feature"]})
        for key in ("time [µs]", "time / default"):
            line[f"{row['shape']}: {key}"] = row[key]
    # Not every feature is in both shapes.
    shown: list[Row] = [
        {key: line.get(key, "") for key in lines[DEFAULT]} for line in lines.values()
    ]
    return Table(f"Magnets of {n} components in the dynamics, feature by feature", shown)


def _findings(rows: list[Row]) -> list[str]:
    """Say what each feature costs, and whether those that leave less to do take no longer."""
    found: list[str] = []
    for name in tables.distinct(rows, "feature"):
        if name == DEFAULT:
            continue
        shares = tables.numbers(tables.select(rows, feature=name), "time / default")
        asked = ""
        if name not in COSTLY:
            held = tables.verdict(shares.max() <= NOISE)
            asked = f"; at most 1 is asked for, to within {NOISE - 1.0:.0%}: {held}"
        found.append(
            f"{name}: {shares.min():.2g} to {shares.max():.2g} times as long as the default{asked}"
        )
    return found


def draw(rows: list[Row]) -> Any:
    """Bars of the time over the default chain's, feature by feature, a colour a chain."""
    rows = [row for row in rows if row["feature"] != DEFAULT]
    chains = list(dict.fromkeys((row["n"], row["shape"]) for row in rows))
    names = tables.distinct(rows, "feature")
    figure, axes = plotting.panels(
        1, "Magnets in the dynamics: time over the default chain's", 9.0, 5.0
    )
    axis = axes[0]
    height = 0.8 / len(chains)
    for k, (n, shape) in enumerate(chains):
        mine = tables.select(rows, n=n, shape=shape)
        place = [names.index(str(row["feature"])) + (k + 0.5) * height - 0.4 for row in mine]
        shares = tables.numbers(mine, "time / default")
        axis.barh(
            place, shares, 0.9 * height, color=plotting.COLOURS[k + 1], label=f"n = {n}, {shape}"
        )
    axis.axvline(1.0, color=plotting.INK, linewidth=1.0, linestyle="--")
    name_bars(axis, names, "time / time of the default chain")
    plotting.legend(axis, "upper right")
    return figure
