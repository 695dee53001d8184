"""Pictures of a chain, and PNG and animated GIF files of folds."""

import math
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image

from magfold_env.files import replacing
from magfold_env.fold import Fold, Trajectory, loaded, motion_of, turns
from magfold_env.render import chain, style
from magfold_env.render.canvas import Canvas, Size, View, save_image, tiled
from magfold_env.scene import Scene
from magfold_env.scene.errors import refuse, unless_a, unless_positive, unless_whole
from magfold_env.shapes import BoolArray, FloatArray, centres, headings, parse_word, word_to_angles

_INSET = 0.24  # edge of the target's square in the corner, relative to the picture's height
_COLOURS = 64  # enough for flat shapes with smooth edges; 256 would triple the file's size
_MOST_FPS = 50  # viewers slow down frames shorter than 20 ms


def save_png(
    fold: Fold, path: str | Path, target: str | None = None, size: Size = (960, 720)
) -> None:
    """Draw the final state of a fold, with its word and status, as a PNG.

    Parameters
    ----------
    fold
        The fold to draw.
    path
        Path of the file, which is first written under a temporary name.
    target
        The target word; its shape is drawn small in the corner.
    size
        Width and height [px].

    Raises
    ------
    ValueError
        If an angle or the base of the fold is not finite.
    """
    refuse(unless_a("fold", fold, Fold, "a fold"))
    if not (np.isfinite(fold.angles).all() and np.isfinite(fold.base).all()):
        raise ValueError(f"fold: angles {fold.angles.tolist()} cannot be drawn; must be finite")
    released = fold.scene.n - fold.in_tube
    view = chain_view(fold.scene, fold.angles, fold.base, released)
    caption = f"{fold.word or '(one component)'}  {fold.status}"
    image = picture(fold.scene, fold.angles, fold.base, released, view, target, caption, size)
    save_image(image, path)


