"""Recorded folds as animated GIFs."""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image

from magfold_env.files import replacing
from magfold_env.fold import Fold
from magfold_env.render.canvas import Size, View, tiled
from magfold_env.render.frames import chain_view, picture

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
    columns = _columns(len(shown), size)
    rows = math.ceil(len(shown) / columns)
    panel = (size[0] // columns, size[1] // rows)
    panels = [_Panel(fold, target, panel) for fold, target in zip(shown, wanted, strict=True)]
    longest = max(panel.duration for panel in panels)
    times = np.linspace(0.0, longest, max(2, round(seconds * fps)))
    images = [tiled([p.at(float(t)) for p in panels], columns) for t in times]
    write_gif(images, path, round(1000 / fps), round(1000 * hold))


class _Panel:
    """One fold in its own fixed view."""

    def __init__(self, fold: Fold, target: str | None, size: Size) -> None:
        if fold.trajectory is None:
            raise ValueError(
                "folds: a fold without trajectory is not allowed; simulate it with a frame_rate"
            )
        self._fold, self._target, self._size = fold, target, size
        self._motion = motion = fold.trajectory.finite()
        self._view: View = chain_view(fold.scene, motion.angles, motion.base, motion.released)
        self._drawn: tuple[int, Image.Image] | None = None
        self.duration = float(motion.time[-1] - motion.time[0])

    def at(self, time: float) -> Image.Image:
        """Return the frame nearest to `time` [s] after the start; at the end, with the result."""
        times = self._motion.time - self._motion.time[0]
        k = int(np.abs(times - time).argmin())
        if self._drawn is None or self._drawn[0] != k:
            self._drawn = (k, self._picture(k))
        return self._drawn[1]

    def _picture(self, k: int) -> Image.Image:
        fold, motion = self._fold, self._motion
        caption = f"{motion.time[k] - motion.time[0]:.2f} s"
        if k == len(motion) - 1:
            caption += f"  {fold.word} {fold.status}"
        return picture(
            fold.scene,
            motion.angles[k],
            motion.base[k],
            int(motion.released[k]),
            self._view,
            self._target,
            caption,
            self._size,
        )


def _columns(count: int, size: Size) -> int:
    """Return the number of columns that gives each of `count` panels the largest square."""

    def square(columns: int) -> float:
        return min(size[0] / columns, size[1] / math.ceil(count / columns))

    return max(range(1, count + 1), key=square)


def write_gif(images: Sequence[Image.Image], path: str | Path, step: int, hold: int) -> None:
    """Write pictures as a GIF that repeats, with one palette, so that it stores only what moves.

    Parameters
    ----------
    images
        The frames.
    path
        Path of the file, which is first written under a temporary name.
    step
        Duration of each frame [ms].
    hold
        Additional duration of the last frame [ms].
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
