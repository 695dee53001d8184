"""What the benchmarks' diagrams share. Needs matplotlib, from the extra `render`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from magfold_env.reporting.part import Part, Row
from magfold_env.reporting.plotting import COLOURS, GRID, INK, figure_class, save_figure

__all__ = [
    "COLOURS",
    "GRID",
    "INK",
    "MARKERS",
    "Drawing",
    "draw",
    "figure_class",
    "numbers",
    "panels",
]

MARKERS = ("o", "s", "^", "D", "v", "P", "X")

Drawing = Callable[[list[Row]], Any]
"""Turns the rows of a part into a matplotlib figure."""


def draw(part: Part, drawings: Mapping[str, Drawing], folder: Path) -> list[Path]:
    """Draw a part's diagram, if it has one, and return the files written."""
    drawing = drawings.get(part.name)
    if drawing is None or not part.rows:
        return []
    path = folder / f"{part.name}.png"
    save_figure(drawing(part.rows), path)
    return [path]


def panels(
    count: int, title: str, width: float = 5.2, height: float = 4.6, *, shared: bool = True
) -> tuple[Any, Any]:
    """Return a figure and its axes side by side, with the same limits if ``shared``."""
    figure = figure_class()(figsize=(width * count, height), layout="constrained")
    figure.suptitle(title, fontsize=13, color=INK)
    axes = figure.subplots(1, count, squeeze=False, sharex=shared, sharey=shared)[0]
    for axis in axes:
        axis.grid(visible=True, which="major", color=GRID, linewidth=0.7)
        axis.set_axisbelow(True)
        axis.spines[["top", "right"]].set_visible(False)
    return figure, axes


def numbers(rows: list[Row], name: str) -> Any:
    """Return a column of numbers."""
    return np.array([float(row[name]) for row in rows])
