"""What expanding far casings saves, and what it costs in error, by order and radius.

Beyond a radius casings, and segments of the chain, act on each other by multipoles up to an order;
segments by octupoles at most. The engine's own far fields begin at one radius for casings and, over
the number of their components, at another one for segments.
Poles are random, where much cancels, or alike in all components, where moments of segments add up.
The error is the largest of a force, or of a torque over the side, beside the same sums without a
far field, all with nodes enough for `EXACT`: what is left is the far field's own. Times are those
of the nodes that the engine takes under each of its bounds, where near casings cost less. All
pairs are summed or expanded: nothing is looked up or kept.
"""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from magfold_bench.magnets import samples
from magfold_bench.magnets.accuracy import FLUSH, SMALLEST
from magfold_bench.magnets.samples import Sample, Sums
from magfold_bench.presentation import panels_by
from magfold_env.reporting import plotting, tables, timing
from magfold_env.reporting.tables import Measurement, Progress, Row, Table, Tick
from magfold_env.scene import Magnets
from magfold_env.shapes import centres
from magfold_env.simulation.quadrature import Rule, choose_rule

EXACT = 1e-6  # bound under whose nodes the far field's errors are found
ORDERS = {
    1: "dipoles",
    2: "quadrupoles",
    3: "octupoles",
    5: "order 5",
    6: "order 6",
    7: "order 7",
}
NONE = 0  # the order of sums without a far field
ALIKE = ("NSSN", "NNSS", "NSNS", "NNNN")  # dipoles along and across the chain, and none
SEED = 5
BOUND, TIME, RADIUS = "nodes of accuracy", "time [µs]", "radius [diagonals]"
FAR_FIELD = ("order", RADIUS, "segments' radius [diagonals]")
"""Columns that say which far field a row is of."""


def own_rule(bound: float) -> Rule:
    """Return what the engine chooses under a bound."""
    return choose_rule(Magnets(accuracy=bound))


class Setting(NamedTuple):
    """A far field: its order, and from which distances on it acts [diagonals]."""

    order: int
    radius: float
    groups: float  # of segments, over the number of their components

    @classmethod
    def of(cls, rule: Rule) -> Setting:
        """Return that of a rule."""
        return cls(rule.far_order, rule.far, rule.groups)


NO_FIELD = Setting(NONE, math.inf, math.inf)


class Effort(NamedTuple):
    """How much work a run of the benchmark may be."""

    lengths: tuple[int, ...]
    states: int  # chains of random poles at every length, besides those of `ALIKE`
    bounds: tuple[float, ...]
    others: tuple[float, ...]  # radii beside those of the bounds; 4/3 is the least for segments
    rounds: int  # samples of every timing

    @property
    def settings(self) -> list[Setting]:
        """What is to be measured, the engine's own among it."""
        alike = [Setting(order, radius, radius) for order in ORDERS for radius in self.others]
        return [*alike, *(Setting.of(own_rule(bound)) for bound in self.bounds)]


QUICK = Effort((60,), 1, (1e-3,), (4.0,), 2)
FULL = Effort((60, 450), 3, (1e-2, 1e-3, 1e-4), (1.4, 2.35, 4.0, 6.0), 5)


def run(quick: bool, progress: Progress) -> Measurement:
    """Measure every order and radius on unfolded and folded chains."""
    effort = QUICK if quick else FULL
    found = Measurement()
    for (n, shape), tick in samples.each_chain(progress, effort.lengths):
        rows = _measure(n, shape, effort, tick)
        found.rows.extend(rows)
        found.tables.append(_table(n, shape, rows))
        found.findings.extend(_findings(n, shape, effort, rows))
    return found


def states_of(n: int, shape: str, count: int) -> Sample:
    """Return chains in one shape and what they feel without a far field.

    So many have random poles; those of `ALIKE` follow.
    """
    rng = np.random.default_rng(SEED)
    scenes = [samples.random_scene(rng, n) for _ in range(count)]
    scenes += [scenes[0].replace(sequence=(faces,) * n) for faces in ALIKE]
    headings = np.tile(samples.shapes(n)[shape], (len(scenes), 1))
    places = centres(headings, scenes[0].casing.side)
    bare = Sample(scenes, places, headings, samples.new_loads(*headings.shape))
    return replace(bare, exact=_sums(bare, EXACT, NO_FIELD).loads())


def errors_of(sample: Sample, settings: list[Setting]) -> dict[Setting, float]:
    """Worst errors of far fields alone in flush forces."""
    return {
        setting: float(sample.errors(_sums(sample, EXACT, setting).loads()).max())
        for setting in settings
    }


def _sums(sample: Sample, bound: float, setting: Setting) -> Sums:
    """Return sums with the nodes of a bound and another far field."""
    order, radius, groups = setting
    rule = replace(own_rule(bound), far=radius, far_order=order, groups=groups)
    return Sums(sample, Magnets(accuracy=bound), rule)


