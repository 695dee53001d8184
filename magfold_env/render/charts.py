"""Charts of the frequencies of outcomes in ensembles and sweeps. They need matplotlib."""

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from magfold_env.ensembles.releases import Bar, Ensemble, bars
from magfold_env.ensembles.sweeps import Outcome, Sweep
from magfold_env.render.chain import square
from magfold_env.reporting import plotting
from magfold_env.shapes import centres, headings

SLOTS = 6
"""Largest number of bars in a panel; if there are more outcomes, the rarest share one bar."""

COLOUR_OF = {
    "folded": plotting.COLOURS[3],
    "misfolded": plotting.COLOURS[2],
    "held": plotting.COLOURS[1],
    "jammed": plotting.COLOURS[5],
    "unsettled": plotting.COLOURS[4],
    "failed": plotting.COLOURS[0],
    "others": plotting.GRID,
}
"""Colours of the statuses."""
_WIDTH, _ALONE, _HEIGHT = 3.5, 4.6, 3.3  # width, width of a single panel, and height [inch]
LINES = 6
"""Largest number of outcomes in a chart over one parameter."""
MAPS = 4
"""Largest number of outcomes in a chart over two parameters."""

_TICKS = 12  # most values written on an axis; larger maps have no numbers in their cells
_CELL = 0.52  # edge of a cell [inch]
_MAP = "Blues"  # from light to dark, distinguishable with all kinds of colour vision
_DARK = 0.55  # share above which a cell is dark and its number white
_EVEN = 1e-6  # relative tolerance of equal ratios


def draw_ensemble(ensemble: Ensemble, path: str | Path) -> None:
    """Draw the frequency of each word and status, with Wilson intervals, as a PNG.

    The picture below a bar shows the first run with its outcome; component 1 is coloured.
    """
    title = f"{len(ensemble)} releases, {ensemble.scene.mount}"
    plotting.save_figure(bar_chart({title: bars(ensemble)}), path)


def bar_chart(charts: Mapping[str, Sequence[Bar]]) -> Any:
    """Return a figure with one panel per title; bars must be in order of falling frequency."""
    width = _WIDTH if len(charts) > 1 else _ALONE
    figure, axes = plotting.panels(len(charts), "", width, _HEIGHT, shared=False)
    figure.get_layout_engine().set(h_pad=0.12)
    shown = {name: _most(content) for name, content in charts.items()}
    for axis, (name, content) in zip(axes, shown.items(), strict=True):
        _draw_panel(axis, name, content)
    used = {bar.status for content in shown.values() for bar in content}
    handles = [
        plotting.patch("Patch", color=c, label=name)
        for name, c in COLOUR_OF.items()
        if name in used
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), frameon=False)
    return figure


def _most(content: Sequence[Bar]) -> list[Bar]:
    """Return at most `SLOTS` bars, the last of which may combine all others."""
    if len(content) <= SLOTS:
        return list(content)
    rate = sum(bar.rate for bar in content[SLOTS - 1 :])
    return [*content[: SLOTS - 1], Bar("", "others", rate, math.nan, math.nan, ())]


def _draw_panel(axis: Any, name: str, content: Sequence[Bar]) -> None:
    places, rates = np.arange(len(content)), np.array([bar.rate for bar in content])
    errors = [rates - [bar.low for bar in content], [bar.high for bar in content] - rates]
    axis.bar(places, rates, color=[COLOUR_OF[bar.status] for bar in content], width=0.62)
    axis.errorbar(
        places, rates, np.maximum(errors, 0.0), fmt="none", ecolor=plotting.INK, capsize=3
    )
    axis.set_title(name, fontsize=10, color=plotting.INK)
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
    """Draw the casings of a chain; component 1 heads up and to the right."""
    angles = headings(bar.joints, first=math.pi / 4)
    for k, (middle, angle) in enumerate(zip(centres(angles), angles, strict=True)):
        face = COLOUR_OF[bar.status] if k == 0 else "white"
        corners = square(middle, float(angle), 1.0)
        look = {"facecolor": face, "edgecolor": plotting.INK, "linewidth": 0.8, "clip_on": False}
        axis.add_patch(plotting.patch("Polygon", corners, **look))
    axis.set_aspect("equal")
    axis.autoscale_view()
    axis.set_axis_off()


def draw_sweep(sweep: Sweep, path: str | Path, outcome: Outcome | None = None) -> None:
    """Draw the frequencies of outcomes in the format of the path's suffix, such as PNG.

    A sweep over one parameter gives lines with Wilson intervals. A sweep over two parameters gives
    a map of shares for each outcome.

    Parameters
    ----------
    sweep
        The sweep to draw.
    path
        Path of the picture.
    outcome
        The only outcome to draw. None draws the most frequent ones, which distinguish full folds
        by word and other runs by status.
    """
    plotting.save_figure(chart(sweep, outcome), path)


def chart(sweep: Sweep, outcome: Outcome | None = None) -> Any:
    """Return the figure that `draw_sweep` writes."""
    return _lines(sweep, outcome) if len(sweep.shape) == 1 else _maps(sweep, outcome)


