"""Draw how the time of an evaluation grows with the length of the chain."""

from __future__ import annotations

from typing import Any

from magfold_env.benchmarks.dynamics.chain_contenders import LANES, SCALAR
from magfold_env.benchmarks.dynamics.chain_scaling import OVERHEAD
from magfold_env.reporting.part import Row

# Okabe and Ito's colours, which all kinds of sight tell apart.
COLOURS = ("#0072b2", "#56b4e9", "#d55e00", "#009e73", "#cc79a7")
MARKERS = "osD^v"


def draw_scaling(rows: list[Row], figure: Any) -> None:
    """Draw the rows of `chain_scaling.run` into an empty matplotlib figure, log against log."""
    axis = figure.add_subplot()
    # What a call costs is measured at one length only.
    names = dict.fromkeys(str(row["contender"]) for row in rows if row["contender"] != OVERHEAD)
    for name, colour, marker in zip(names, COLOURS, MARKERS, strict=False):
        mine = [row for row in rows if row["contender"] == name]
        n, middle, low, high = (
            [float(row[key]) for row in mine]
            for key in ("n", "time [µs]", "lower quartile [µs]", "upper quartile [µs]")
        )
        axis.loglog(
            n,
            middle,
            color=colour,
            marker=marker,
            markersize=5,
            linewidth=2.2 if name in (SCALAR, LANES) else 1.3,
            label=name,
        )
        axis.fill_between(n, low, high, color=colour, alpha=0.2, linewidth=0)
    axis.set_xlabel("components n")
    axis.set_ylabel("time of one chain's accelerations [µs]")
    axis.set_title("Accelerations of a pinned chain; bands are quartiles", fontsize=11)
    axis.grid(visible=True, which="major", color="#d9dce0", linewidth=0.7)
    axis.spines[["top", "right"]].set_visible(False)
    axis.legend(fontsize=9, frameon=False, loc="upper left")
