"""Snapshots of an episode, which show the chain, the target, the prediction, and values.

Arrays, videos and windows show the same picture. The chain and a translucent target are on the
left; small pictures of the target and the prediction, with text below, are on the right.
"""

import textwrap
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from PIL import Image

from magfold_env.render import chain, style
from magfold_env.render.canvas import Canvas, Size, View
from magfold_env.render.frames import chain_view, draw_ruler, shape_picture, with_magnets
from magfold_env.scene import Scene
from magfold_env.shapes import BoolArray, FloatArray, centres, headings, word_to_angles

SNAPSHOT_SIZE: Size = (800, 600)
"""Default width and height of a picture [px]; both are even, as video formats require."""

_PANEL = 0.32  # width of the right part, relative to the picture's
_INSET = 0.22  # edge of the small pictures, relative to the picture's height
_LINES = 34  # text lines per picture height
_KEY = (
    ("touching, poles attract", style.GOOD),
    ("touching, poles repel", style.CONFLICT),
    ("held by friction", style.HELD),
)


@dataclass(frozen=True)
class Snapshot:
    """The data that a picture shows."""

    scene: Scene  # contains the sizes, the tube and the sequence
    angles: FloatArray  # absolute headings, (n,) [rad]
    base: FloatArray  # component 1's outer hinge, (2,) [m]
    released: int  # number of components out of the tube
    target: str  # target word
    held: BoolArray  # which components friction holds, (n,)
    chosen: BoolArray  # which components of the sequence have been chosen, (n,)
    title: str  # progress of the episode
    message: str = ""  # message about the end of the episode
    rows: tuple[tuple[str, str], ...] = ()  # names and values to show
    predicted: str | None = None  # predicted word
    is_loaded: bool = True
    """False while the magnets of a preloaded chain have not been chosen."""
    marked: int | None = None
    """Index of a component in the tube whose magnets are being chosen; its faces are numbered."""
    overlay: tuple[str, ...] = ()  # lines of text above the chain; a tab separates two columns


def snapshot_picture(
    snapshot: Snapshot, size: Size = SNAPSHOT_SIZE, view: View | None = None
) -> Image.Image:
    """Return the picture of a snapshot; ``size`` is its width and height [px].

    The picture shows at least ``view``, which is `snapshot_view` by default.
    """
    width, height = size
    panel = round(_PANEL * width)
    text = max(9.0, min(height, 0.75 * width) / _LINES)
    image = Image.new("RGB", size, style.PANEL)
    view = view or snapshot_view(snapshot)
    image.paste(_chain_picture(snapshot, (width - panel, height), view, text), (0, 0))
    image.paste(_panel_picture(snapshot, (panel, height), text), (width - panel, 0))
    return image


def snapshot_view(snapshot: Snapshot) -> View:
    """Return a view of the chain and the target, which is constant during most episodes."""
    view = motion_view(snapshot.scene, snapshot.angles, snapshot.base, snapshot.released)
    if (ghost := _ghost(snapshot)) is None:
        return view
    return view.joined(View.around(ghost[1], 0.7 * snapshot.scene.casing.diagonal))


def motion_view(
    scene: Scene, angles: FloatArray, base: FloatArray, released: npt.ArrayLike
) -> View:
    """Return a view that contains every state of a motion; see `chain_view` for the shapes."""
    diagonal = scene.casing.diagonal
    # Chains fold as they come out, so few reach farther than half their length.
    reach = (0.4 * scene.n + 1.4) * diagonal
    view = View(-1.8 * diagonal, reach, -0.6 * reach, 0.6 * reach)
    return chain.with_surroundings(scene, view).joined(chain_view(scene, angles, base, released))


