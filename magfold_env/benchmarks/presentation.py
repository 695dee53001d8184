"""What tables and diagrams of several parts have in common."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from magfold_env.reporting import plotting, tables
from magfold_env.reporting.tables import Row


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
        found.append((axis, tables.select(rows, cells)))
    axes[0].set_ylabel(labels[1])
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
