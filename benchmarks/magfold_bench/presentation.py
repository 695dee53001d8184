"""What is said about the benchmarks and their parts, and what several show in the same way."""

import tomllib
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from magfold_env.reporting import plotting, tables
from magfold_env.reporting.tables import Row


class Description(NamedTuple):
    """One part in plain words: a title, and some sentences to each question."""

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


def panels_by(
    rows: Sequence[Row],
    columns: Sequence[str],
    title: str,
    labels: tuple[str, str],
    size: tuple[float, float] = (5.2, 4.6),
    *,
    shared: bool = True,
) -> tuple[Any, list[tuple[Any, list[Row]]]]:
    """Return a figure, and its axes with the rows that belong there.

    There is a panel for all rows that are alike in some columns, under the name of what they share.

    Parameters
    ----------
    labels
        Of the axes: x, then y.
    size
        Width and height of a panel [inches].
    shared
        Whether all panels have the same limits.
    """
    groups = list(dict.fromkeys(tuple(row[name] for name in columns) for row in rows))
    figure, axes = plotting.panels(len(groups), title, *size, shared=shared)
    found: list[tuple[Any, list[Row]]] = []
    for axis, group in zip(axes, groups, strict=True):
        cells = dict(zip(columns, group, strict=True))
        named = [f"n = {cell}" if name == "n" else str(cell) for name, cell in cells.items()]
        axis.set_title(", ".join(named), fontsize=11)
        axis.set_xlabel(labels[0])
        if axis.get_subplotspec().is_first_col():
            axis.set_ylabel(labels[1])
        found.append((axis, tables.select(rows, cells)))
    return figure, found


def name_bars(axis: Any, names: Sequence[str], label: str) -> None:
    """Name horizontal bars, the first one on top, and what their length is."""
    axis.set_yticks(np.arange(len(names)), names)
    axis.invert_yaxis()
    axis.grid(visible=False, axis="y")
    axis.set_xlabel(label)


def quartile_bars(rows: Sequence[Row], middle: str, low: str, high: str) -> Any:
    """Return how far quartiles lie below and above a median, by the names of their columns."""
    median = tables.numbers(rows, middle)
    return np.stack([median - tables.numbers(rows, low), tables.numbers(rows, high) - median])


def median(rows: Sequence[Row], name: str) -> float:
    """Return the median of a column of numbers."""
    return float(np.median(tables.numbers(rows, name)))
