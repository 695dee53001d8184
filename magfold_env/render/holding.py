"""Pictures of limit loads: the moments that open a fold's joints, and pulls in all directions."""

import math
from pathlib import Path
from typing import Any

import numpy as np

from magfold_env.holding_loads import Holding
from magfold_env.render import chain, style
from magfold_env.render.frames import chain_view, picture
from magfold_env.reporting import plotting
from magfold_env.shapes import centres

_HEIGHT = 900  # of the picture of the chain [px]
_RIM = 3.0  # largest pull drawn, as a multiple of the smallest one
_WEDGE = math.radians(12.0)  # angle of the wedge that shows the pull in one direction


def draw_holding(found: Holding, path: str | Path) -> None:
    """Draw the limit loads of a fold as a PNG: moments at its joints, and pulls in all directions.

    Parameters
    ----------
    found
        The limit loads to draw.
    path
        Path of the file, which is first written under a temporary name.

    Raises
    ------
    ImportError
        If matplotlib is not installed.
    """
    figure = plotting.figure_class()(figsize=(11.0, 6.2), layout="constrained")
    grid = figure.add_gridspec(1, 2, width_ratios=(3, 2))
    _draw_chain(figure.add_subplot(grid[0]), found)
    _draw_pull(figure.add_subplot(grid[1], projection="polar"), found)
    plotting.save_figure(figure, path)


def _draw_chain(axis: Any, found: Holding) -> None:
    fold = found.fold
    scene, angles, side = fold.scene, fold.angles, fold.scene.casing.side
    released = scene.n - fold.in_tube
    view = chain_view(scene, angles, fold.base, released)
    size = (round(_HEIGHT * (view.right - view.left) / (view.top - view.bottom)), _HEIGHT)
    axis.imshow(picture(scene, angles, fold.base, released, view, None, "", size), extent=view)
    axis.set_axis_off()
    title = f"{fold.word or '(one component)'}  {fold.status}"
    axis.set_title(f"{title}\nat the joints: moments that open them [mN·m]", color=plotting.INK)
    middles = centres(angles, side=side, base=fold.base)
    for number, colour in ((found.held, style.HELD), (found.pulled, style.MARKED)):
        if number:
            corners = chain.square(middles[number - 1], angles[number - 1], side)
            edge = {"edgecolor": style.shares(colour), "linewidth": 3.0}
            axis.add_patch(plotting.patch("Polygon", corners, fill=False, **edge))
    force, direction = found.least_pull
    if math.isfinite(force):
        along = side * np.array([math.cos(direction), math.sin(direction)])
        tail = middles[found.pulled - 1] + 0.5 * along
        look = {"arrowstyle": "-|>", "color": style.shares(style.MARKED), "linewidth": 3.0}
        axis.annotate("", tail + along, tail, arrowprops=look | {"mutation_scale": 25})
    reach = 0.5 * scene.casing.diagonal * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    weakest = found.opens.min(initial=math.inf)
    for hinge, moment in zip((middles + reach)[:-1], found.opens, strict=True):
        if math.isfinite(moment):
            colour = style.shares(style.WARNING if moment == weakest else style.INK)
            plate = {"boxstyle": "square", "facecolor": "white", "edgecolor": colour}
            look = {"color": colour, "ha": "center", "va": "center", "bbox": plate}
            axis.text(*hinge, f"{1e3 * moment:.3g}", **look)


def _draw_pull(axis: Any, found: Holding) -> None:
    least, towards = found.least_pull
    largest = found.pull.max(initial=0.0, where=np.isfinite(found.pull))
    rim = min(_RIM * least, largest) or largest or 1.0
    beyond = found.pull >= rim
    colours = [style.shares(style.FAINT if each else style.MARKED) for each in beyond]
    axis.bar(found.directions, np.minimum(found.pull, rim), width=_WEDGE, color=colours)
    axis.set_rlim(0.0, rim)
    axis.set_rlabel_position(math.degrees(towards + 0.6 * _WEDGE))  # beside the shortest wedge
    axis.set_rticks(np.linspace(0.0, rim, 4)[1:])
    axis.yaxis.set_major_formatter("{x:.3g} N")
    axis.tick_params(labelcolor=plotting.INK)
    by = f"component {found.held} held" if found.held else "mount and floor hold"
    words = f"pull on component {found.pulled}, {by}"
    if math.isfinite(least):
        words += f"\ngives way at {least:.3g} N; grey: {rim:.3g} N or more"
    axis.set_title(words, color=plotting.INK, pad=20.0)
