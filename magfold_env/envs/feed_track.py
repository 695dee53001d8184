"""What tracks have in common whose chain is given and whose only action is the feed's speed."""

from abc import abstractmethod
from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from magfold_env.envs.baselines.baseline import Baseline, unknown_baseline
from magfold_env.envs.baselines.constant_speed import Plan, SpeedStore
from magfold_env.envs.chain_env import ChainEnv
from magfold_env.envs.chains.arrays import Floats, Ints
from magfold_env.envs.chains.draws import DrawnChains
from magfold_env.envs.chains.dynamic import DynamicChains
from magfold_env.envs.chains.lattice import LatticeFeed
from magfold_env.envs.episodes import Columns, Episodes, Lines
from magfold_env.envs.pictures.viewer import RENDER_MODES
from magfold_env.envs.spaces.actions import FASTEST, SpeedTable, signs_of
from magfold_env.envs.spaces.observation import squash
from magfold_env.envs.tasks.feed_tasks import FeedTask, FeedWorld
from magfold_env.envs.tasks.forecast import or_dash
from magfold_env.scene import Scene

INTERVAL = 0.02
"""Time between two decisions [s]."""

STEEPEST = 0.2
"""Most that the drive changes its speed by from one step to the next [m/s]."""

TIME_COST = 0.02
"""What a second costs."""

FORCE_NOISE = 0.01
"""Standard deviation of a measured force [N]."""

FORCE_SCALE = 0.1
"""Force that is shown as one half [N]."""


class FeedEpisodes(Episodes[NDArray[np.float32]]):
    """Episodes in which given chains are fed at speeds that change from step to step."""

    world: FeedWorld
    chains: DynamicChains
    horizon: ClassVar[int]
    """Steps after which it is too late."""

    kept = (*Episodes.kept, "steps", "driven", "_frames", "_force")

    def __init__(
        self, world: FeedWorld, count: int, threads: int = 1, frame_rate: float | None = None
    ) -> None:
        super().__init__(world, count, threads)
        self.steps: Ints = np.zeros(count, dtype=np.int64)
        """Number of steps taken in each episode, (m,)."""
        self.driven: Floats = np.zeros((count, self.horizon))
        """Feed speeds in each step [m/s]."""
        width = sum(world.layout.frame_sizes.values())
        self._frames: Floats = np.zeros((2, count, width))  # the last but one, and the last
        self._force: Floats = np.zeros(count)

    def _make_chains(self, threads: int, frame_rate: float | None) -> DynamicChains:
        return DynamicChains(DrawnChains(self.world.templates, self.count, threads, endless=True))

    def scene(self, row: int) -> Scene:
        """Return the drawn scene of a chain, whose feed speeds say what factors were drawn."""
        sequence = self.world.tasks[int(self.numbers[row])].sequence
        return self.chains.drawn_scene(row).replace(sequence=sequence)

    def acting(self, row: int) -> int:
        """Return how many components of a chain have magnets that act, in the order of feed."""
        return self.chains.acting(row)

    def lattice(self, row: int) -> LatticeFeed:
        """Return what energy minimisation needs to know of a chain."""
        return self.world.lattice(int(self.numbers[row]))

    @classmethod
    @abstractmethod
    def baselines(cls, world: FeedWorld) -> SpeedStore:
        """Return what simple schedules make of the tasks of a world."""

    def find_baseline(self, number: int) -> Baseline:
        """Return what simple schedules make of a task, if the reward asks for it."""
        if self.world.rule.kind != "relative":
            return unknown_baseline(self.world.words[number])
        store = self.baselines(self.world)
        return store.get(store.names[number])

    def told(self, rows: Ints) -> Columns:
        """Return the info of some episodes: the little there is on their way."""
        return {
            "target": self.goals.names[rows],
            "word": self.words(rows),
            "time": INTERVAL * self.steps[rows],
            "force": self._force[rows],
        }

    def observe(self) -> NDArray[np.float32]:
        """Return new observations, (m, size)."""
        layout = self.world.layout
        out = np.empty((self.count, layout.size), dtype=np.float32)
        for name, entries in self._groups().items():
            out[:, layout.slices[name]] = entries
        out[:, layout.frame] = self._frames[0]
        return out

    def _groups(self) -> dict[str, Any]:
        """Return the entries of observations, but for the frame, by their groups' names."""
        layout, arrays = self.world.layout, self.arrays
        length = layout.n * self.world.scene.casing.diagonal
        return {
            "target": self.goals.one_hot,
            "magnets": arrays.signs.reshape(self.count, -1),
            "direction": np.where(arrays.forward, 1.0, -1.0)[:, None],
            # Rounded, or last bits would tell how the chain lay at first.
            "advance": np.round(self.chains.advances() / length, 9)[:, None],
            "speed": self._speeds(self.rows)[:, None] / FASTEST,
            "force": [[squash(force / FORCE_SCALE)] for force in self._force.tolist()],
            "time": self.steps[:, None] / self.horizon,
        }

    def _shown(self, row: int) -> tuple[str, Lines, Lines]:
        step, out = int(self.steps[row]), int(self.arrays.released[row].sum())
        done: Lines = [
            ("time", f"{INTERVAL * step:.2f} s"),
            ("push", or_dash(float(self._force[row]), "mN")),
            ("feed speed", f"{1e3 * self._speeds(self.rows)[row]:.0f} mm/s"),
        ]
        wanted: Lines = [("target", self.goals.names[row])]
        return f"{out} of {self.world.scene.n} out", wanted, done

    def _load(self, rows: Ints) -> None:
        self.steps[rows] = 0
        kinds = np.array(self.world.kinds)[self.numbers[rows]]
        for kind in np.unique(kinds).tolist():
            self.chains.begin(rows[kinds == kind], self.rngs, kind)
        for row in rows.tolist():
            sequence = self.world.tasks[int(self.numbers[row])].sequence
            signs = np.array([[signs_of(faces) for faces in sequence]])
            self.chains.load(self.rows[row : row + 1], signs)
        self._frames[:, rows] = 0.0
        self._measure(rows, np.zeros(len(rows)))

    def _act(self, rows: Ints, choice: tuple[Floats]) -> None:
        before = self._speeds(rows)
        speeds = before + np.clip(choice[0] - before, -STEEPEST, STEEPEST)
        self.driven[rows, self.steps[rows]] = speeds
        self.steps[rows] += 1
        self._measure(rows, self.chains.push(rows, speeds, INTERVAL))
        late = rows[(self.steps[rows] == self.horizon) & ~self.terminated[rows]]
        self.chains.give_up(
            late, f"late: not at rest and all out after {INTERVAL * self.horizon:g} s"
        )

    def _step_rewards(self, rows: Ints) -> Floats:
        return super()._step_rewards(rows) - TIME_COST * INTERVAL

    def _speeds(self, rows: Ints) -> Floats:
        """Return the feed speeds of some episodes in their last steps [m/s]."""
        last = self.steps[rows] - 1
        return np.where(last < 0, 0.0, self.driven[rows, last])

    def _measure(self, rows: Ints, force: Floats) -> None:
        """Take frames of some chains, and note the force of their drives [N], all with noise.

        It is drawn after everything else, so that a seed gives the physics that it gives without.
        """
        noises = 3 * self.world.layout.n + 1
        noise = np.empty((len(rows), noises))
        for place, row in enumerate(rows.tolist()):
            self.rngs[row].standard_normal(out=noise[place])
        self._frames[0, rows] = self._frames[1, rows]
        self.world.layout.take(rows, self.arrays, noise[:, 1:], self._frames[1])
        self._force[rows] = force + FORCE_NOISE * noise[:, 0]