def _title(sweep: Sweep) -> str:
    return f"{len(sweep.ensembles[0])} releases per point, {sweep.scene.mount}"


# --- one parameter --------------------------------------------------------------------------------


def _lines(sweep: Sweep, outcome: Outcome | None) -> Any:
    ((key, values),) = sweep.over.items()
    figure, (axis,) = plotting.panels(1, _title(sweep), width=7.2, height=4.8)
    shown = [*sweep.leading][:LINES] if outcome is None else [outcome]
    rest = np.ones(len(values))
    for k, (each, colour) in enumerate(zip(shown, _colours(shown), strict=True)):
        shares = sweep.probability(*each)
        rates = np.array([share.rate for share in shares])
        low, high = ([getattr(share, end) for share in shares] for end in ("low", "high"))
        axis.fill_between(values, low, high, color=colour, alpha=0.16, linewidth=0.0)
        marker = plotting.MARKERS[k % len(plotting.MARKERS)]
        axis.plot(values, rates, color=colour, marker=marker, markersize=5, label=str(each))
        rest -= rates
    if outcome is None and len(sweep.leading) > LINES:
        axis.plot(values, rest, color=plotting.INK, linestyle=":", label="others")
    axis.set_xlabel(key, color=plotting.INK)
    if _log(values):
        axis.set_xscale("log")
    axis.set_ylim(-0.02, 1.02)
    axis.set_yticks(np.linspace(0.0, 1.0, 5), ["0", "25 %", "50 %", "75 %", "100 %"])
    axis.set_ylabel("share, 95 % interval", color=plotting.INK)
    plotting.legend_below(figure, axis, ncols=4)
    return figure


def _colours(outcomes: Sequence[Outcome]) -> list[str]:
    """Return a colour for each outcome. Statuses have fixed colours; words get the other ones."""
    own = [None if each.word else COLOUR_OF[str(each.status)] for each in outcomes]
    left = (c for c in (*plotting.COLOURS[3:], *plotting.COLOURS[:3]) if c not in own)
    return [each or next(left) for each in own]


def _log(values: Sequence[float]) -> bool:
    """Return whether values grow by equal factors rather than by equal steps."""
    if values[0] <= 0.0 or len(values) == 2:  # two values do both
        return False
    factors = [b / a for a, b in pairwise(values)]
    return max(factors) - min(factors) < _EVEN * max(factors)


# --- two parameters -------------------------------------------------------------------------------


def _maps(sweep: Sweep, outcome: Outcome | None) -> Any:
    across, up = sweep.over.items()
    shown = [*sweep.leading][:MAPS] if outcome is None else [outcome]
    shares = {str(each): sweep.probability(*each) for each in shown}
    found = [part for each in shares.values() for part in each]
    rates = {
        name: np.array([part.rate for part in each]).reshape(sweep.shape).T
        for name, each in shares.items()
    }
    widest = max(max(part.rate - part.low, part.high - part.rate) for part in found)
    title = f"{_title(sweep)}; 95 % intervals within ±{100 * widest:.0f} %"
    (x_name, x), (y_name, y) = across, up
    width, height = (_CELL * min(max(len(values), 6), _TICKS) + 0.8 for values in (x, y))
    figure, axes = plotting.panels(len(rates), title, width, height, shared=False)
    image = None
    for axis, (name, shares) in zip(axes, rates.items(), strict=True):
        axis.grid(visible=False)
        image = axis.imshow(shares, vmin=0.0, vmax=1.0, cmap=_MAP, origin="lower", aspect="auto")
        axis.set_title(name, fontsize=10, color=plotting.INK)
        _mark(axis.set_xticks, x)
        _mark(axis.set_yticks, y)
        axis.tick_params(length=0, labelsize=8)
        axis.spines[:].set(color=plotting.GRID, visible=True)
        if max(shares.shape) <= _TICKS:
            _write_numbers(axis, shares)
    figure.supxlabel(x_name, fontsize=10, color=plotting.INK)
    figure.supylabel(y_name, fontsize=10, color=plotting.INK)
    bar = figure.colorbar(image, ax=axes.tolist(), fraction=0.05, aspect=30)
    bar.set_ticks([0.0, 0.5, 1.0], labels=["0", "50 %", "100 %"])
    bar.outline.set_edgecolor(plotting.GRID)
    return figure


def _mark(set_ticks: Any, values: Sequence[float]) -> None:
    """Write at most `_TICKS` values beside their cells, with enough digits to distinguish them."""
    digits = 4
    while len({f"{value:.{digits}g}" for value in values}) < len(values):
        digits += 1
    step = -(-len(values) // _TICKS)
    places = range(0, len(values), step)
    set_ticks(places, [f"{values[place]:.{digits}g}" for place in places])


def _write_numbers(axis: Any, rates: Any) -> None:
    """Write each share into its cell in per cent."""
    for (row, column), rate in np.ndenumerate(rates):
        colour = "white" if rate > _DARK else plotting.INK
        text = {"ha": "center", "va": "center", "fontsize": 8, "color": colour}
        axis.text(column, row, f"{100 * rate:.0f}", **text)