def _measure(n: int, shape: str, effort: Effort, tick: Tick) -> list[Row]:
    """Rows of one chain: all settings with the nodes of every bound."""
    sample = states_of(n, shape, effort.states)
    errors = {NO_FIELD: 0.0, **errors_of(sample, effort.settings)}
    sums = {key: _sums(sample.first, *key) for key in product(effort.bounds, errors)}
    times = samples.time_each(sums, effort.rounds, tick)
    return [
        {
            "n": n,
            "shape": shape,
            BOUND: bound,
            **dict(zip(FAR_FIELD, setting, strict=True)),
            "error": errors[setting],
            **time.spread.time_cells("µs", 1e6),
            **timing.ratio(times[bound, NO_FIELD], time).cells("times faster"),
        }
        for (bound, setting), time in times.items()
    ]


def fastest(rows: list[Row], bound: float) -> dict[int, Row]:
    """Return the fastest row of every order whose far field errs by no more than a bound.

    With the nodes of that bound; orders that err by more at all radii are left out.
    """
    best: dict[int, Row] = {}
    for row in sorted(tables.select(rows, {BOUND: bound}), key=_time):
        if row["order"] != NONE and float(row["error"]) <= bound:
            best.setdefault(int(row["order"]), row)
    return best


def _time(row: Row) -> float:
    return float(row[TIME])


def _setting(row: Row) -> Setting:
    """Far field of a row."""
    order, *radii = (row[name] for name in FAR_FIELD)
    return Setting(int(order), *map(float, radii))


def _table(n: int, shape: str, rows: list[Row]) -> Table:
    """Return errors by order and radius [diagonals], and times with the nodes of each bound."""
    shown: list[Row] = []
    for setting in dict.fromkeys(map(_setting, rows)):
        mine = [row for row in rows if _setting(row) == setting]
        line: Row = {
            "far field": ORDERS.get(setting.order, "none"),
            "beyond": setting.radius,
            "segments": setting.groups,
            "its error": mine[0]["error"],
        }
        line |= {f"µs, {row[BOUND]:g}": row[TIME] for row in mine}
        line |= {f"times faster, {row[BOUND]:g}": row["times faster"] for row in mine}
        shown.append(line)
    return Table(f"Far field of {n} components, {shape}: errors in flush forces", shown)


def _findings(n: int, shape: str, effort: Effort, rows: list[Row]) -> list[str]:
    """Say what the engine's own far field does under every bound, and which order is fastest."""
    gains: list[str] = []
    found: list[str] = []
    for bound in effort.bounds:
        own = Setting.of(own_rule(bound))
        row = next(row for row in tables.select(rows, {BOUND: bound}) if _setting(row) == own)
        gains.append(
            f"{float(row['times faster']):.3g}-fold at {bound:g} "
            f"(error {float(row['error']) / bound:.0%} of the bound)"
        )
        best = sorted(fastest(rows, bound).values(), key=_time)
        orders = [
            f"{ORDERS[int(row['order'])]} beyond {row[RADIUS]:g} {_time(row) / _time(best[0]):.2f}"
            for row in best
        ]
        found.append(
            f"n = {n}, {shape}: times of the fastest far fields that err by at most {bound:g}, "
            f"over the shortest: {', '.join(orders) or 'none does'}"
        )
    return [
        f"n = {n}, {shape}: the engine's far field is a gain in time of {', '.join(gains)}",
        *found,
    ]


def draw(rows: list[Row]) -> Any:
    """Error of the far field against time: a panel a chain, colours are orders, marks radii.

    Times are those with the nodes of the middle bound.
    """
    bounds = sorted(tables.distinct(rows, BOUND))
    bound = bounds[len(bounds) // 2]
    rows = [row | {"drawn": max(float(row["error"]), SMALLEST)} for row in rows]
    title = f"Far field: its error against time, with the nodes of accuracy {bound:g}"
    labels = "time of an evaluation [µs]", f"worst error /\n{FLUSH}"
    timed = tables.select(rows, {BOUND: bound})
    fields = [row for row in timed if row["order"] != NONE]
    marks = dict(zip(sorted(tables.distinct(fields, RADIUS)), plotting.MARKERS, strict=False))
    figure, panels = panels_by(timed, ("n", "shape"), title, labels, shared=False)
    for axis, here in panels:
        for k, (order, name) in enumerate(ORDERS.items()):
            mine = sorted(tables.select(here, order=order), key=lambda row: float(row[RADIUS]))
            colour = plotting.COLOURS[k + 1]
            across, up = plotting.curve(
                axis, mine, TIME, "drawn", k, color=colour, label=name, marker=""
            )
            for row, *point in zip(mine, across, up, strict=True):
                axis.plot(*point, color=colour, marker=marks[row[RADIUS]], markersize=6)
        axis.axvline(
            _time(tables.select(here, order=NONE)[0]),
            color=plotting.INK,
            linewidth=1.0,
            linestyle="--",
            label="without a far field",
        )
        plotting.plain_ticks(axis.xaxis)
    for radius, mark in marks.items():
        style = {"color": plotting.INK, "marker": mark, "linestyle": "", "markersize": 6}
        panels[0][0].plot([], [], label=f"beyond {radius:g} diagonals", **style)
    plotting.legend_below(figure, panels[0][0], ncols=4)
    return figure
