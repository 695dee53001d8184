"""``MagFold/Tray-v0``: build a chain from the components of a tray, some with bad magnets."""

from typing import Any, ClassVar, cast

import numpy as np
from numpy.typing import NDArray

from magfold_env.envs.baselines.tray_order import TrayStore
from magfold_env.envs.camera_track import CameraEpisodes, CameraTrackEnv
from magfold_env.envs.chains.arrays import FAILED, Bools, Floats, Ints
from magfold_env.envs.spaces.actions import (
    BACK,
    FACES,
    LYING,
    SIGNS,
    TrayChoice,
    TrayTable,
    scaled_speeds,
)
from magfold_env.envs.spaces.observation import Layout, camera_layout
from magfold_env.envs.tasks.feed_tasks import Task, TrayTask
from magfold_env.envs.tasks.setup import FeedOptions, TaskSetup, feedable
from magfold_env.envs.vector_env import ChainVectorEnv

LATE = 10.0
"""Time limit of an episode [s]."""

DEAD = 0.15
"""Probability that a magnet is dead, with strength 0."""

WEAK = 0.1
"""Probability that a magnet is weak."""

WEAKNESS = 0.3
"""Strength of a weak magnet relative to a sound one; both vary by `SPREAD`."""

SPREAD = 0.15
"""Largest relative deviation of the strength of a magnet."""

_TURNS = np.array([[1.0, 0.0, -1.0, 0.0], [0.0, 1.0, 0.0, -1.0]])  # cosines, sines