class FeedTrackEnv(ChainEnv[NDArray[np.float32]]):
    """Feed a given chain, forth and back; what is wanted of it is left to subclasses.

    Parameters
    ----------
    world : FeedWorld
        The tasks and what episodes share.
    render_mode : {"human", "rgb_array", "ansi"}, optional
        What `render` returns.
    """

    metadata = {"render_modes": list(RENDER_MODES), "render_fps": 50}  # noqa: RUF012
    world: FeedWorld

    @property
    def tasks(self) -> tuple[FeedTask, ...]:
        """The tasks that `reset` draws from."""
        return self.world.tasks

    @property
    def actions(self) -> SpeedTable:
        """How actions are read."""
        return self.world.actions

    @property
    def task(self) -> FeedTask:
        """The task of this episode."""
        return self.tasks[int(self._running().numbers[0])]

    def baseline_of(self, task: int) -> Baseline:
        """Return what simple schedules make of a task, by its number.

        May take some seconds where neither the package nor the disk cache has it.
        """
        store = self._baselines
        return store.get(store.names[self.world.number_of(task)])

    def plan_of(self, baselines: Sequence[Baseline]) -> Plan:
        """Return what plays the schedules that set some baselines, each in a row of episodes."""
        return self._baselines.plan(baselines)

    @property
    def _baselines(self) -> SpeedStore:
        episodes: Any = self.episodes
        return episodes.baselines(self.world)

    @property
    def history(self) -> tuple[float, ...]:
        """The speeds of the feed so far [m/s]; with `to_scene` they replay the episode."""
        episodes = self._running()
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
