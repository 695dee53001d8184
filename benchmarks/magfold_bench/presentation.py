"""Descriptions of the benchmarks and their parts, and their common diagrams."""

import importlib
import math
import tomllib
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from magfold_bench import tables
from magfold_bench.tables import Row
from magfold_env.reporting import plotting

DENSE = 20  # lines with more points have no markers
WIDE = 1e3  # axes that span at least this factor label only powers of ten
BESIDE: dict[str, Any] = {"textcoords": "offset points", "xytext": (5, 4), "fontsize": 8}
MANY = 7  # with at least this many panels, each panel is lower


class Description(NamedTuple):
    """Description of a part: a title, and a few sentences on each aspect."""

    title: str
    measured: str  # what was measured
    how: str  # how, and against what
    meaning: str  # what the result means to someone who uses the package
    missing: str  # what it does not cover


class Summary(NamedTuple):
    """One benchmark: what it measures, and its parts by name."""

    measures: str
    parts: dict[str, Description]


@cache
def descriptions() -> dict[str, Summary]:
    """Return all benchmarks by name."""
    text = Path(__file__).with_name("descriptions.toml").read_text(encoding="utf-8")
    return {
        name: Summary(table.pop("measures"), {k: Description(**v) for k, v in table.items()})
        for name, table in tomllib.loads(text).items()
    }


class Lines(NamedTuple):
    """A log-log diagram of rows, and the columns that define its axes, lines and panels."""

    title: str
    x: str
    y: str
    line: str
    panel: tuple[str, ...] = ()
    text: str = ""
    """Column that labels the points."""
    star: str = ""
    """Column that marks a row with a star if it is true."""
    shared: bool = True
    """Whether all panels have the same limits."""
    linear: str = ""
    """Axes that are linear rather than logarithmic: x or xy."""

    def draw(self, rows: list[Row]) -> Any:
        """Return a matplotlib figure, with a panel per set of values in the `panel` columns."""
        groups = list(dict.fromkeys(tuple(row[name] for name in self.panel) for row in rows))
        size = (8.0, 5.0) if len(groups) == 1 else (5.2, 4.6 if len(groups) < MANY else 3.0)
        figure, axes = plotting.panels(len(groups), self.title, *size, shared=self.shared)
        names = tables.distinct(rows, self.line)
        for axis, group in zip(axes, groups, strict=True):
            cells = dict(zip(self.panel, group, strict=True))
            named = [f"n = {cell}" if name == "n" else str(cell) for name, cell in cells.items()]
            axis.set_title(", ".join(named), fontsize=11)
            axis.set_xlabel(self.x)
            axis.set_ylabel(self.y)
            here = tables.select(rows, cells)
            for k, name in enumerate(names):
                mine = tables.select(here, {self.line: name})
                style = {"marker": ""} if len(mine) > DENSE else {}
                points = curve(axis, mine, self.x, self.y, k, label=str(name), **style)
                if self.text:
                    for row, point in zip(mine, zip(*points, strict=True), strict=True):
                        axis.annotate(f"{float(row[self.text]):g}", point, **BESIDE)
            marked = [row for row in here if row.get(self.star)]
            if marked:
                style = {"color": "#d0021b", "marker": "*", "markersize": 14, "linestyle": ""}
                curve(axis, marked, self.x, self.y, 0, label=self.star, **style)
            axis.set(**{f"{axle}scale": "linear" for axle in self.linear})
        for axis in () if self.linear else axes:
            low, high = axis.get_xlim()
            middle = math.sqrt(low * high)  # at least a decade, so that there are enough ticks
            axis.set_xlim(min(low, 0.3 * middle), max(high, middle / 0.3))
            if high < WIDE * low:
                # Label 1, 2 and 5 in every decade, as plain numbers.
                locator = importlib.import_module("matplotlib.ticker").LogLocator(subs=(1, 2, 5))
                axis.xaxis.set_major_locator(locator)
                axis.xaxis.set_major_formatter("{x:,g}")
                axis.xaxis.set_minor_formatter("")
        plotting.legend_below(figure, *axes, ncols=3)
        return figure


def curve(
    axis: Any, rows: Sequence[Row], x: str, y: str, k: int, **options: Any
) -> tuple[Any, Any]:
    """Draw one column against another on log-log axes with the k-th marker; return both columns.

    Options are matplotlib's. If they name no colour, the colour is number k + 1, where 0 is black.
    """
    across, up = tables.numbers(rows, x), tables.numbers(rows, y)
    colour = plotting.COLOURS[(k + 1) % len(plotting.COLOURS)]
    marker = plotting.MARKERS[k % len(plotting.MARKERS)]
    axis.loglog(across, up, **{"color": colour, "marker": marker, "markersize": 5, **options})
    return across, up


def median(rows: Sequence[Row], name: str) -> float:
    """Return the median of a column of numbers."""
    return float(np.median(tables.numbers(rows, name)))