def _chain_picture(snapshot: Snapshot, size: Size, view: View, text: float) -> Image.Image:
    scene, angles, base = snapshot.scene, snapshot.angles, snapshot.base
    side = scene.casing.side
    canvas = Canvas(view, size)
    chain.draw_surroundings(canvas, scene, angles, base, text)
    if (ghost := _ghost(snapshot)) is not None:
        chain.draw_ghost(canvas, *ghost, side)
    shown = with_magnets(scene, angles, base, snapshot.released) & snapshot.is_loaded
    if snapshot.marked is not None:
        shown[snapshot.marked] = True
    chain.draw_chain(canvas, scene, angles, base, shown)
    middles = centres(angles, side=side, base=base)
    if snapshot.marked is not None:
        chain.draw_marked(canvas, middles[snapshot.marked], angles[snapshot.marked], side)
    chain.draw_touches(canvas, scene, chain.touches(angles, base, side))
    chain.draw_held(canvas, middles[snapshot.held], side)
    draw_ruler(canvas, text)
    _draw_key(canvas, text)
    message = textwrap.fill(snapshot.message, int(1.8 * size[0] / text))
    canvas.note(message, (0.8 * text, 0.8 * text), text, style.INK)
    _draw_overlay(canvas, snapshot.overlay, text)
    return canvas.image()


def _ghost(snapshot: Snapshot) -> tuple[FloatArray, FloatArray] | None:
    """Return the target's headings [rad] and centres [m], fitted to the chain.

    The arrays include only components out of the tube. The result is None if fewer than 2 are out.
    """
    scene, side, n = snapshot.scene, snapshot.scene.casing.side, snapshot.scene.n
    count = snapshot.released
    if count <= 1:
        return None
    out = slice(0, count) if scene.feed.direction == "forward" else slice(n - count, n)
    wanted = headings(word_to_angles(snapshot.target))
    shape = centres(wanted, side=side)[out]
    real = centres(snapshot.angles, side=side, base=snapshot.base)[out]
    # The least-squares rotation, by complex numbers.
    away, goal = (points - points.mean(axis=0) for points in (shape, real))
    turn = np.angle(((goal[:, 0] + 1j * goal[:, 1]) * (away[:, 0] - 1j * away[:, 1])).sum())
    turned = away @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    return wanted[out] + turn, turned + real.mean(axis=0)


def _draw_key(canvas: Canvas, text: float) -> None:
    """Draw a legend of the colours in the lower left corner."""
    x, y = 0.8 * text, canvas.size[1] - 0.6 * text
    for k, (name, colour) in enumerate(reversed(_KEY)):
        line = y - 1.25 * k * text
        canvas.shade((x, line - 0.7 * text), (x + 0.6 * text, line - 0.1 * text), colour)
        canvas.note(name, (x + text, line), 0.8 * text, colour, "ld")


def _draw_overlay(canvas: Canvas, lines: tuple[str, ...], text: float) -> None:
    if not lines:
        return
    width, height = canvas.size
    canvas.shade((0.0, 0.0), (width, height), style.SHADE)
    for k, line in enumerate(lines):
        for column, part in enumerate(line.split("\t")):
            place = ((1.5 + 5.5 * column) * text, (1.5 + 1.6 * k) * text)
            canvas.note(part, place, text, style.INK)


def _panel_picture(snapshot: Snapshot, size: Size, text: float) -> Image.Image:
    width, height = size
    canvas = Canvas(View(0.0, 1.0, 0.0, 1.0), size, style.PANEL)
    margin = 0.8 * text
    y = margin
    canvas.note(snapshot.title, (margin, y), 1.15 * text, style.INK)
    y += 1.9 * text
    edge = round(min(_INSET * height, width - 2 * margin))
    places: list[tuple[Image.Image, tuple[int, int]]] = []
    for name, word, colour in (
        ("target", snapshot.target, style.GOOD),
        ("predicted", snapshot.predicted, style.INK),
    ):
        if word is not None:
            picture = shape_picture(snapshot.scene, word, edge, name, colour)
            places.append((picture, ((width - edge) // 2, round(y))))
            y += edge + 0.6 * text
    for name, value in snapshot.rows:
        canvas.note(name, (margin, y), 0.9 * text, style.FAINT)
        canvas.note(value, (width - margin, y), 0.9 * text, style.INK, "ra")
        y += 1.25 * text
    image = canvas.image()
    for picture, place in places:
        image.paste(picture, place)
    return image