class TrayEpisodes(CameraEpisodes):
    """Episodes in which components are taken from trays and put back."""

    task_kind: ClassVar[type[Task]] = TrayTask
    store = TrayStore
    protocol: ClassVar[tuple[float, ...]] = (LATE, DEAD, WEAK, WEAKNESS, SPREAD)
    shown = 1
    has_true_strengths = False
    kept = (*CameraEpisodes.kept, "strengths", "places", "lies", "returned")

    def allocate(self) -> None:
        """Allocate the arrays of the episodes."""
        super().allocate()
        shape = self.count, self.setup.actions.parts
        self.poles: Floats = SIGNS[self.setup.patterns]
        """Outward poles of the components on the trays, (tasks, parts, 4)."""
        self.strengths: Floats = np.ones((*shape, 4))
        """Hidden factors of the strengths of the components' magnets, (m, parts, 4)."""
        self.places: Ints = np.zeros(shape, dtype=np.int64)
        """Positions of components in the order of feed, from 1; 0 on the tray, (m, parts)."""
        self.lies: Ints = np.zeros(shape, dtype=np.int64)
        """Orientations of the components that are out, (m, parts)."""
        self.returned: Ints = np.zeros(shape, dtype=np.int64)
        """Number of times that each component was drawn back, (m, parts)."""

    @classmethod
    def spaces(cls, setup: TaskSetup, options: FeedOptions) -> tuple[TrayTable, Layout]:
        """Return the encoding of actions and the layout of observations."""
        scene = feedable(setup.scene, "component")
        n, sizes = scene.n, sorted({len(task.tray) for task in setup.tasks})
        if len(sizes) != 1:
            raise ValueError(f"tasks: trays of {sizes} components are not allowed; must be equal")
        (parts,), kind = sizes, options.get("actions", "multidiscrete")
        before = {
            "target": 3 * (n - 1),
            "tray": 4 * parts,
            "place": parts,
            "lie": 3 * parts,
            "returned": parts,
            "magnets": 4 * n,
            "direction": 1,
        }
        layout = camera_layout(n, scene.casing.side, before, {"speed": 1, "force": 1, "time": 1})
        return TrayTable(parts, options.get("speeds", 5), kind), layout

    @classmethod
    def physics_size(cls, setup: TaskSetup) -> int:
        """Return how many entries `physics` has."""
        return super().physics_size(setup) + 4 * setup.actions.parts

    def physics(self) -> Floats:
        """Return the hidden draws, each scaled to [−1, 1], (m, entries)."""
        strengths = self.strengths.reshape(self.count, -1)
        return np.hstack([super().physics(), np.clip(strengths - 1.0, -1.0, 1.0)])

    @property
    def late(self) -> float:
        """Time limit [s]."""
        return LATE

    def times(self, rows: Ints) -> Floats:
        """Return the elapsed times of the given episodes [s]."""
        return self.chains.times(rows)

    def may_draw_back(self) -> Bools:
        """Return in which episodes the last component can be drawn back; the first one cannot."""
        return self.arrays.fed > 1

    def action_masks(self, actions: Any) -> NDArray[np.bool_]:
        """Return which actions of the table `actions` are possible; see `TrayTable.masks`."""
        return actions.masks(self.places == 0, self.may_draw_back())

    def groups(self) -> dict[str, Any]:
        """Return the entries of observations by group, except those that the camera measures."""
        lies, tray = self.lies, self.poles[self.numbers]
        out, side = self.places > 0, np.where(lies < 4, 1.0, -1.0)
        along, across = (table[lies % 4] for table in _TURNS)
        lie = out[:, :, None] * np.stack([side, along, across], axis=2)
        return super().groups() | {
            "tray": tray.reshape(self.count, -1),
            "place": self.places / self.n,
            "lie": lie.reshape(self.count, -1),
            "returned": self.returned / (1.0 + self.returned),
        }

    def prepare(self, rows: Ints) -> None:
        """Put all components on their trays and draw random strengths for their magnets."""
        for row in rows.tolist():
            self.strengths[row] = self._drawn_strengths(int(self.numbers[row]), self.rngs[row])
        self.places[rows] = self.lies[rows] = self.returned[rows] = 0

    def _drawn_strengths(self, number: int, rng: Any) -> Floats:
        """Draw the factors of the strengths of a tray's magnets, (parts, 4).

        The number of draws is the same for every task, so that a seed gives the same physics.
        """
        kind, spread = rng.random((2, *self.strengths.shape[1:]))
        given = self.setup.tasks[number].strengths
        if given is not None:
            return np.array(given)
        if self.setup.randomisation == "none":
            return np.ones_like(kind)
        weak = np.where(kind < DEAD + WEAK, WEAKNESS, 1.0)
        return np.where(kind < DEAD, 0.0, weak * (1.0 + SPREAD * (2.0 * spread - 1.0)))

    def act(self, rows: Ints, choice: TrayChoice) -> None:
        """Feed a component of each tray, or draw the last component back into the tube."""
        parts, lies, speeds, way = choice
        back = (way == BACK) & self.may_draw_back()[rows]
        began, before = self.times(rows), self.chains.impulses(rows)
        self.speeds[rows] = np.where(back, -speeds, speeds)
        if back.any():
            self._draw_back(rows[back], speeds[back])
        ahead = ~back
        if ahead.any():
            self._feed(rows[ahead], parts[ahead], lies[ahead], speeds[ahead])
        self._took[rows] = took = self.times(rows) - began
        force = (self.chains.impulses(rows) - before) / np.maximum(took, 1e-9)
        self._measure(rows, np.where(self.arrays.status[rows] == FAILED, 0.0, force))
        self._stop_late(rows)

    def _feed(self, rows: Ints, parts: Ints, lies: Ints, speeds: Floats) -> None:
        """Feed components; if one is already out, feed the next one on the tray, cyclically."""
        there = self.places[rows] == 0
        parts = parts.copy()
        for k in np.flatnonzero(~there[np.arange(len(rows)), parts]).tolist():
            on = np.roll(there[k], -parts[k]).argmax()
            parts[k] = (parts[k] + on) % len(there[k])
        self.places[rows, parts] = self.arrays.fed[rows] + 1
        self.lies[rows, parts] = lies
        patterns = LYING[self.setup.patterns[self.numbers[rows], parts], lies][:, None]
        grades = np.take_along_axis(self.strengths[rows, parts], FACES[lies], axis=1)
        scaled, until = scaled_speeds(speeds), self._until(rows, speeds)
        self.chains.feed(rows, patterns, speeds, scaled, grades, until)

    def _until(self, rows: Ints, speeds: Floats) -> float | Floats:
        """Return the times [s] at which feeds pause if the next component is not out yet."""
        return self.late

    def _draw_back(self, rows: Ints, speeds: Floats) -> None:
        """Draw back the last components that are out and put them on the trays."""
        self.chains.draw_back(rows, speeds, self.late)
        back = self.places[rows] > self.arrays.fed[rows, None]
        self.returned[rows] += back
        self.places[rows] = np.where(back, 0, self.places[rows])


