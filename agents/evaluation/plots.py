"""Pictures of a comparison. They need matplotlib, from the extra `render`."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from agents.evaluation.intervals import THRESHOLDS, estimate, profile
from agents.evaluation.methods import Results, by_target, targets_of
from agents.evaluation.reasons import ENDS
from agents.evaluation.report import Summary
from magfold_env.reporting.plotting import COLOURS, GRID, INK, figure_class, save_figure

WIDTH = 9.0
"""Of every picture [inch]."""

_END_COLOURS = dict(zip(ENDS, ("#009e73", "#e69f00", "#d55e00", "#56b4e9", "#26292e"), strict=True))


def draw(folder: Path, results: Results, summaries: Mapping[str, Summary]) -> dict[str, Path]:
    """Write all pictures to `folder`; return their paths, by what they show."""
    pictures = {
        "overall": _overall(summaries),
        "targets": _targets(results, summaries),
        "profile": _profile(results),
        "reasons": _reasons(summaries),
    }
    paths = {name: folder / f"{name}.png" for name in pictures}
    for name, figure in pictures.items():
        save_figure(figure, paths[name])
    return paths


def _overall(summaries: Mapping[str, Summary]) -> Any:
    """Draw mean, middle half and success when built beforehand, with their intervals."""
    figure, ((axes,),) = _figure(0.9 + 0.5 * len(summaries))
    rows = (
        ("success", "fed and chosen at the mouth", "o", COLOURS[1]),
        ("iqm", "the same, middle half of targets and seeds", "D", COLOURS[6]),
        ("built", "same choices, built beforehand", "s", COLOURS[2]),
    )
    for k, (attribute, label, marker, colour) in enumerate(rows):
        shown = [
            (place, found)
            for place, summary in enumerate(summaries.values())
            if (found := getattr(summary, attribute)) is not None
        ]
        if shown:
            places = np.array([place for place, _ in shown]) + 0.22 * (k - 1)
            value, low, high = 100 * np.array([found for _, found in shown], dtype=float).T
            axes.errorbar(
                value, places, xerr=[value - low, high - value], fmt=marker, color=colour,
                markersize=5, capsize=2, linewidth=1.2, label=label,
            )  # fmt: skip
    axes.set_yticks(range(len(summaries)), list(summaries))
    axes.set_ylim(len(summaries) - 0.5, -0.5)
    axes.set_xlim(-2, 102)
    axes.set_xlabel("success [%], with 95 % intervals over seeds and targets")
    axes.grid(axis="x", color=GRID, linewidth=0.8)
    figure.legend(loc="outside upper right", ncols=3, frameon=False, fontsize=8)
    return figure


def _targets(results: Results, summaries: Mapping[str, Summary]) -> Any:
    """Draw bars by target, a row a method; dots are the runs of a method that has several."""
    words = targets_of(results)
    figure, grid = _figure(0.8 + 1.2 * len(results), rows=len(results))
    axes = grid[:, 0]
    places = np.arange(len(words))
    for place, (name, runs) in zip(axes, results.items(), strict=True):
        shares = [summaries[name].targets[word] for word in words]
        rates = 100 * np.array([each.rate for each in shares])
        ends = 100 * np.array([[each.low, each.high] for each in shares]).T
        place.bar(places, rates, color=COLOURS[6], width=0.75)
        error = np.abs(ends - rates)
        place.errorbar(places, rates, yerr=error, fmt="none", ecolor=INK, linewidth=0.9)
        if len(runs) > 1:
            for k, row in enumerate(100 * by_target(runs)):
                shift = 0.5 * (k / (len(runs) - 1) - 0.5)
                place.plot(places + shift, row, ".", color=COLOURS[1], markersize=4, clip_on=False)
        place.set_title(name, loc="left", fontsize=9)
        place.set_ylim(0, 104)
        place.set_yticks([0, 50, 100])
        place.grid(axis="y", color=GRID, linewidth=0.8)
    axes[-1].set_xlim(-0.6, len(words) - 0.4)
    axes[-1].set_xticks(places, words, rotation=90, fontsize=7, family="monospace")
    figure.supylabel("success [%]", fontsize=9)
    return figure


def _profile(results: Results) -> Any:
    """Draw which share of runs on targets succeed more often than τ."""
    figure, ((axes,),) = _figure(3.6)
    for k, (name, runs) in enumerate(results.items()):
        found = estimate(by_target(runs), targets_of(results), profile)
        colour, style = COLOURS[(k + 1) % len(COLOURS)], ("-", "--", ":")[k // len(COLOURS) % 3]
        axes.step(
            100 * THRESHOLDS, 100 * found.value, style, where="post", color=colour, label=name
        )
        axes.fill_between(
            100 * THRESHOLDS, 100 * found.low, 100 * found.high, step="post", color=colour,
            alpha=0.15, linewidth=0,
        )  # fmt: skip
    axes.set_xlim(0, 100)
    axes.set_ylim(-2, 102)
    axes.set_xlabel("τ: rate of success on a target [%]")
    axes.set_ylabel("targets (and seeds) above τ [%]")
    axes.grid(color=GRID, linewidth=0.8)
    figure.legend(loc="outside right upper", frameon=False, fontsize=8)
    return figure


def _reasons(summaries: Mapping[str, Summary]) -> Any:
    """Draw how episodes ended, and which joints stood in the way of those that missed."""
    figure, (axes,) = _figure(1.1 + 0.5 * len(summaries), columns=(2.2, 1, 1))
    left = np.zeros(len(summaries))
    totals = np.array([sum(each.ends.values()) for each in summaries.values()])
    places = np.arange(len(summaries))
    for end in ENDS:
        shares = 100 * np.array([each.ends[end] for each in summaries.values()]) / totals
        axes[0].barh(places, shares, left=left, color=_END_COLOURS[end], label=end, height=0.7)
        left += shares
    axes[0].set_yticks(places, list(summaries))
    axes[0].set_ylim(len(summaries) - 0.5, -0.5)
    axes[0].set_xlim(0, 100)
    axes[0].set_xlabel("episodes [%]")
    for place, kind, title in zip(
        axes[1:], ("open", "wrong"), ("joint left open", "joint folded wrong"), strict=True
    ):
        missed = totals - np.array([each.ends["target"] for each in summaries.values()])
        counts = np.array([each.joints[kind] for each in summaries.values()], dtype=float)
        shares = 100 * counts / np.maximum(missed, 1)[:, None]
        place.imshow(shares, vmin=0, vmax=100, cmap="Oranges", aspect="auto")
        for (row, column), value in np.ndenumerate(shares):
            colour = "white" if value > 60 else INK
            label = f"{value:.0f}" if missed[row] else "–"
            place.text(column, row, label, ha="center", va="center", color=colour,
                       fontsize=7)  # fmt: skip
        place.set_xticks(range(counts.shape[1]), [str(k + 1) for k in range(counts.shape[1])])
        place.set_yticks([])
        place.set_xlabel(f"{title}\n[% of misses]")
    figure.legend(loc="outside upper left", ncols=len(ENDS), frameon=False, fontsize=8)
    return figure


def _figure(height: float, rows: int = 1, columns: tuple[float, ...] = (1,)) -> tuple[Any, Any]:
    """Return a figure and its axes, shape (rows, columns), without frames right and above."""
    figure = figure_class()(figsize=(WIDTH, height), layout="constrained")
    axes = figure.subplots(
        rows, len(columns), sharex=rows > 1, squeeze=False, gridspec_kw={"width_ratios": columns}
    )
    for place in axes.flat:
        place.spines[["top", "right"]].set_visible(False)
        place.tick_params(labelsize=8, colors=INK)
        place.xaxis.label.set_size(9)
        place.yaxis.label.set_size(9)
        place.set_axisbelow(True)
    return figure, axes
