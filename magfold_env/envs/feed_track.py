"""What the tracks share in which the chain is given and the only action is the feed speed."""

from collections.abc import Sequence
from typing import Any, ClassVar, cast

import numpy as np

from magfold_env.envs.camera_track import CameraEpisodes, CameraTrackEnv
from magfold_env.envs.chains.arrays import Floats, Ints
from magfold_env.envs.chains.dynamic import DynamicChains
from magfold_env.envs.episodes import Lines
from magfold_env.envs.pictures.viewer import RENDER_MODES
from magfold_env.envs.spaces.actions import SpeedTable, signs_of
from magfold_env.envs.spaces.observation import CameraLayout
from magfold_env.envs.tasks.feed_tasks import FeedOptions, FeedTask, TaskWorld
from magfold_env.scene import Scene

INTERVAL = 0.02
"""Time between two decisions [s]."""

STEEPEST = 0.2
"""Largest change of the drive's speed from one step to the next [m/s]."""


class FeedEpisodes(CameraEpisodes):
    """Episodes in which given chains are fed at speeds that change from step to step."""

    task_kind = FeedTask
    shown = 0
    horizon: ClassVar[int]
    """Number of steps allowed in an episode."""

    kept = (*CameraEpisodes.kept, "steps", "driven")

    def allocate(self) -> None:
        """Allocate the arrays of the episodes."""
        super().allocate()
        self.steps: Ints = np.zeros(self.count, dtype=np.int64)
        """Number of steps taken in each episode, (m,)."""
        self.driven: Floats = np.zeros((self.count, self.horizon))
        """Feed speeds in each step [m/s]."""
        self._length = self.n * self.world.scene.casing.diagonal

    @classmethod
    def spaces(cls, world: TaskWorld, options: FeedOptions) -> tuple[SpeedTable, CameraLayout]:
        """Return the form of actions and the layout of observations."""
        n = world.scene.n
        before = {"target": 3 * (n - 1), "magnets": 4 * n, "direction": 1}
        after = {"advance": 1, "speed": 1, "force": 1, "time": 1}
        layout = CameraLayout(n, world.scene.casing.side, before, after)
        return SpeedTable(options.get("speeds", 5), options.get("actions", "box")), layout

    @property
    def late(self) -> float:
        """Time limit [s]."""
        return INTERVAL * self.horizon

    def scene(self, row: int) -> Scene:
        """Return the drawn scene of a chain; its feed speeds contain the drawn factors."""
        sequence = self.world.tasks[int(self.numbers[row])].sequence
        return self.chains.drawn(row).replace(sequence=sequence)

    def acting(self, row: int) -> int:
        """Return the number of components, in the order of feed, whose magnets act."""
        return self.chains.acting(row)

    def times(self, rows: Ints) -> Floats:
        """Return the elapsed time of some episodes [s]."""
        return self.steps[rows].astype(np.float64) * INTERVAL

    def groups(self) -> dict[str, Any]:
        """Return the entries of observations by group, without the camera's frame."""
        return super().groups() | {
            # Rounded; otherwise the last bits would reveal the initial offsets of the chain.
            "advance": np.round(self.chains.advances() / self._length, 9)[:, None],
            "time": self.steps[:, None] / self.horizon,
        }

    def caption(self, row: int) -> tuple[str, Lines, Lines]:
        """Return an episode's progress, and the lines above and below the energies in a picture."""
        _, wanted, done = super().caption(row)
        return f"{int(self.arrays.released[row].sum())} of {self.n} out", wanted, done

    def prepare(self, rows: Ints) -> None:
        """Set the magnets of chains in their tubes."""
        self.steps[rows] = 0
        for row in rows.tolist():
            sequence = self.world.tasks[int(self.numbers[row])].sequence
            signs = np.array([[signs_of(faces) for faces in sequence]])
            self.chains.load(self.rows[row : row + 1], signs)

    def act(self, rows: Ints, choice: tuple[Floats]) -> None:
        """Drive the feeds for an interval, at speeds as close to the requested ones as possible."""
        before = self.speeds[rows]
        speeds = before + np.clip(choice[0] - before, -STEEPEST, STEEPEST)
        self.speeds[rows], self._took[rows] = speeds, INTERVAL
        self.driven[rows, self.steps[rows]] = speeds
        self.steps[rows] += 1
        self._measure(rows, self.chains.push(rows, speeds, INTERVAL))
        self._stop_late(rows)


class FeedTrackEnv(CameraTrackEnv):
    """Feed a given chain back and forth; subclasses define the goal.

    Arguments are those of `magfold_env.envs.camera_track.CameraTrackEnv`.
    """

    metadata = {"render_modes": list(RENDER_MODES), "render_fps": 50}  # noqa: RUF012

    @property
    def history(self) -> tuple[float, ...]:
        """The speeds of the feed so far [m/s]; with `to_scene` they replay the episode."""
        episodes = cast("FeedEpisodes", self._running())
        return tuple(episodes.driven[0, : int(episodes.steps[0])].tolist())

    def to_scene(self) -> Scene:
        """Return the concrete scene of the episode.

        `replay` repeats the episode from it and `history`, bit for bit. Its feed speeds contain the
        drawn factors.
        """
        return self._running().scene(0)


def replay(scene: Scene, speeds: Sequence[float]) -> DynamicChains:
    """Simulate `scene` with the given feed speeds [m/s] and return the chain, bit for bit.

    Parameters
    ----------
    scene : Scene
        The scene that `FeedTrackEnv.to_scene` returns.
    speeds : sequence of float
        The value of `FeedTrackEnv.history`.
    """
    chains, row = DynamicChains((scene,), 1, endless=True), np.array([0])
    chains.begin(row, [np.random.default_rng()])
    chains.drive_as(scene)
    chains.load(row, np.array([[signs_of(faces) for faces in scene.sequence]]))
    for speed in speeds:
        if chains.arrays.status[0] == 0:
            chains.push(row, np.array([speed]), INTERVAL)
    return chains
