"""Diagrams of the dynamics benchmark. Needs matplotlib, from the extra `render`."""

from __future__ import annotations

from typing import Any

import numpy as np

from magfold_env.benchmarks.dynamics.cases import ENGINE
from magfold_env.benchmarks.dynamics.contact_scenes import METHODS, clear
from magfold_env.laws import pinned_chain
from magfold_env.reporting.plotting import (
    COLOURS,
    INK,
    MARKERS,
    Drawing,
    numbers,
    panels,
)
from magfold_env.reporting.tables import Row


def draw_smooth(rows: list[Row]) -> Any:
    """Work-precision diagrams: error against run time, a panel a problem."""
    problems = list(dict.fromkeys(str(row["problem"]) for row in rows))
    methods = list(dict.fromkeys(str(row["method"]) for row in rows))
    figure, axes = panels(len(problems), "Smooth motion: error against run time")
    for axis, problem in zip(axes, problems, strict=True):
        for k, method in enumerate(methods):
            mine = [r for r in rows if (r["problem"], r["method"]) == (problem, method)]
            time = numbers(mine, "time [µs]") - numbers(mine, "call overhead [µs]")
            axis.loglog(
                1e-6 * np.maximum(time, 1.0),
                numbers(mine, "error [rad]"),
                color=COLOURS[k % len(COLOURS)],
                marker=MARKERS[k % len(MARKERS)],
                markersize=5,
                linewidth=2.2 if method == ENGINE else 1.3,
                zorder=3 if method == ENGINE else 2,
                label=method,
            )
        axis.set_title(problem, fontsize=11)
        axis.set_xlabel("run time, calls' overhead off [s]")
        axis.tick_params(axis="x", which="minor", labelbottom=False)
        axis.set_ylim(1e-12, 2.0)
    axes[0].set_ylabel("largest error of a heading [rad]")
    axes[0].legend(fontsize=9, frameon=False, loc="lower left")
    return figure


def draw_contact(rows: list[Row]) -> Any:
    """Error on the way against run time, a panel a kind of scene; thin lines are single scenes.

    Scenes that are set aside are left out, if any other is left.
    """
    rows = clear(rows) or rows
    kinds = list(dict.fromkeys(str(row["kind"]) for row in rows))
    figure, axes = panels(len(kinds), "Folds with contact: error on the way against run time")
    for axis, kind in zip(axes, kinds, strict=True):
        for k, method in enumerate(METHODS):
            mine = [r for r in rows if (r["kind"], r["method"]) == (kind, method)]
            for scene in dict.fromkeys(str(r["scene"]) for r in mine):
                one = [r for r in mine if r["scene"] == scene]
                axis.loglog(*_time_and_error(one), color=COLOURS[k + 1], linewidth=0.7, alpha=0.45)
            tolerances = sorted({float(r["tolerance [rad]"]) for r in mine}, reverse=True)
            groups = [[r for r in mine if r["tolerance [rad]"] == t] for t in tolerances]
            middle = np.array([np.median(_time_and_error(g), axis=1) for g in groups]).T
            axis.loglog(
                *middle,
                color=COLOURS[k + 1],
                marker=MARKERS[k],
                markersize=6,
                linewidth=2.2,
                label=method,
            )
            for x, y, tolerance in zip(*middle, tolerances, strict=True):
                axis.annotate(
                    f"{tolerance:g}",
                    (x, y),
                    (-6, -4) if k == 0 else (6, 4),
                    textcoords="offset points",
                    ha="right" if k == 0 else "left",
                    va="top" if k == 0 else "bottom",
                    fontsize=8,
                    color=COLOURS[k + 1],
                )
        axis.set_title(kind, fontsize=11)
        axis.set_xlabel("run time [s]")
        axis.tick_params(axis="x", which="minor", labelbottom=False)
    axes[0].set_ylabel("largest error of a relative angle at any time [rad]")
    axes[0].legend(
        fontsize=9, frameon=False, loc="lower right", title_fontsize=8,
        title="medians over scenes, by tolerance [rad]",
    )  # fmt: skip
    return figure


def draw_features(rows: list[Row]) -> Any:
    """Bars of the time an evaluation takes in a run, by what it is spent on."""
    figure, axes = panels(1, "Cost of an evaluation by feature", width=9.5, height=5.2)
    axis = axes[0]
    place = np.arange(len(rows))
    total = numbers(rows, "run / evaluations [µs]")
    left = np.zeros(len(rows))
    labels = {
        "chain [%]": "chain",
        "forces [%]": "magnets, sliding friction",
        "rest [%]": "contact, rest, stepping, calls",
    }
    for k, (column, label) in enumerate(labels.items()):
        width = total * np.clip(numbers(rows, column), 0.0, 100.0) / 100.0
        axis.barh(place, width, left=left, color=COLOURS[(1, 5, 3)[k]], label=label, height=0.65)
        left += width
    for y, value, row in zip(place, total, rows, strict=True):
        per_run = float(row["run [µs]"]) / 1e3
        text = f" {value:.3g} µs × {float(row['evaluations']):.0f} = {per_run:.3g} ms"
        axis.text(max(left[y], value), y, text, va="center", fontsize=8, color=INK)
    axis.set_yticks(place, [str(row["features"]) for row in rows])
    axis.invert_yaxis()
    axis.set_xlim(0.0, 1.4 * float(total.max()))
    axis.set_xlabel("run time / evaluations [µs]; at the bar: × evaluations = a run")
    axis.grid(visible=False, axis="y")
    axis.legend(fontsize=9, frameon=False, loc="upper right")
    return figure


DRAWINGS: dict[str, Drawing] = {
    "scaling": pinned_chain.draw,
    "smooth": draw_smooth,
    "contact": draw_contact,
    "features": draw_features,
}


def _time_and_error(rows: list[Row]) -> Any:
    """Return times [s] and errors [rad], shape (2, k)."""
    return np.stack([1e-3 * numbers(rows, "time [ms]"), numbers(rows, "error [rad]")])