def save_gif(
    folds: Fold | Sequence[Fold],
    path: str | Path,
    *,
    fps: int = 20,
    seconds: float = 4.0,
    hold: float = 1.5,
    targets: Sequence[str | None] | None = None,
    size: Size = (640, 480),
) -> None:
    """Write one recorded fold, or several side by side, as a GIF that repeats.

    All folds play at the same speed, at which the longest one takes `seconds`. The others stop at
    their last frames.

    Parameters
    ----------
    folds
        Folds simulated with a `frame_rate`.
    path
        Path of the file, which is first written under a temporary name.
    fps
        Frames per second, 1 to 50.
    seconds
        Playing time of the longest fold [s].
    hold
        Additional duration of the last frame [s].
    targets
        The target word of each fold; its shape is drawn small in the corner.
    size
        Width and height of the whole picture [px].

    Raises
    ------
    ValueError
        If there is no fold, a fold has no recording, `targets` has a different length, or a number
        is out of range.
    """
    shown = list(folds) if isinstance(folds, Sequence) else [folds]
    refuse([wrong for each in shown for wrong in unless_a("folds", each, Fold, "folds")])
    wanted = [None] * len(shown) if targets is None else list(targets)
    if not shown:
        raise ValueError("folds: [] is not allowed; must hold at least one fold")
    if len(wanted) != len(shown):
        raise ValueError(f"targets: {wanted!r} is not allowed; must have {len(shown)} words")
    refuse([*unless_whole("fps", fps, 1, _MOST_FPS), *unless_positive("seconds", seconds)])
    refuse([] if hold == 0.0 else unless_positive("hold", hold))
    motions = [*map(motion_of, shown)]
    columns = _columns(len(shown), size)
    panel = (size[0] // columns, size[1] // math.ceil(len(shown) / columns))
    longest = max(float(motion.time[-1] - motion.time[0]) for motion in motions)
    times = np.linspace(0.0, longest, max(2, round(seconds * fps)))
    films = [_film(*each, panel, times) for each in zip(shown, motions, wanted, strict=True)]
    images = [tiled(frames, columns) for frames in zip(*films, strict=True)]
    write_gif(images, path, round(1000 / fps), round(1000 * hold))


def _film(
    fold: Fold, motion: Trajectory, target: str | None, size: Size, times: FloatArray
) -> list[Image.Image]:
    """Return pictures of the frames nearest to `times` [s] after the start, in a fixed view."""
    view = chain_view(fold.scene, motion.angles, motion.base, motion.released)
    elapsed = motion.time - motion.time[0]

    @lru_cache(maxsize=1)
    def drawn(k: int) -> Image.Image:
        caption = f"{elapsed[k]:.2f} s"
        if k == len(motion) - 1:
            caption += f"  {fold.word} {fold.status}"
        state = motion.angles[k], motion.base[k], int(motion.released[k])
        return picture(fold.scene, *state, view, target, caption, size)

    return [drawn(int(np.abs(elapsed - time).argmin())) for time in times]


def _columns(count: int, size: Size) -> int:
    """Return the number of columns for which `count` panels contain the largest squares."""

    def square(columns: int) -> float:
        return min(size[0] / columns, size[1] / math.ceil(count / columns))

    return max(range(1, count + 1), key=square)


def write_gif(images: Sequence[Image.Image], path: str | Path, step: int, hold: int) -> None:
    """Write pictures as a GIF that repeats; with a common palette, it stores only what changes.

    Each picture lasts ``step`` [ms]. The last one lasts ``hold`` [ms] longer.
    """
    palette = images[-1].quantize(_COLOURS)
    frames = [image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images]
    durations = [step] * (len(frames) - 1) + [step + hold]
    with replacing(path) as temporary:
        frames[0].save(
            temporary,
            format="GIF",
            save_all=True,
            append_images=frames[1:],
            duration=durations,
            loop=0,
            optimize=False,
        )


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
    """Return a picture of a chain in a given view; ``size`` is its width and height [px].

    ``angles`` are headings [rad], shape (n,), and ``base`` is component 1's outer hinge [m], (2,).
    The target's shape is drawn small in the corner. The caption may have several lines.
    """
    if target is not None:
        # The higher view keeps the chain away from the target's corner.
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

    The arrays have the shapes (n,), (2,) and (), or (m, n), (m, 2) and (m,). The view also contains
    the fixed magnet and obstacles that are not far away.
    """
    n, diagonal = scene.n, scene.casing.diagonal
    middles = centres(angles, side=scene.casing.side, base=base).reshape(-1, n, 2)
    out = turns(scene) < np.asarray(released).reshape(-1, 1)
    points = middles[np.broadcast_to(out, middles.shape[:2])]
    if scene.mount == "tube":
        points = np.concatenate([points, [[0.6 * diagonal, 0.0], [-0.2 * diagonal, 0.0]]])
    return chain.with_surroundings(scene, View.around(points, 0.9 * diagonal))


def draw_ruler(canvas: Canvas, text: float) -> None:
    """Draw a bar of one centimetre in the lower right corner; `text` is the text height [px]."""
    width, height = canvas.size
    label = "10 mm"
    canvas.note(label, (width - 0.8 * text, height - 0.9 * text), 0.75 * text, style.FAINT, "rd")
    canvas.bar((width - 0.8 * text, height - 0.6 * text), 0.01, style.FAINT)


def shape_picture(
    scene: Scene, word: str, edge: int, caption: str, colour: style.Colour
) -> Image.Image:
    """Return a square picture of a fold word's shape, `edge` px wide, with a caption below it."""
    angles = headings(word_to_angles(parse_word(word, scene.n)))
    middles = centres(angles, side=scene.casing.side)
    view = View.around(middles, 0.62 * scene.casing.diagonal)
    # The view is lower to leave room for the caption.
    room = 0.22 * max(view.right - view.left, view.top - view.bottom)
    canvas = Canvas(view._replace(bottom=view.bottom - room), (edge, edge))
    chain.draw_ghost(canvas, angles, middles, scene.casing.side)
    for k, middle in enumerate(middles):
        canvas.label(str(k + 1), middle, 0.42 * scene.casing.side, colour)
    canvas.note(caption, (edge / 2, edge - 2), max(9.0, 0.12 * edge), colour, "md")
    return canvas.image()
