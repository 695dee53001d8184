"""``MagFold/Tray-v0``: fold a chain of components from a tray, some of whose magnets are bad."""

from pathlib import Path
from typing import Any, Unpack

import numpy as np
from numpy.typing import NDArray

from magfold_env.envs.baselines.tray_order import TrayStore
from magfold_env.envs.camera_track import TIME_COST, CameraEpisodes, CameraTrackEnv
from magfold_env.envs.chains.arrays import FAILED, Bools, Floats, Ints
from magfold_env.envs.episodes import Lines
from magfold_env.envs.spaces.actions import FASTEST, scaled_speeds
from magfold_env.envs.spaces.tray_actions import FACES, LYING, TrayChoice
from magfold_env.envs.tasks.feed_tasks import FeedOptions
from magfold_env.envs.tasks.forecast import or_dash
from magfold_env.envs.tasks.tray_tasks import TrayWorld
from magfold_env.envs.vector_env import ChainVectorEnv
from magfold_env.scene import Scene

LATE = 10.0
"""Time after which it is too late [s]."""

_TURNS = np.array([[1.0, 0.0, -1.0, 0.0], [0.0, 1.0, 0.0, -1.0]])  # cosines and sines


class TrayEpisodes(CameraEpisodes):
    """Episodes in which components are taken from trays, and put back."""

    shown = 1
    kept = (*CameraEpisodes.kept, "strengths", "places", "lies", "returned", "speeds", "_took")

    def __init__(
        self, world: TrayWorld, count: int, threads: int = 1, frame_rate: float | None = None
    ) -> None:
        super().__init__(world, count, threads, frame_rate)
        shape = count, world.actions.parts
        self.strengths: Floats = np.ones((*shape, 4))
        """What the strengths of components' magnets are multiplied by, which nobody is told."""
        self.places: Ints = np.zeros(shape, dtype=np.int64)
        """Places of components in the order of feed, from 1; 0 on the tray, (m, parts)."""
        self.lies: Ints = np.zeros(shape, dtype=np.int64)
        """How components that are out lie, (m, parts)."""
        self.returned: Ints = np.zeros(shape, dtype=np.int64)
        """How often each component was drawn back, (m, parts)."""
        self.speeds: Floats = np.zeros(count)
        """Speeds of the last steps [m/s], below 0 back, (m,)."""
        self._took: Floats = np.zeros(count)  # time of the last steps [s]

    @classmethod
    def baselines(cls, world: TrayWorld) -> TrayStore:
        """Return what the minimiser's chains make of the tasks of a world."""
        return TrayStore(TrayEpisodes, world, (LATE,))

    @property
    def late(self) -> float:
        """Time after which it is too late [s]."""
        return LATE

    def times(self, rows: Ints) -> Floats:
        """Return for how long some episodes have gone on [s]."""
        return self.chains.times(rows)

    def scene(self, row: int) -> Scene:
        """Return the drawn scene of a chain, with the magnets and speeds of components fed.

        It has the magnets as they should be.
        """
        return self.chains.scene(row)

    def acting(self, row: int) -> int:
        """Return how many components of a chain have magnets that act, in the order of feed."""
        return int(self.arrays.fed[row])

    def may_draw_back(self) -> Bools:
        """Return which episodes have a component that can be drawn back: the first one cannot."""
        return self.arrays.fed > 1

    def _groups(self) -> dict[str, Any]:
        world, lies = self.world, self.lies
        tray = world.poles[self.numbers]
        out, side = self.places > 0, np.where(lies < 4, 1.0, -1.0)
        along, across = (table[lies % 4] for table in _TURNS)
        lie = out[:, :, None] * np.stack([side, along, across], axis=2)
        return super()._groups() | {
            "tray": tray.reshape(self.count, -1),
            "place": self.places / world.scene.n,
            "lie": lie.reshape(self.count, -1),
            "returned": self.returned / (1.0 + self.returned),
            "speed": self.speeds[:, None] / FASTEST,
        }

    def _shown(self, row: int) -> tuple[str, Lines, Lines]:
        done: Lines = [
            ("time", f"{self.times(self.rows)[row]:.2f} s"),
            ("push", or_dash(float(self._force[row]), "mN")),
            ("feed speed", f"{1e3 * self.speeds[row]:.0f} mm/s"),
        ]
        wanted: Lines = [("target", self.goals.names[row])]
        return f"fed {self.arrays.fed[row]} of {self.world.scene.n}", wanted, done

    def _lay_out(self, rows: Ints) -> None:
        for row in rows.tolist():
            number = int(self.numbers[row])
            self.strengths[row] = self.world.strengths(number, self.rngs[row])
        self.places[rows] = self.lies[rows] = self.returned[rows] = 0
        self.speeds[rows] = 0.0

    def _act(self, rows: Ints, choice: TrayChoice) -> None:
        parts, lies, speeds, back = choice
        back = back & self.may_draw_back()[rows]
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
        self._give_up(rows)

    def _feed(self, rows: Ints, parts: Ints, lies: Ints, speeds: Floats) -> None:
        """Feed components, or the next ones on the tray, counted round, of those that are there."""
        there = self.places[rows] == 0
        nearest: Ints = (parts[:, None] + np.arange(there.shape[1])) % there.shape[1]
        near = np.take_along_axis(there, nearest, axis=1).argmax(axis=1)
        parts = nearest[np.arange(len(rows)), near]
        self.places[rows, parts] = self.arrays.fed[rows] + 1
        self.lies[rows, parts] = lies
        patterns = LYING[self.world.patterns[self.numbers[rows], parts], lies][:, None]
        grades = np.take_along_axis(self.strengths[rows, parts], FACES[lies], axis=1)
        self.chains.feed(rows, patterns, speeds, scaled_speeds(speeds), grades, self.late)

    def _draw_back(self, rows: Ints, speeds: Floats) -> None:
        """Draw the last components that are out back, and put them on the trays."""
        self.chains.draw_back(rows, speeds, self.late)
        back = self.places[rows] > self.arrays.fed[rows, None]
        self.returned[rows] += back
        self.places[rows] = np.where(back, 0, self.places[rows])

    def _step_rewards(self, rows: Ints) -> Floats:
        return super()._step_rewards(rows) - TIME_COST * self._took[rows]


class TrayEnv(CameraTrackEnv):
    """DOC"""

    make_episodes = TrayEpisodes

    def __init__(
        self,
        scene: str | Path | Scene = "tray",
        *,
        render_mode: str | None = None,
        **options: Unpack[FeedOptions],
    ) -> None:
        super().__init__(TrayWorld(scene, **options), render_mode)

    def action_masks(self) -> NDArray[np.bool_]:
        """Return which actions ask for what can be done; `TrayTable.masks`."""
        return _masks(self._running())[0]


class TrayVectorEnv(ChainVectorEnv[NDArray[np.float32]]):
    """Many of `TrayEnv`.

    Arguments are those of `magfold_env.envs.vector_env.ChainVectorEnv`.
    """

    single = TrayEnv

    def action_masks(self) -> NDArray[np.bool_]:
        """Return the masks of all environments, (m, …); `TrayEnv.action_masks`."""
        return _masks(self.episodes)


def _masks(episodes: Any) -> NDArray[np.bool_]:
    return episodes.world.actions.masks(episodes.places == 0, episodes.may_draw_back())
