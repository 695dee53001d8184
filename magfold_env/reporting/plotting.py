"""What all diagrams share. Needs matplotlib, from the extra `render`."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from magfold_env.files import replacing
from magfold_env.reporting.tables import Measurement, Row

DPI = 130
INK, GRID = "#26292e", "#d9dce0"
# Okabe and Ito's colours, which all kinds of sight tell apart.
COLOURS = ("#000000", "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")


def figure_class() -> Any:
    """Return matplotlib's figure class, which needs no display.

    Raises
    ------
    ImportError
        If matplotlib is not installed.
    """
    try:
        return importlib.import_module("matplotlib.figure").Figure
    except ImportError as error:
        msg = "diagrams need matplotlib: install the extra, pip install 'magfold_env[render]'"
        raise ImportError(msg) from error


def save_figure(figure: Any, path: str | Path) -> None:
    """Write a figure as PNG, under a temporary name first."""
    with replacing(path) as temporary:
        figure.savefig(temporary, dpi=DPI, facecolor="white")


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


def draw(part: Measurement, drawings: Mapping[str, Drawing], folder: Path) -> list[Path]:
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
