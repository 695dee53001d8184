"""Bar charts of ensembles: the frequency of each outcome. Needs matplotlib."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from magfold_env.ensembles.releases import Bar, Ensemble, bars
from magfold_env.render.chain import square
from magfold_env.reporting.plotting import COLOURS, GRID, INK, panels, patch, save_figure
from magfold_env.shapes import centres, headings

SLOTS = 6
"""Largest number of outcomes in a panel; if there are more, the rarest share one bar."""

COLOUR_OF = {
    "folded": COLOURS[3],
    "misfolded": COLOURS[2],
    "held": COLOURS[1],
    "jammed": COLOURS[5],
    "unsettled": COLOURS[4],
    "failed": COLOURS[0],
    "others": GRID,
}
"""Colours of the statuses."""
_WIDTH, _ALONE, _HEIGHT = 3.5, 4.6, 3.3  # of a panel [inch]


def draw_ensemble(ensemble: Ensemble, path: str | Path) -> None:
    """Draw the frequency of each word and status, with Wilson intervals, as a PNG.

    Below each bar is the chain of the first run with this outcome, with component 1 filled.
    """
    title = f"{len(ensemble)} releases, {ensemble.scene.mount}"
    save_figure(bar_chart({title: bars(ensemble)}), path)


def bar_chart(charts: Mapping[str, Sequence[Bar]]) -> Any:
    """Return a figure with a panel of bars, most frequent first, for each title, row by row."""
    width = _WIDTH if len(charts) > 1 else _ALONE
    figure, axes = panels(len(charts), "", width, _HEIGHT, shared=False)
    figure.get_layout_engine().set(h_pad=0.12)
    shown = {name: _most(content) for name, content in charts.items()}
    for axis, (name, content) in zip(axes, shown.items(), strict=True):
        _draw_panel(axis, name, content)
    used = {bar.status for content in shown.values() for bar in content}
    handles = [patch("Patch", color=c, label=name) for name, c in COLOUR_OF.items() if name in used]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), frameon=False)
    return figure


def _most(content: Sequence[Bar]) -> list[Bar]:
    """Return at most `SLOTS` bars."""
    if len(content) <= SLOTS:
        return list(content)
    rate = sum(bar.rate for bar in content[SLOTS - 1 :])
    return [*content[: SLOTS - 1], Bar("", "others", rate, math.nan, math.nan, ())]


def _draw_panel(axis: Any, name: str, content: Sequence[Bar]) -> None:
    places, rates = np.arange(len(content)), np.array([bar.rate for bar in content])
    errors = [rates - [bar.low for bar in content], [bar.high for bar in content] - rates]
    axis.bar(places, rates, color=[COLOUR_OF[bar.status] for bar in content], width=0.62)
    axis.errorbar(places, rates, np.maximum(errors, 0.0), fmt="none", ecolor=INK, capsize=3)
    axis.set_title(name, fontsize=10, color=INK)
    axis.set_xlim(-0.5, SLOTS - 0.5)
    axis.set_ylim(0.0, 1.05)
    axis.set_yticks([0.0, 0.5, 1.0], ["0", "50 %", "100 %"])
    axis.set_xticks(places, [_label(bar) for bar in content], fontsize=7)
    axis.tick_params(axis="x", length=0)
    axis.grid(visible=False, axis="x")
    for place, bar in zip(places, content, strict=True):
        if bar.joints:
            corner = ((place + 0.08) / SLOTS, -0.46)
            _draw_outline(axis.inset_axes([*corner, 0.84 / SLOTS, 0.32]), bar)


def _label(bar: Bar) -> str:
    return "others" if bar.status == "others" else bar.word or "(one component)"


def _draw_outline(axis: Any, bar: Bar) -> None:
    """Draw the casings of a chain, turned so that those of a full fold are upright."""
    angles = headings(bar.joints, first=math.pi / 4)
    for k, (middle, angle) in enumerate(zip(centres(angles), angles, strict=True)):
        face = COLOUR_OF[bar.status] if k == 0 else "white"
        corners = square(middle, float(angle), 1.0)
        look = {"facecolor": face, "edgecolor": INK, "linewidth": 0.8, "clip_on": False}
        axis.add_patch(patch("Polygon", corners, **look))
    axis.set_aspect("equal")
    axis.autoscale_view()
    axis.set_axis_off()
