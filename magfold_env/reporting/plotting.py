"""Common parts of diagrams. They need matplotlib, from the extra `render`."""

import importlib
import math
from pathlib import Path
from typing import Any

from magfold_env.files import pip_install, replacing

DPI = 130
WIDEST = 10.5
"""Largest width of a figure [inch]; its text stays readable when a narrow page shrinks it."""
INK, GRID = "#26292e", "#d9dce0"
# Okabe and Ito's colours, distinguishable with all kinds of colour vision.
COLOURS = ("#000000", "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
MARKERS = ("o", "s", "^", "D", "v", "P", "X")


def figure_class() -> Any:
    """Return matplotlib's class of figures that need no display.

    Raises
    ------
    ImportError
        If matplotlib is not installed.
    """
    try:
        return importlib.import_module("matplotlib.figure").Figure
    except ImportError as error:
        msg = f"diagrams need matplotlib: install the extra, {pip_install('render')}"
        raise ImportError(msg) from error


def patch(shape: str, *place: Any, **options: Any) -> Any:
    """Return a matplotlib patch, such as a Polygon or a Circle."""
    return getattr(importlib.import_module("matplotlib.patches"), shape)(*place, **options)


def save_figure(figure: Any, path: str | Path) -> None:
    """Write a figure in the format of the path's suffix, through a temporary file."""
    with replacing(path) as temporary:
        figure.savefig(temporary, dpi=DPI, facecolor="white")


def panels(
    count: int,
    title: str,
    width: float = 5.2,
    height: float = 4.6,
    *,
    shared: bool = True,
) -> tuple[Any, Any]:
    """Return a figure and ``count`` axes, row by row, with the same limits if ``shared``.

    ``width`` and ``height`` are those of one panel [inch]. A row is no wider than `WIDEST`.
    """
    rows = math.ceil(count / max(1, int(WIDEST / width)))
    columns = math.ceil(count / rows)
    figure = figure_class()(figsize=(width * columns, height * rows), layout="constrained")
    figure.suptitle(title, fontsize=13, color=INK)
    axes = figure.subplots(rows, columns, squeeze=False, sharex=shared, sharey=shared).ravel()
    for axis in axes[count:]:
        axis.remove()
    for axis in axes[:count]:
        axis.grid(visible=True, which="major", color=GRID, linewidth=0.7)
        axis.set_axisbelow(True)
        axis.spines[["top", "right"]].set_visible(False)
        axis.tick_params(labelbottom=True)  # also below an incomplete last row
    return figure, axes[:count]


def legend_below(figure: Any, *axes: Any, **options: Any) -> None:
    """Add a legend with the entries of all ``axes`` below the panels."""
    handles: dict[str, Any] = {}
    for axis in axes:
        for handle, label in zip(*axis.get_legend_handles_labels(), strict=True):
            handles.setdefault(label, handle)
    style = {"fontsize": 9, "frameon": False, "ncols": len(handles), **options}
    figure.legend(list(handles.values()), list(handles), loc="outside lower center", **style)
