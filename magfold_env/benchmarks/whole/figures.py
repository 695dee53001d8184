"""Diagrams of whole runs. Needs matplotlib, from the extra `render`."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from magfold_env.benchmarks.dynamics.contact_scenes import NUDGE
from magfold_env.benchmarks.whole import skipping, work_precision
from magfold_env.benchmarks.whole.skipping import ALLOWED, EVERYTHING, FLOOR, ONE, TOGETHER
from magfold_env.reporting.plotting import (
    COLOURS,
    GRID,
    INK,
    MARKERS,
    Drawing,
    figure_class,
    numbers,
    panels,
)
from magfold_env.reporting.tables import Row

ACROSS = 5  # panels beside each other
TALLEST = 4.0  # [rad] of an error: beyond half a turn all are alike
WIDEST, HIGHEST = 20.0, 100.0  # factors that an axis spans at least, so that its ticks tell
GROUPS = {EVERYTHING: 0, ONE: 1, TOGETHER: 3, FLOOR: 2}  # colours of the bars


def draw_work_precision(rows: list[Row]) -> Any:
    """Error against run time, a panel a scene: first on the way, then at the end."""
    scenes = list(dict.fromkeys(str(row["scene"]) for row in rows))
    lines = -(-len(scenes) // ACROSS)
    figure = figure_class()(figsize=(3.5 * ACROSS, 3.1 * 2 * lines + 0.9), layout="constrained")
    said = f"Whole folds: largest error against run time; below {NUDGE:g} rad errors count as equal"
    figure.suptitle(said, fontsize=15, color=INK)
    halves = figure.subfigures(2, 1, hspace=0.03)
    titles = (
        "largest error of a joint at any time [rad]",
        "largest error of a joint at the end [rad]",
    )
    for half, error, title in zip(halves, work_precision.FRONT, titles, strict=True):
        axes = half.subplots(lines, ACROSS, squeeze=False).ravel()
        half.supylabel(title, fontsize=11, color=INK)
        for axis, scene in zip(axes, scenes, strict=False):
            _panel(axis, [row for row in rows if row["scene"] == scene], error)
            axis.set_title(scene, fontsize=11, color=INK)
        for axis in axes[len(scenes) :]:
            axis.set_visible(False)
    handles: dict[str, Any] = {}
    for axis in figure.axes:
        for handle, label in zip(*axis.get_legend_handles_labels(), strict=True):
            handles.setdefault(label, handle)
    figure.legend(
        list(handles.values()), list(handles), loc="outside lower center",
        ncols=len(handles), frameon=False, fontsize=10,
    )  # fmt: skip
    return figure


def _panel(axis: Any, rows: list[Row], error: str) -> None:
    """Draw a line for each accuracy of the magnets, over tolerances or time steps."""
    axis.grid(visible=True, which="major", color=GRID, linewidth=0.7)
    axis.set_axisbelow(True)
    axis.spines[["top", "right"]].set_visible(False)
    adaptive = [row for row in rows if row["method"] == "adaptive"]
    paper = [row for row in rows if row["method"] == "paper"]
    accuracies = sorted({float(row["magnets"]) for row in adaptive}, reverse=True)
    for k, accuracy in enumerate(accuracies):
        mine = [row for row in adaptive if row["magnets"] == accuracy]
        axis.loglog(
            *_time_and_error(mine, error),
            color=COLOURS[1 + k],
            marker=MARKERS[k],
            markersize=4.5,
            linewidth=1.1,
            label=f"magnets to {accuracy:g}" if accuracy else "no accuracy to choose",
        )
    for accuracy in sorted({float(row["magnets"]) for row in paper}):
        mine = [row for row in paper if row["magnets"] == accuracy]
        axis.loglog(
            *_time_and_error(mine, error), color="#8a8f98", marker="x", markersize=4.5,
            linewidth=0.9, label="the paper's solver",
        )  # fmt: skip
    marked = sorted(
        (row for row in rows if row[work_precision.FRONT[error]]),
        key=lambda row: float(row["time [ms]"]),
    )
    axis.step(
        *_time_and_error(marked, error), where="post", color=INK, linewidth=2.6, alpha=0.3,
        label="Pareto front", zorder=1,
    )  # fmt: skip
    default = [row for row in rows if row["default"]]
    axis.loglog(
        *_time_and_error(default, error), color="#d0021b", marker="*", markersize=15,
        markeredgecolor="white", linestyle="", label="the default", zorder=5,
    )  # fmt: skip
    axis.set_xlabel("run time [ms]", fontsize=9)
    axis.set_xlim(*_at_least(WIDEST, numbers(rows, "time [ms]")))
    axis.set_ylim(*_at_least(HIGHEST, np.minimum(numbers(rows, error), TALLEST)))
    axis.tick_params(labelsize=8)
    for which in (axis.xaxis, axis.yaxis):
        which.set_minor_formatter("")
    axis.xaxis.set_major_formatter("{x:g}")


def _at_least(factor: float, values: Any) -> tuple[float, float]:
    """Return limits around some values that are at least a factor apart."""
    low, high = float(values.min()), float(values.max())
    middle, reach = math.sqrt(low * high), max(math.sqrt(high / low) * 1.3, math.sqrt(factor))
    return middle / reach, middle * reach


def _time_and_error(rows: list[Row], error: str) -> tuple[Any, Any]:
    """Return times [ms] and errors [rad]."""
    return numbers(rows, "time [ms]"), np.minimum(numbers(rows, error), TALLEST)


def draw_skipping(rows: list[Row]) -> Any:
    """Bars of the time an evaluation takes, over the floor's, on a logarithmic scale."""
    figure, axes = panels(
        1, "What a scene does not need: time an evaluation over a bare pendulum's", 9.5, 5.4
    )
    axis = axes[0]
    place = np.arange(len(rows))
    over = numbers(rows, "over the floor")
    spread = np.stack(
        [
            over - numbers(rows, "over the floor, lower quartile"),
            numbers(rows, "over the floor, upper quartile") - over,
        ]
    )
    for group, colour in GROUPS.items():
        mine = [k for k, row in enumerate(rows) if row["group"] == group]
        axis.barh(
            place[mine], over[mine], xerr=spread[:, mine], color=COLOURS[colour], height=0.65,
            ecolor=INK, error_kw={"linewidth": 1.0}, label=group,
        )  # fmt: skip
    for y, row, value, high in zip(place, rows, over, over + spread[1], strict=True):
        text = f"  {value:.3g} × : {float(row['each [µs]']):.3g} µs × {row['evaluations']}"
        label = axis.text(max(value, high) * 1.03, y, text, va="center", fontsize=8, color=INK)
        # Where the dashed line would cross it.
        label.set_bbox({"facecolor": "white", "edgecolor": "none", "pad": 0.5})
    axis.axvline(ALLOWED, color=INK, linestyle="--", linewidth=1.0)
    axis.set_xscale("log")
    axis.set_xlim(0.8, 8.0 * float(over.max()))
    axis.set_yticks(place, [str(row["off"]) for row in rows])
    axis.invert_yaxis()
    axis.set_xlabel(f"times the floor; the dashed line, {ALLOWED:g}, is asked for of a bare scene")
    axis.grid(visible=False, axis="y")
    axis.legend(fontsize=9, frameon=False, loc="lower right")
    return figure


DRAWINGS: dict[str, Drawing] = {
    work_precision.NAME: draw_work_precision,
    skipping.NAME: draw_skipping,
}