class TrayEnv(CameraTrackEnv):
    """Build a chain from the components of a tray, with the option to put some back.

    `reset` selects a task: a tray of components, a feed direction and a target. It draws and hides
    which magnets are dead (15 %) or weak (10 %, at 0.3 of their strength), the strength of each
    magnet (±15 %) and of all together (±10 %), the friction of the floor (±30 %), and the offsets
    of the hinges in the tube. Magnets act only outside the tube, as in ``MagFold/TubeFeed-v0``.

    A step takes a component from the tray, orients it, and feeds it out by one diagonal at the
    chosen speed. Or it draws the last component back by one diagonal and returns it to the tray.
    That component then has no magnets, even if the tube does not hold it again and it lies askew.
    The first component cannot be drawn back, because the pusher is at its stop. The component that
    completes the chain cannot either: once it is out, the chain settles in the same step.

    **End**: when all components are out and at rest; when the drive, limited to 10 N, has slipped
    for 0.1 s (status ``jammed``); after 10 s of simulated time (``unsettled``); or when the
    simulation breaks down. Each of these terminates the episode, because the time is part of the
    task.

    **Action**: ``MultiDiscrete([parts, 8, speeds, 2])``: the component, by its position on the
    tray; its orientation, 0 to 3 quarter turns, then the same turned over
    (`magfold_env.envs.spaces.actions.FACES`); the speed level, log-spaced from 0.03 to 0.6 m/s; and
    0 to feed, or 1 to draw back at that speed, which ignores the first two numbers. If the
    component is already out, the next one on the tray is fed instead, cyclically. If nothing can be
    drawn back, a component is fed. `action_masks` excludes both cases. ``actions="discrete"``
    encodes the same in one number.

    **Observation**: ``12 n + 1 + 9 parts`` entries: ``target``, then the groups below, with
    ``magnets`` and ``direction`` before ``seen``, ``heading`` and ``position`` after it, and
    ``speed`` and ``force`` before ``time``. Components on the tray are in the tray's order.

    ======== ======= ================================================================== ========
    group    entries meaning and unit                                                   range
    ======== ======= ================================================================== ========
    tray     4 parts nominal poles of each component before it is turned, front-left,   −1, 1
                     back-left, back-right, front-right: 1 for N, −1 for S
    place    parts   position in the order of feed, divided by n; 0 on the tray         [0, 1]
    lie      3 parts 1 or −1 for the side that is up, cosine and sine of the turn; 0    −1, 0, 1
                     on the tray
    returned parts   number of times that the component was drawn back, as x / (1 + x)  [0, 1)
    seen     n       1 if the camera sees a component: the tube does not hold it and    0, 1
                     its centre is outside
    time     1       elapsed time, in units of 10 s                                     [0, 1]
    ======== ======= ================================================================== ========

    `magfold_env.envs.camera_track.CameraTrackEnv` describes the other groups.

    **Reward** and **info** are those of that class. b is the score of the minimiser's chain from
    the tray at its best constant speed (`magfold_env.envs.baselines.tray_order`).

    Arguments are those of `magfold_env.envs.camera_track.CameraTrackEnv`. In the scene,
    ``feed.loading`` must be ``at_mouth``.
    """

    make_episodes = TrayEpisodes
    default_scene: ClassVar[str] = "tray"
    default_tasks: ClassVar[str] = "trays-6"

    def action_masks(self) -> NDArray[np.bool_]:
        """Return which actions are possible; see `TrayTable.masks`."""
        return cast("TrayEpisodes", self._running()).action_masks(self.actions)[0]


TrayVectorEnv = ChainVectorEnv[Any].of(TrayEnv)
