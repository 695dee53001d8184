"""Single pictures of a chain, and PNG files of folds."""

from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image

from magfold_env.fold import Fold, loaded, turns
from magfold_env.render import chain, style
from magfold_env.render.canvas import Canvas, Size, View, save_image
from magfold_env.scene import Scene
from magfold_env.shapes import BoolArray, FloatArray, centres, headings, parse_word, word_to_angles

_INSET = 0.24  # of the picture's height, the target's square in the corner


def save_png(
    fold: Fold, path: str | Path, target: str | None = None, size: Size = (960, 720)
) -> None:
    """Draw the end of a fold, with its word and status, as a PNG.

    Parameters
    ----------
    fold
        The fold to draw.
    path
        Path of the file, which is first written under a temporary name.
    target
        The target word, drawn small in the corner.
    size
        Width and height [px].

    Raises
    ------
    ValueError
        If the fold has numbers that are not finite.
    """
    if not (np.isfinite(fold.angles).all() and np.isfinite(fold.base).all()):
        raise ValueError(f"fold: angles {fold.angles.tolist()} cannot be drawn; must be finite")
    released = fold.scene.n - fold.in_tube
    view = chain_view(fold.scene, fold.angles, fold.base, released)
    caption = f"{fold.word or '(one component)'}  {fold.status}"
    image = picture(fold.scene, fold.angles, fold.base, released, view, target, caption, size)
    save_image(image, path)


def picture(
    scene: Scene,
    angles: FloatArray,
    base: FloatArray,
    released: int,
    view: View,
    target: str | None,
    caption: str,
    size: Size,
) -> Image.Image:
    """Return a picture of a chain in a given view, of a width and a height [px].

    The headings [rad] have the shape (n,), component 1's outer hinge [m] has (2,). The target's
    fold word is drawn small in the corner; the caption may have several lines.
    """
    if target is not None:
        # The corner of the target stays clear of the chain.
        room = _INSET / (1.0 - _INSET) * (view.top - view.bottom)
        view = view._replace(top=view.top + room)
    canvas = Canvas(view, size)
    text = max(11.0, size[1] / 30)
    chain.draw_surroundings(canvas, scene, angles, base, text)
    chain.draw_chain(canvas, scene, angles, base, with_magnets(scene, angles, base, released))
    canvas.note(caption, (0.6 * text, 0.5 * text), text, style.INK)
    draw_ruler(canvas, text)
    image = canvas.image()
    if target is not None:
        edge = round(_INSET * size[1])
        inset = shape_picture(scene, target, edge, f"target {target}", style.GOOD)
        image.paste(inset, (size[0] - inset.width, 0))
    return image


def with_magnets(scene: Scene, angles: FloatArray, base: FloatArray, released: int) -> BoolArray:
    """Return which components have their magnets, shape (n,); see `magfold_env.fold.loaded`."""
    return loaded(scene, angles[None], base[None], [released])[0]


def chain_view(scene: Scene, angles: FloatArray, base: FloatArray, released: npt.ArrayLike) -> View:
    """Return a view that contains the released components of one state or of m states.

    Shapes are (n,), (2,) and (), or (m, n), (m, 2) and (m,). The view also contains a fixed magnet
    and obstacles, unless they are far away.
    """
    n, diagonal = scene.n, scene.casing.diagonal
    middles = centres(angles, side=scene.casing.side, base=base).reshape(-1, n, 2)
    out = turns(scene) < np.asarray(released).reshape(-1, 1)
    points = middles[np.broadcast_to(out, middles.shape[:2])]
    if scene.mount == "tube":
        points = np.concatenate([points, [[0.6 * diagonal, 0.0], [-0.2 * diagonal, 0.0]]])
    return chain.with_surroundings(scene, View.around(points, 0.9 * diagonal))


def draw_ruler(canvas: Canvas, text: float) -> None:
    """Draw a bar of one centimetre in the lower right corner."""
    width, height = canvas.size
    label = "10 mm"
    canvas.note(label, (width - 0.8 * text, height - 0.9 * text), 0.75 * text, style.FAINT, "rd")
    canvas.bar((width - 0.8 * text, height - 0.6 * text), 0.01, style.FAINT)


def shape_picture(
    scene: Scene, word: str, edge: int, caption: str, colour: style.Colour
) -> Image.Image:
    """Return a square picture of the ghost of a fold word, `edge` px wide, above a line of text."""
    angles = headings(word_to_angles(parse_word(word, scene.n)))
    middles = centres(angles, side=scene.casing.side)
    view = View.around(middles, 0.62 * scene.casing.diagonal)
    # Room below for the text.
    room = 0.22 * max(view.right - view.left, view.top - view.bottom)
    canvas = Canvas(view._replace(bottom=view.bottom - room), (edge, edge))
    chain.draw_ghost(canvas, angles, middles, scene.casing.side)
    for k, middle in enumerate(middles):
        canvas.label(str(k + 1), middle, 0.42 * scene.casing.side, colour)
    canvas.note(caption, (edge / 2, edge - 2), max(9.0, 0.12 * edge), colour, "md")
    return canvas.image()
