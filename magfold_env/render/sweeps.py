"""Charts of sweeps: the frequency of each outcome by parameter. Needs matplotlib."""

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from magfold_env.ensembles.sweeps import Outcome, Sweep
from magfold_env.render.ensembles import COLOUR_OF
from magfold_env.reporting import plotting

LINES = 6
"""Largest number of outcomes drawn over one parameter."""
MAPS = 4
"""Largest number of outcomes drawn over two parameters."""

_TICKS = 12  # values at most that are written on an axis, and cells across that hold a number
_CELL = 0.52  # [inch]
_MAP = "Blues"  # from light to dark, distinguishable with all kinds of colour vision
_DARK = 0.55  # share above which cells are dark
_EVEN = 1e-6  # steps, or ratios, that agree to this share are equal


def draw_sweep(sweep: Sweep, path: str | Path, outcome: Outcome | None = None) -> None:
    """Draw the frequencies of outcomes, as PNG or in the format of the suffix.

    Over one parameter, the chart has lines with Wilson intervals; over two, a map of shares for
    each outcome.

    Parameters
    ----------
    sweep
        The sweep to draw.
    path
        Path of the picture.
    outcome
        The only outcome to draw; None draws the most frequent ones, full folds by word and others
        by status.
    """
    plotting.save_figure(chart(sweep, outcome), path)


def chart(sweep: Sweep, outcome: Outcome | None = None) -> Any:
    """Return the figure that `draw_sweep` writes."""
    return _lines(sweep, outcome) if len(sweep.shape) == 1 else _maps(sweep, outcome)


def _title(sweep: Sweep) -> str:
    return f"{len(sweep.ensembles[0])} releases a point, {sweep.scene.mount}"


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
    """Return a colour for each outcome: a status has its own, and words get the remaining ones."""
    own = [None if each.word else COLOUR_OF[str(each.status)] for each in outcomes]
    left = iter(
        [each for each in (*plotting.COLOURS[3:], *plotting.COLOURS[:3]) if each not in own]
    )
    return [each or next(left) for each in own]


def _log(values: Sequence[float]) -> bool:
    """Whether values grow by equal factors rather than by equal steps."""
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
    columns = min(len(rates), 2)
    rows = -(-len(rates) // columns)
    width, height = (_CELL * min(max(len(values), 6), _TICKS) for values in (x, y))
    size = (columns * (width + 0.8) + 1.2, rows * (height + 0.8) + 0.9)
    figure = plotting.figure_class()(figsize=size, layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False).ravel()
    image = None
    for axis, (name, shares) in zip(axes, rates.items(), strict=False):
        image = axis.imshow(shares, vmin=0.0, vmax=1.0, cmap=_MAP, origin="lower", aspect="auto")
        axis.set_title(name, fontsize=10, color=plotting.INK)
        _mark(axis.set_xticks, x)
        _mark(axis.set_yticks, y)
        axis.tick_params(length=0, labelsize=8)
        axis.spines[:].set_color(plotting.GRID)
        if max(shares.shape) <= _TICKS:
            _write_numbers(axis, shares)
    for axis in axes[len(rates) :]:
        axis.set_axis_off()
    figure.suptitle(title, color=plotting.INK)
    figure.supxlabel(x_name, fontsize=10, color=plotting.INK)
    figure.supylabel(y_name, fontsize=10, color=plotting.INK)
    bar = figure.colorbar(image, ax=axes.tolist(), fraction=0.05, aspect=30)
    bar.set_ticks([0.0, 0.5, 1.0], labels=["0", "50 %", "100 %"])
    bar.outline.set_edgecolor(plotting.GRID)
    return figure


def _mark(set_ticks: Any, values: Sequence[float]) -> None:
    """Write the values, or some, beside their cells with enough digits to distinguish them."""
    digits = 4
    while len({f"{value:.{digits}g}" for value in values}) < len(values):
        digits += 1
    step = -(-len(values) // _TICKS)
    places = range(0, len(values), step)
    set_ticks(places, [f"{values[place]:.{digits}g}" for place in places])


def _write_numbers(axis: Any, rates: Any) -> None:
    """Write shares in per cent into their cells."""
    for (row, column), rate in np.ndenumerate(rates):
        colour = "white" if rate > _DARK else plotting.INK
        text = {"ha": "center", "va": "center", "fontsize": 8, "color": colour}
        axis.text(column, row, f"{100 * rate:.0f}", **text)
