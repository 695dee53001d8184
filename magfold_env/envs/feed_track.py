"""What tracks have in common whose chain is given and whose only action is the feed's speed."""

from collections.abc import Sequence
from typing import Any, ClassVar, cast

import numpy as np

from magfold_env.envs.camera_track import CameraEpisodes, CameraTrackEnv
from magfold_env.envs.chains.arrays import Floats, Ints
from magfold_env.envs.chains.draws import DrawnChains
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
"""Most that the drive changes its speed by from one step to the next [m/s]."""


class FeedEpisodes(CameraEpisodes):
    """Episodes in which given chains are fed at speeds that change from step to step."""

    task_kind = FeedTask
    shown = 0
    horizon: ClassVar[int]
    """Steps after which it is too late."""

    kept = (*CameraEpisodes.kept, "steps", "driven")

    def allocate(self) -> None:
        """Make the arrays that episodes keep."""
        super().allocate()
        self.steps: Ints = np.zeros(self.count, dtype=np.int64)
        """Number of steps taken in each episode, (m,)."""
        self.driven: Floats = np.zeros((self.count, self.horizon))
        """Feed speeds in each step [m/s]."""
        self._length = self.n * self.world.scene.casing.diagonal

    @classmethod
    def spaces(cls, world: TaskWorld, options: FeedOptions) -> tuple[SpeedTable, CameraLayout]:
        """Return how actions are written, and where entries of observations lie."""
        n = world.scene.n
        before = {"target": 3 * (n - 1), "magnets": 4 * n, "direction": 1}
        after = {"advance": 1, "speed": 1, "force": 1, "time": 1}
        layout = CameraLayout(n, world.scene.casing.side, before, after)
        return SpeedTable(options.get("speeds", 5), options.get("actions", "box")), layout

    @property
    def late(self) -> float:
        """Time after which it is too late [s]."""
        return INTERVAL * self.horizon

    def scene(self, row: int) -> Scene:
        """Return the drawn scene of a chain, whose feed speeds say what factors were drawn."""
        sequence = self.world.tasks[int(self.numbers[row])].sequence
        return self.chains.drawn.scene(row).replace(sequence=sequence)

    def acting(self, row: int) -> int:
        """Return how many components of a chain have magnets that act, in the order of feed."""
        return self.chains.acting(row)

    def times(self, rows: Ints) -> Floats:
        """Return for how long some episodes have gone on [s]."""
        return self.steps[rows].astype(np.float64) * INTERVAL

    def groups(self) -> dict[str, Any]:
        """Return the entries of observations, but for the frame, by their groups' names."""
        return super().groups() | {
            # Rounded, or last bits would tell how the chain lay at first.
            "advance": np.round(self.chains.advances() / self._length, 9)[:, None],
            "time": self.steps[:, None] / self.horizon,
        }

    def caption(self, row: int) -> tuple[str, Lines, Lines]:
        """Return how far an episode has come, and lines of a picture above and below energies."""
        _, wanted, done = super().caption(row)
        return f"{int(self.arrays.released[row].sum())} of {self.n} out", wanted, done

    def prepare(self, rows: Ints) -> None:
        """Give chains that are in their tubes their magnets."""
        self.steps[rows] = 0
        for row in rows.tolist():
            sequence = self.world.tasks[int(self.numbers[row])].sequence
            signs = np.array([[signs_of(faces) for faces in sequence]])
            self.chains.load(self.rows[row : row + 1], signs)

    def act(self, rows: Ints, choice: tuple[Floats]) -> None:
        """Drive the feeds for an interval, at speeds as near to those asked for as can be."""
        before = self.speeds[rows]
        speeds = before + np.clip(choice[0] - before, -STEEPEST, STEEPEST)
        self.speeds[rows], self._took[rows] = speeds, INTERVAL
        self.driven[rows, self.steps[rows]] = speeds
        self.steps[rows] += 1
        self._measure(rows, self.chains.push(rows, speeds, INTERVAL))
        self._stop_late(rows)


class FeedTrackEnv(CameraTrackEnv):
    """Feed a given chain, back and forth; what is wanted of it is left to subclasses.

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

        `replay` repeats the episode from it and `history`, bit for bit. The feed speeds in it hold
        the factors that were drawn.
        """
        return self._running().scene(0)


def replay(scene: Scene, speeds: Sequence[float]) -> DynamicChains:
    """Return the chain that `scene` and the feed speeds [m/s] lead to, bit for bit.

    Parameters
    ----------
    scene : Scene
        What `FeedTrackEnv.to_scene` returns.
    speeds : sequence of float
        What `FeedTrackEnv.history` is.
    """
    chains, row = DynamicChains(DrawnChains((scene,), 1, endless=True)), np.array([0])
    chains.begin(row, [np.random.default_rng()])
    chains.drawn.drive_as(scene)
    chains.load(row, np.array([[signs_of(faces) for faces in scene.sequence]]))
    for speed in speeds:
        if chains.arrays.status[0] == 0:
            chains.push(row, np.array([speed]), INTERVAL)
    return chains
