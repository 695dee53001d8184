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
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from magfold_env.benchmarks.magnets.casings import Sample, Sums
from magfold_env.benchmarks.magnets.poses import random_scene
from magfold_env.benchmarks.magnets.scaling import FOLDED, UNFOLDED, shapes
from magfold_env.reporting.tables import Measurement, Progress, Row, Table, Tick, begin_case
from magfold_env.reporting.timing import Task, Timing, ratio, take_turns
from magfold_env.scene import Magnets
from magfold_env.shapes import centres
from magfold_env.simulation.quadrature import Rule, choose_rule

NAME = "far"
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


def own_rule(bound: float) -> Rule:
    """Return what the engine chooses under a bound."""
    return choose_rule(Magnets(accuracy=bound))


class Setting(NamedTuple):
    """A far field: its order, and from which distances on it acts [diagonals]."""

    order: int
    radius: float
    groups: float
    """Of segments, over the number of their components."""

    @classmethod
    def of(cls, rule: Rule) -> Setting:
        """Return that of a rule."""
        return cls(rule.far_order, rule.far, rule.groups)


NO_FIELD = Setting(NONE, math.inf, math.inf)


@dataclass(frozen=True)
class Effort:
    """How much work a run of the benchmark may be."""

    lengths: tuple[int, ...]
    states: int
    """Chains of random poles at every length, besides those of `ALIKE`."""
    bounds: tuple[float, ...]
    others: tuple[float, ...]
    """Radii beside those of the bounds [diagonals]; 4/3 is the least that segments allow."""
    rounds: int
    """Samples of every timing."""

    @classmethod
    def of(cls, quick: bool) -> Effort:
        """Return the effort of a quick or a full run."""
        if quick:
            return cls((60,), 1, (1e-3,), (4.0,), 2)
        return cls((60, 450), 3, (1e-2, 1e-3, 1e-4), (1.4, 2.35, 4.0, 6.0), 5)

    @property
    def settings(self) -> list[Setting]:
        """What is to be measured, the engine's own among it."""
        alike = [Setting(order, radius, radius) for order in ORDERS for radius in self.others]
        return [*alike, *(Setting.of(own_rule(bound)) for bound in self.bounds)]


def run(quick: bool, progress: Progress) -> Measurement:
    """Measure every order and radius on unfolded and folded chains."""
    effort = Effort.of(quick)
    part = Measurement(NAME, [])
    cases = [(n, shape) for n in effort.lengths for shape in (UNFOLDED, FOLDED)]
    for k, (n, shape) in enumerate(cases):
        tick = begin_case(progress, k, len(cases), f"n = {n}, {shape}")
        rows = _measure(n, shape, effort, tick)
        part.rows.extend(rows)
        part.tables.append(_table(n, shape, rows))
        part.findings.extend(_findings(n, shape, effort, rows))
    return part


def states_of(n: int, shape: str, count: int) -> Sample:
    """Return chains in one shape and what they feel without a far field.

    So many have random poles; those of `ALIKE` follow.
    """
    rng = np.random.default_rng(SEED)
    scenes = [random_scene(rng, n) for _ in range(count)]
    scenes += [scenes[0].replace(sequence=(faces,) * n) for faces in ALIKE]
    headings = np.tile(shapes(n)[shape], (len(scenes), 1))
    places = centres(headings, scenes[0].casing.side)
    bare = Sample(scenes, places, headings, np.zeros_like(places), np.zeros_like(headings))
    loads = _sums(bare, EXACT, NO_FIELD).loads()
    return replace(bare, force=np.stack([loads.fx, loads.fy], axis=2), torque=loads.torque)


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
    keys = [(bound, setting) for bound in effort.bounds for setting in errors]
    sums = {key: _sums(sample.first, *key) for key in keys}
    tasks: dict[str, Task] = {str(key): _task(each) for key, each in sums.items()}
    taken = take_turns(tasks, effort.rounds, tick=tick)
    times = {key: Timing(taken[str(key)].samples / sums[key].evaluations) for key in keys}
    rows: list[Row] = []
    for bound, setting in keys:
        spread = times[bound, setting].spread
        faster = ratio(times[bound, NO_FIELD], times[bound, setting])
        rows.append(
            {
                "n": n,
                "shape": shape,
                "nodes of accuracy": bound,
                "order": setting.order,
                "radius [diagonals]": setting.radius,
                "segments' radius [diagonals]": setting.groups,
                "error": errors[setting],
                **spread.time_cells("µs", 1e6),
                "times faster": faster.median,
                "times faster, lower quartile": faster.low,
                "times faster, upper quartile": faster.high,
            }
        )
    return rows


def _task(sums: Sums) -> Task:
    return lambda: sums.work


def fastest(rows: list[Row], bound: float) -> dict[int, Row]:
    """Return the fastest row of every order whose far field errs by no more than a bound.

    With the nodes of that bound; orders that err by more at all radii are left out.
    """
    best: dict[int, Row] = {}
    for row in rows:
        order = int(row["order"])
        if order == NONE or row["nodes of accuracy"] != bound or float(row["error"]) > bound:
            continue
        if order not in best or _time(row) < _time(best[order]):
            best[order] = row
    return best


def _table(n: int, shape: str, rows: list[Row]) -> Table:
    """Return errors by order and radius [diagonals], and times with the nodes of each bound."""
    shown: list[Row] = []
    for setting in dict.fromkeys(_setting(row) for row in rows):
        mine = [row for row in rows if _setting(row) == setting]
        line: Row = {
            "far field": ORDERS.get(setting.order, "none"),
            "beyond": setting.radius,
            "segments": setting.groups,
            "its error": mine[0]["error"],
        }
        for row in mine:
            line[f"µs, {row['nodes of accuracy']:g}"] = row["time [µs]"]
        for row in mine:
            line[f"times faster, {row['nodes of accuracy']:g}"] = row["times faster"]
        shown.append(line)
    return Table(f"Far field of {n} components, {shape}: errors in flush forces", shown)


def _findings(n: int, shape: str, effort: Effort, rows: list[Row]) -> list[str]:
    """Say what the engine's own far field does under every bound, and which order is fastest."""
    gains: list[str] = []
    found: list[str] = []
    for bound in effort.bounds:
        own = Setting.of(own_rule(bound))
        row = next(
            row for row in rows if _setting(row) == own and row["nodes of accuracy"] == bound
        )
        gains.append(
            f"{float(row['times faster']):.3g}-fold at {bound:g} "
            f"(error {float(row['error']) / bound:.0%} of the bound)"
        )
        best = sorted(fastest(rows, bound).values(), key=_time)
        orders = [
            f"{ORDERS[int(row['order'])]} beyond {row['radius [diagonals]']:g}"
            f" {_time(row) / _time(best[0]):.2f}"
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


def _time(row: Row) -> float:
    return float(row["time [µs]"])


def _setting(row: Row) -> Setting:
    """Far field of a row."""
    radii = (float(row[name]) for name in ("radius [diagonals]", "segments' radius [diagonals]"))
    return Setting(int(row["order"]), *radii)
