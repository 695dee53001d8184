"""Pictures of limit loads: moments at the joints of a fold, and pulls in all directions."""

import math
from pathlib import Path

import numpy as np
from PIL import Image

from magfold_env.limit_loads import Holding
from magfold_env.render import chain, style
from magfold_env.render.canvas import Canvas, Size, View, save_image
from magfold_env.render.frames import chain_view, draw_ruler, with_magnets
from magfold_env.shapes import FloatArray, centres

_PANEL = 0.4  # of the width, for the pull
_ROOM = 1.3  # around the curve, in radii of its rim
_RIM = 3.0  # multiple of the least pull up to which the curve shows pulls
_RINGS = (1.0, 2.0, 2.5, 5.0)  # possible values of a ring, times a power of ten
_NEAR = math.radians(50.0)  # largest angle between directions that a line joins


def draw_holding(found: Holding, path: str | Path, size: Size = (1200, 720)) -> None:
    """Draw a fold with the moments that open its joints and its pulls in all directions, as a PNG.

    Parameters
    ----------
    found
        The limit loads to draw.
    path
        Where to; written under a temporary name first.
    size
        Width and height [px].
    """
    width, height = size
    text, panel = max(9.0, height / 36), round(_PANEL * width)
    image = Image.new("RGB", size, style.FLOOR)
    image.paste(_chain_picture(found, (width - panel, height), text), (0, 0))
    image.paste(_pull_picture(found, (panel, height), text), (width - panel, 0))
    save_image(image, path)


def _chain_picture(found: Holding, size: Size, text: float) -> Image.Image:
    fold = found.fold
    scene, angles, base = fold.scene, fold.angles, fold.base
    side, released = scene.casing.side, scene.n - fold.in_tube
    view = chain_view(scene, angles, base, released)
    canvas = Canvas(view._replace(top=view.top + 0.15 * (view.top - view.bottom)), size)
    chain.draw_surroundings(canvas, scene, angles, base, text)
    chain.draw_chain(canvas, scene, angles, base, with_magnets(scene, angles, base, released))
    middles = centres(angles, side=side, base=base)
    for number, colour in ((found.held, style.HELD), (found.pulled, style.MARKED)):
        if number:
            corners = chain.square(middles[number - 1], angles[number - 1], side)
            canvas.polygon(corners, None, colour, max(2.0, 0.05 * side * canvas.scale))
    force, direction = found.least_pull
    if math.isfinite(force):
        _draw_arrow(canvas, middles[found.pulled - 1], direction, side)
    reach = 0.5 * scene.casing.diagonal * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    weakest = found.opens.min(initial=math.inf)
    for hinge, moment in zip((middles + reach)[:-1], found.opens, strict=True):
        if math.isfinite(moment):
            _draw_tag(canvas, hinge, f"{1e3 * moment:.3g}", text, moment == weakest)
    draw_ruler(canvas, text)
    canvas.note(
        f"{fold.word or '(one component)'}  {fold.status}",
        (text, 0.7 * text),
        1.2 * text,
        style.INK,
    )
    canvas.note(
        "at the joints: moments that open them [mN·m]", (text, 2.4 * text), 0.9 * text, style.FAINT
    )
    return canvas.image()


def _draw_tag(canvas: Canvas, place: FloatArray, words: str, text: float, weakest: bool) -> None:
    """Draw a small plate with a number at a place [m]."""
    half = np.array([0.32 * len(words) + 0.25, 0.65]) * text / canvas.scale
    corners = place + half * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    colour = style.WARNING if weakest else style.INK
    canvas.polygon(corners, style.FLOOR, colour)
    canvas.label(words, place, 0.95 * text / canvas.scale, colour)


def _draw_arrow(canvas: Canvas, tail: FloatArray, direction: float, length: float) -> None:
    """Draw an arrow away from a place [m], beginning at half its length [m]."""
    along = length * np.array([math.cos(direction), math.sin(direction)])
    across = np.array([-along[1], along[0]])
    neck, tip = tail + 1.1 * along, tail + 1.5 * along
    canvas.line(np.array([tail + 0.5 * along, neck]), style.MARKED, 0.06 * length * canvas.scale)
    canvas.polygon([neck + 0.12 * across, tip, neck - 0.12 * across], style.MARKED)


def _pull_picture(found: Holding, size: Size, text: float) -> Image.Image:
    canvas = Canvas(View(-_ROOM, _ROOM, -_ROOM, _ROOM), size)
    least, _ = found.least_pull
    finite = found.pull[np.isfinite(found.pull)]
    rim = (
        max(min(_RIM * least, float(finite.max())), 1e-300) if least > 0.0 and finite.size else 1.0
    )
    turn = np.radians(np.arange(0, 361, 3))
    circle = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    ring = _ring(rim)
    radii = np.arange(1, math.floor(rim / ring * 1.0001) + 1) * ring
    for radius in radii:
        canvas.line(radius / rim * circle, style.CASING, 1.0)
    for spoke in circle[:-1:10]:
        canvas.line(np.array([0.0 * spoke, spoke]), style.CASING, 1.0)
    canvas.line(circle, style.FAINT, 1.0)
    order = np.argsort(found.directions)
    towards, pulls = found.directions[order], np.minimum(found.pull[order] / rim, 1.0)
    points = pulls[:, None] * np.stack([np.cos(towards), np.sin(towards)], axis=1)
    ahead = np.roll(np.arange(len(points)), -1)
    for k, after in enumerate(ahead):
        close = k != after and (towards[after] - towards[k]) % (2.0 * math.pi) < _NEAR
        if close and min(pulls[k], pulls[after]) < 1.0:
            canvas.line(np.array([points[k], points[after]]), style.MARKED, 2.5)
    for point, pull in zip(points, pulls, strict=True):
        canvas.disc(point, 0.018, style.FAINT if pull >= 1.0 else style.MARKED)
    for radius in radii:
        canvas.label(f"{radius:.3g} N", (0.0, radius / rim + 0.06), 0.07, style.FAINT)
    by = f"component {found.held} held" if found.held else "mount and floor hold"
    lines = [f"pull on component {found.pulled}, {by}"]
    if finite.size:
        lines.append(f"gives way at {least:.3g} N; grey: {rim:.3g} N or more")
    for k, line in enumerate(lines):
        canvas.note(
            line, (size[0] / 2, (0.7 + 1.7 * k) * text), (1.1 - 0.2 * k) * text, style.INK, "ma"
        )
    return canvas.image()


def _ring(rim: float) -> float:
    """Return the values of the rings of a curve up to a rim: two to five of them."""
    power = 10.0 ** math.floor(math.log10(rim / 2.0))
    return max(step * power for step in _RINGS if step * power <= rim / 2.0)
