"""Recorded folds as animated GIFs."""

import math
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np
from PIL import Image

from magfold_env.files import replacing
from magfold_env.fold import Fold, Trajectory
from magfold_env.render.canvas import Size, tiled
from magfold_env.render.frames import chain_view, picture
from magfold_env.shapes import FloatArray

_COLOURS = 64  # colours: enough for flat shapes with smooth edges, at a third of the size of 256
_MOST_FPS = 50  # viewers slow down frames shorter than 20 ms


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

    All folds play in the same slow motion, in which the longest takes `seconds`; the others wait at
    their ends.

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
        Duration of the last frame [s].
    targets
        The target word of each fold, drawn small in its corner.
    size
        Width and height of the whole picture [px].

    Raises
    ------
    ValueError
        If there is no fold, a fold has no recording, `targets` has a different length, or a number
        is out of range.
    """
    shown = [folds] if isinstance(folds, Fold) else list(folds)
    wanted = [None] * len(shown) if targets is None else list(targets)
    if not shown:
        raise ValueError("folds: [] is not allowed; must hold at least one fold")
    if len(wanted) != len(shown):
        raise ValueError(f"targets: {wanted!r} is not allowed; must have {len(shown)} words")
    if not 1 <= fps <= _MOST_FPS:
        raise ValueError(f"fps: {fps!r} is not allowed; must be between 1 and {_MOST_FPS}")
    if not (math.isfinite(seconds) and seconds > 0 and math.isfinite(hold) and hold >= 0):
        given = f"seconds, hold: {seconds!r}, {hold!r} are not allowed"
        raise ValueError(f"{given}; must be positive and not negative")
    for fold in shown:
        if fold.trajectory is None:
            raise ValueError(
                "folds: a fold without trajectory is not allowed; simulate it with a frame_rate"
            )
    columns = _columns(len(shown), size)
    panel = (size[0] // columns, size[1] // math.ceil(len(shown) / columns))
    motions = [fold.trajectory.finite() for fold in shown if fold.trajectory is not None]
    longest = max(float(motion.time[-1] - motion.time[0]) for motion in motions)
    times = np.linspace(0.0, longest, max(2, round(seconds * fps)))
    films = [_film(*each, panel, times) for each in zip(shown, motions, wanted, strict=True)]
    images = [tiled(frames, columns) for frames in zip(*films, strict=True)]
    write_gif(images, path, round(1000 / fps), round(1000 * hold))


def _film(
    fold: Fold, motion: Trajectory, target: str | None, size: Size, times: FloatArray
) -> list[Image.Image]:
    """Return the frames nearest to times [s] after the start, in a fixed view."""
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
    """Return the number of columns that gives each of `count` panels the largest square."""

    def square(columns: int) -> float:
        return min(size[0] / columns, size[1] / math.ceil(count / columns))

    return max(range(1, count + 1), key=square)


def write_gif(images: Sequence[Image.Image], path: str | Path, step: int, hold: int) -> None:
    """Write pictures as a GIF that repeats, with one palette, so that it stores only what moves.

    Each lasts ``step``, and the last one ``hold`` longer [ms].
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
