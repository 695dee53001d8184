"""Pictures, windows and text that show an episode.

The content of a picture is a `magfold_env.render.snapshot.Snapshot`; that module defines its
layout. ``rgb_array`` and ``ansi`` show the chain at the moment of a decision. ``human`` also plays
the motion that the last step recorded, slowed down, and ``rgb_array_list`` returns it as frames.
Nothing is simulated a second time.

Only drawing needs the `render` extra, so drawing modules are imported when they are first used.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from magfold_env.envs.tasks.checks import one_of
from magfold_env.fold import Trajectory

if TYPE_CHECKING:
    from magfold_env.render.canvas import View
    from magfold_env.render.snapshot import Snapshot
    from magfold_env.render.window import Window

RENDER_MODES = ("human", "rgb_array", "rgb_array_list", "ansi")

FRAME_RATE = 240.0
"""Frames recorded for a window per simulated second [1/s]."""

SLOWDOWN = 8.0
"""Seconds that a window takes to play a simulated second."""

FILM_RATE = 60.0
"""Frames per simulated second in ``rgb_array_list`` [1/s]."""

FILM_FPS = 30
"""Frames per second for playback [1/s]."""


class Viewer:
    """Shows an environment in a render mode; a window shows at most `fps` steps per second."""

    def __init__(self, mode: str | None, fps: float) -> None:
        self.mode = one_of("render_mode", mode, (None, *RENDER_MODES))
        self._fps = fps
        self._window: Window | None = None
        self._before: Snapshot | None = None
        self._film: list[tuple[Snapshot, View, int]] = []
        self._seen = 0
        self._last = 0.0

    @property
    def frame_rate(self) -> float | None:
        """Frames that episodes must record per simulated second [1/s]; None to record none."""
        if self.mode == "human" and self._fps < FILM_FPS:  # otherwise only the steps are shown
            return FRAME_RATE
        return FILM_RATE if self.mode == "rgb_array_list" else None

    @property
    def window(self) -> Window:
        """The window of the mode ``human``."""
        if self._window is None:
            from magfold_env.render.snapshot import SNAPSHOT_SIZE  # noqa: PLC0415
            from magfold_env.render.window import Window  # noqa: PLC0415

            self._window = Window(SNAPSHOT_SIZE, "magfold")
        return self._window

    def begin(self) -> None:
        """Discard the motion of the previous episode."""
        self._seen, self._before, self._film = 0, None, []

    def render(self, snapshot: Callable[[], Snapshot]) -> Any:
        """Return a snapshot as an array or as text, or show it, according to the mode."""
        if self.mode is None:
            return None
        if self.mode == "ansi":
            return text_of(snapshot())
        if self.mode == "human":
            self.show(snapshot())
            return None
        from magfold_env.render.snapshot import SNAPSHOT_SIZE, snapshot_picture  # noqa: PLC0415

        if self.mode == "rgb_array":
            return np.array(snapshot_picture(snapshot()))
        film, self._film = self._film, []
        frames: list[Any] = []
        for shown, view, count in film:
            frames += [np.array(snapshot_picture(shown, SNAPSHOT_SIZE, view))] * count
        return frames

    def show(self, snapshot: Snapshot) -> None:
        """Show a snapshot in the window."""
        from magfold_env.render.snapshot import snapshot_picture  # noqa: PLC0415

        self.window.show(snapshot_picture(snapshot, self.window.size))

    def follow(self, motion: Trajectory | None, snapshot: Snapshot) -> None:
        """Show the motion that led to a snapshot, then the snapshot, or keep both for `render`."""
        view, passing = self._passing(motion, snapshot)
        self._before = snapshot
        if self.mode == "human":
            self._play(passing, view, snapshot)
            return
        self._film += [(each, view, 1) for each in passing]
        # The end stays readable for a second.
        time_only = passing[-1].message if passing else ""
        last = replace(snapshot, message=snapshot.message or time_only)
        self._film.append((last, view, FILM_FPS if snapshot.message else 1))

    def _passing(
        self, motion: Trajectory | None, snapshot: Snapshot
    ) -> tuple[View, list[Snapshot]]:
        """Return the motion that led to a snapshot, and a view that contains all of it."""
        from magfold_env.render.snapshot import motion_view, snapshot_view  # noqa: PLC0415

        view, first = snapshot_view(snapshot), self._seen
        if motion is None or len(motion) == first:
            return view, []
        self._seen = len(motion)
        angles, base, released = motion.angles, motion.base, motion.released
        whole = motion_view(snapshot.scene, angles[first:], base[first:], released[first:])
        # The result is not shown in advance; a component drawn back keeps its magnets until then.
        told, scene = self._before or snapshot, snapshot.scene
        sequence = np.where(snapshot.chosen, scene.sequence, told.scene.sequence).tolist()
        still = replace(
            snapshot,
            scene=scene if sequence == [*scene.sequence] else scene.replace(sequence=sequence),
            held=np.zeros_like(snapshot.held),
            title=told.title,
            rows=told.rows,
            predicted=told.predicted,
        )
        return whole.joined(view), [
            replace(
                still,
                angles=angles[k],
                base=base[k],
                released=int(released[k]),
                message=f"t = {motion.time[k]:.2f} s",
            )
            for k in range(first, len(motion))
        ]

    def _play(self, passing: list[Snapshot], view: View, snapshot: Snapshot) -> None:
        """Show the motion, then the snapshot, at a rate of at most `fps`.

        A key or a request to quit ends the motion; both events remain in the queue.
        """
        from magfold_env.render.snapshot import snapshot_picture  # noqa: PLC0415

        begun, k = time.monotonic(), 0
        # Frames are skipped when time is short, so that a slow machine does not fall behind.
        while k < len(passing) and not self.window.is_interrupted():
            self.window.show(snapshot_picture(passing[k], self.window.size, view))
            k = max(k + 1, int((time.monotonic() - begun) / SLOWDOWN * FRAME_RATE))
        if not self.window.is_interrupted():
            time.sleep(max(0.0, self._last + 1.0 / self._fps - time.monotonic()))
        self.show(snapshot)
        self._last = time.monotonic()

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._window is not None:
            self._window.close()


def text_of(snapshot: Snapshot) -> str:
    """Return a snapshot as text: the picture's panel, and a line for each component."""
    scene = snapshot.scene
    out = np.arange(scene.n) < snapshot.released
    if scene.feed.direction == "backward":
        out = out[::-1]
    joints = np.rad2deg(np.diff(snapshot.angles))
    lines = [f"target {snapshot.target}, {snapshot.title}"]
    if snapshot.predicted is not None:
        lines.append(f"predicted {snapshot.predicted}")
    lines += [f"{name} {value}" for name, value in snapshot.rows if name != "target"]
    for k, faces in enumerate(scene.sequence):
        place = "out" if out[k] else "in the tube"
        held = ", held by friction" if snapshot.held[k] else ""
        bend = f", then {joints[k]:+.0f}°" if k < len(joints) and out[k] and out[k + 1] else ""
        lines.append(f"{k + 1:2d} {faces if out[k] else '....'} {place}{held}{bend}")
    if snapshot.message:
        lines.append(snapshot.message)
    return "\n".join(lines) + "\n"
