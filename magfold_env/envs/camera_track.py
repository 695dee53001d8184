"""Base classes of the tracks: tasks with hidden physics, seen by a camera and a force sensor."""

from abc import abstractmethod
from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar, Unpack, cast

import numpy as np
from numpy.typing import NDArray

from magfold_env.envs.baselines.baseline import Baseline
from magfold_env.envs.baselines.constant_speed import Plan, TaskStore
from magfold_env.envs.chain_env import ChainEnv
from magfold_env.envs.chains.arrays import UNSETTLED, Floats, Ints
from magfold_env.envs.chains.dynamic import DynamicChains, hidden_places
from magfold_env.envs.chains.lattice import LatticeFeed
from magfold_env.envs.episodes import Columns, Episodes, Lines
from magfold_env.envs.pictures.snapshots import or_dash
from magfold_env.envs.pictures.viewer import RENDER_MODES
from magfold_env.envs.spaces.actions import FASTEST, SpeedTable, signs_of
from magfold_env.envs.spaces.observation import Layout, camera_layout, squash, take_frames
from magfold_env.envs.tasks.feed_tasks import FeedTask, Task
from magfold_env.envs.tasks.setup import FeedOptions, TaskSetup
from magfold_env.scene import Scene

TIME_COST = 0.02
"""Amount by which each simulated second reduces the reward."""

FORCE_NOISE = 0.01
"""Standard deviation of a measured force [N]."""

FORCE_SCALE = 0.1
"""Force that an observation encodes as 0.5 [N]."""

INTERVAL = 0.02
"""Time between two decisions [s]."""

STEEPEST = 0.2
"""Largest change of the feed speed from one step to the next [m/s]."""


class CameraEpisodes(Episodes[NDArray[np.float32]]):
    """Episodes of tasks that a camera observes."""

    setup: TaskSetup
    chains: DynamicChains
    task_kind: ClassVar[type[Task]]
    """Type of the tasks."""
    store: ClassVar[type[TaskStore]]
    """Class that computes and stores the baselines."""
    protocol: ClassVar[tuple[float, ...]]
    """Constants, besides the scene, on which the baselines depend."""
    lacking: ClassVar[str] = "not at rest and all out"
    """Text in the message about a timeout, saying what the chain did not achieve."""
    shown: ClassVar[int]
    """Camera frame that an observation shows: 1 for the newest, 0 for the one before; exact frames
    are always the newest."""

    kept = (*Episodes.kept, "_frames", "_force", "_took", "_noise", "speeds")

    def allocate(self) -> None:
        """Allocate the arrays of the episodes."""
        super().allocate()
        # The frame before the newest, and the newest.
        self._frames: Floats = np.zeros((2, self.count, 5 * self.n))
        self._force: Floats = np.zeros(self.count)
        self._took: Floats = np.zeros(self.count)  # duration of the last steps [s]
        # Noise has its own generators, so later draws do not depend on the number of steps.
        self._noise: list[Any] = [None] * self.count
        self.speeds: Floats = np.zeros(self.count)
        """Feed speeds in the last step [m/s], (m,); negative speeds pull back."""

    @classmethod
    @abstractmethod
    def spaces(cls, setup: TaskSetup, options: FeedOptions) -> tuple[Any, Layout]:
        """Return the encoding of actions and the layout of observations."""

    @classmethod
    def physics_size(cls, setup: TaskSetup) -> int:
        """Return how many entries `physics` has."""
        return len(hidden_places(setup.scene))

    def physics(self) -> Floats:
        """Return the hidden draws, each scaled to [−1, 1], (m, entries)."""
        return self.chains.hidden()

    def make_chains(self, threads: int, frame_rate: float | None) -> DynamicChains:
        """Return the chains, each drawn from the scene of its task."""
        templates = self.setup.templates
        return DynamicChains(templates, self.count, threads, frame_rate, endless=True)

    def lattice(self, row: int) -> LatticeFeed:
        """Return the rules by which energy minimisation folds a chain."""
        return self.setup.lattices[self.setup.kinds[int(self.numbers[row])]]

    @classmethod
    def baselines(cls, setup: TaskSetup) -> TaskStore:
        """Return the store of the baselines of a setup's tasks, set by simple schedules."""
        return cls.store(cls, setup, cls.protocol)

    def find_baseline(self, number: int) -> Baseline:
        """Return the baseline of a task; a flagged one unless the reward uses it."""
        if self.setup.rule.kind != "relative":
            return super().find_baseline(number)
        store = self.baselines(self.setup)
        return store.get(store.names[number])

    @property
    @abstractmethod
    def late(self) -> float:
        """Time limit [s]."""

    @abstractmethod
    def times(self, rows: Ints) -> Floats:
        """Return the elapsed times of the given episodes [s]."""

    def infos(self, rows: Ints) -> Columns:
        """Return the infos of the given episodes, running or ended."""
        return super().infos(rows) | {"time": self.times(rows), "force": self._force[rows]}

    def step_rewards(self, rows: Ints) -> Floats:
        """Return the rewards of a step, reduced by the cost of its duration."""
        return super().step_rewards(rows) - TIME_COST * self._took[rows]

    def final_infos(self, rows: Ints) -> Columns:
        """Return additional infos of episodes that have terminated."""
        ends = super().final_infos(rows)
        late = self.arrays.status[rows] == UNSETTLED
        return ends | {"score": np.where(late, 0.0, ends["score"])}

    def observe(self) -> NDArray[np.float32]:
        """Return new observations, (m, size)."""
        layout, sight = self.setup.layout, self.setup.sight
        out = np.empty((self.count, layout.size), dtype=np.float32)
        for name, entries in self.groups().items():
            out[:, layout.slices[name]] = entries
        if "physics" in layout.sizes:
            out[:, layout.slices["physics"]] = self.physics()
        out[:, layout.frame] = self._frames[1 if sight == "exact" else self.shown]
        if sight == "none":
            layout.hide(out)
        return out

    def groups(self) -> dict[str, Any]:
        """Return the entries of observations by group, except those that the camera measures."""
        return {
            "target": self.goals.one_hot,
            "magnets": self.arrays.signs.reshape(self.count, -1),
            "direction": np.where(self.arrays.forward, 1.0, -1.0)[:, None],
            "speed": self.speeds[:, None] / FASTEST,
            "force": [[squash(force / FORCE_SCALE)] for force in self._force.tolist()],
            "time": np.minimum(self.times(self.rows) / self.late, 1.0)[:, None],
        }

    def caption(self, row: int) -> tuple[str, Lines, Lines]:
        """Return the title of an episode's picture, and the text above and below its energies."""
        title, wanted, _ = super().caption(row)
        done: Lines = [
            ("time", f"{self.times(self.rows)[row]:.2f} s"),
            ("push", or_dash(float(self._force[row]), "mN")),
            ("feed speed", f"{1e3 * self.speeds[row]:.0f} mm/s"),
        ]
        return title, wanted, done

    def reset_rows(self, rows: Ints) -> None:
        """Draw random chains for the given episodes and put them into their tubes."""
        kinds = np.array(self.setup.kinds)[self.numbers[rows]]
        for kind in np.unique(kinds).tolist():
            self.chains.begin(rows[kinds == kind], self.rngs, kind)
        self.speeds[rows] = 0.0
        self.prepare(rows)
        for row in rows.tolist():
            self._noise[row] = np.random.default_rng(self.rngs[row].integers(2**63))
        self._frames[:, rows] = 0.0
        self._measure(rows, np.zeros(len(rows)))

    @abstractmethod
    def prepare(self, rows: Ints) -> None:
        """Initialise episodes whose chains are in their tubes."""

    def _stop_late(self, rows: Ints) -> None:
        """End the episodes that have reached the time limit."""
        over = (self.times(rows) >= self.late - 1e-9) & ~self.terminated[rows]
        self.chains.stop(rows[over], f"late: {self.lacking} after {self.late:g} s")

    def _measure(self, rows: Ints, force: Floats) -> None:
        """Record frames of the given chains and forces of their drives [N], with noise."""
        noise = np.zeros((len(rows), 3 * self.n + 1))
        if self.setup.sight != "exact":
            for place, row in enumerate(rows.tolist()):
                self._noise[row].standard_normal(out=noise[place])
        self._frames[0, rows] = self._frames[1, rows]
        side = self.setup.layout.side
        take_frames(side, rows, self.chains.seen, noise[:, 1:], self._frames[1])
        self._force[rows] = force + FORCE_NOISE * noise[:, 0]


class FeedEpisodes(CameraEpisodes):
    """Episodes in which given chains are fed at a speed that each step sets."""

    task_kind = FeedTask
    shown = 0
    horizon: ClassVar[int]
    """Number of steps allowed in an episode."""

    kept = (*CameraEpisodes.kept, "driven")

    def allocate(self) -> None:
        """Allocate the arrays of the episodes."""
        super().allocate()
        self.driven: Floats = np.zeros((self.count, self.horizon))
        """Feed speed in each step [m/s], (m, horizon)."""
        self._length = self.n * self.setup.scene.casing.diagonal

    @classmethod
    def spaces(cls, setup: TaskSetup, options: FeedOptions) -> tuple[SpeedTable, Layout]:
        """Return the encoding of actions and the layout of observations."""
        n = setup.scene.n
        before = {"target": 3 * (n - 1), "magnets": 4 * n, "direction": 1}
        after = {"advance": 1, "speed": 1, "force": 1, "time": 1}
        layout = camera_layout(n, setup.scene.casing.side, before, after)
        return SpeedTable(options.get("speeds", 5), options.get("actions", "box")), layout

    @property
    def late(self) -> float:
        """Time limit [s]."""
        return INTERVAL * self.horizon

    def scene(self, row: int) -> Scene:
        """Return the concrete scene drawn for a chain, with the drawn factors of feed speeds."""
        sequence = self.setup.tasks[int(self.numbers[row])].sequence
        return self.chains.drawn(row).replace(sequence=sequence)

    def acting(self, row: int) -> int:
        """Return how many components, counted in the order of feed, have magnets that act."""
        return self.chains.acting(row)

    def times(self, rows: Ints) -> Floats:
        """Return the elapsed times of the given episodes [s]."""
        return self.steps[rows].astype(np.float64) * INTERVAL

    def groups(self) -> dict[str, Any]:
        """Return the entries of observations by group, except those that the camera measures."""
        return super().groups() | {
            # Rounded; otherwise the last bits would reveal the initial offsets of the chain.
            "advance": np.round(self.chains.advances() / self._length, 9)[:, None],
            "time": self.steps[:, None] / self.horizon,
        }

    def caption(self, row: int) -> tuple[str, Lines, Lines]:
        """Return the title of an episode's picture, and the text above and below its energies."""
        _, wanted, done = super().caption(row)
        return f"{int(self.arrays.released[row].sum())} of {self.n} out", wanted, done

    def prepare(self, rows: Ints) -> None:
        """Set the magnets of chains in their tubes."""
        for row in rows.tolist():
            sequence = self.setup.tasks[int(self.numbers[row])].sequence
            signs = np.array([[signs_of(faces) for faces in sequence]])
            self.chains.load(self.rows[row : row + 1], signs)

    def act(self, rows: Ints, choice: tuple[Floats]) -> None:
        """Drive the feeds for one interval; `STEEPEST` limits how far their speeds change."""
        before = self.speeds[rows]
        speeds = before + np.clip(choice[0] - before, -STEEPEST, STEEPEST)
        self.speeds[rows], self._took[rows] = speeds, INTERVAL
        self.driven[rows, self.steps[rows] - 1] = speeds
        self._measure(rows, self.chains.push(rows, speeds, INTERVAL))
        self._stop_late(rows)


class CameraTrackEnv(ChainEnv[NDArray[np.float32]]):
    """Base class of environments with tasks; subclasses define the goal.

    **Observation**: a flat ``Box(−1, 1)``, in which the chain's entries start with component 1.
    Frames are not stacked. An environment has some of these groups, and some of its own.

    ========= ========= ======================================================== =============
    group     entries   meaning and unit                                         range
    ========= ========= ======================================================== =============
    target    3 (n − 1) letter of each joint of the target, one-hot over L, S, R 0, 1
    magnets   4 n       front-left, back-left, back-right, front-right:          −1, 0, 1
                        nominal poles, 1 for N, −1 for S; 0 if not set yet
    direction 1         feed direction: 1 forward, −1 backward                   −1, 1
    heading   2 n       sine and cosine of the heading, noise of 1°; 0 if the    [−1, 1]
                        camera does not see the component
    position  2 n       centre relative to the tube's mouth, in chain lengths,   (−1, 1) *
                        noise of 0.3 mm along x and y; 0 if unseen
    speed     1         feed speed in the last step, in units of 0.6 m/s         [−1, 1]
    force     1         mean force of the drive in the last step, in units of    (−1, 1) *
                        0.1 N, noise of 10 mN; negative if the drive pulls
    ========= ========= ======================================================== =============

    Entries marked * are squashed by ``x / (1 + |x|)``. Noise is normal, with the given
    standard deviations. Observations contain no velocities and, by default, none of the hidden
    draws.

    ``sight="exact"`` shows the newest frame and the force, both without noise. ``sight="none"``
    shows 0 in ``seen``, ``heading``, ``position``, ``force`` and ``borne``. Draws and physics are
    the same for all, and infos contain the force in any case.

    ``reveal="physics"`` appends the group ``physics``: what `reset` draws, except the initial
    offsets of hinges. −1 and 1 are the bounds of a spread, and 0 is its centre. The group contains
    only what varies in the scene (see `magfold_env.scene.Spreads`), in this order:

    =============== ======= ============================================================= =======
    spread          entries meaning                                                       range
    =============== ======= ============================================================= =======
    friction        1       friction; on a log scale for ``friction_decades``             [−1, 1]
    mass            n       mass of each component                                        [−1, 1]
    remanence       1       strength of all magnets together                              [−1, 1]
    feed_speed      1       ratio of actual to requested feed speed                       [−1, 1]
    feed_jitter     n       the same for each component                                   [−1, 1]
    magnet          4 n     strength of each magnet, ordered like ``magnets``             [−1, 1]
    obstacle_width  1       distance of the obstacles from the tube's axis                [−1, 1]
    obstacle_offset 1       offset of the obstacles along y                               [−1, 1]
    tilt            2       angle of the floor, where 0 is level, and its direction, in   [−1, 1]
                            units of π rad
    (trays)         4 parts factor of each magnet's strength, minus 1, ordered like       [−1, 1]
                            ``tray``: −1 is dead, 0 nominal; above 1 clipped
    =============== ======= ============================================================= =======

    **Reward**: the score at the end. It is 1 if the chain folds into the target, 0 if time runs out
    or the simulation breaks down, and else half the similarity to the target. ``reward="sparse"``
    gives 1 for the target, else 0. ``reward="relative"`` subtracts b, the score of a simple
    schedule. Each simulated second costs 0.02. `magfold_env.envs.tasks.reward` describes shaping.

    **Info**: ``target``, ``word``, ``time`` [s] and the measured ``force`` [N]; at the end also
    ``status``, ``message``, ``energy`` [J], ``score``, ``baseline``, ``baseline_missing`` (true
    unless the reward uses b) and ``is_success``.

    Parameters
    ----------
    scene : str, Path or Scene, optional
        A tube scene, by default the environment's own; its sequence, direction and speeds are
        ignored.
    render_mode : {"human", "rgb_array", "rgb_array_list", "ansi"}, optional
        What `render` returns; ``human`` shows every step in a window automatically.
    **options
        See `magfold_env.envs.tasks.setup.FeedOptions`.

    Raises
    ------
    ValueError
        If an argument has a value that is not allowed; the message names it and the allowed values.
    """

    make_episodes: ClassVar[type[CameraEpisodes]]
    default_scene: ClassVar[str]
    default_tasks: ClassVar[str]
    """Name of the default list of tasks."""

    setup: Any

    def __init__(
        self,
        scene: str | Path | Scene | None = None,
        *,
        render_mode: str | None = None,
        **options: Unpack[FeedOptions],
    ) -> None:
        super().__init__(self.make_setup(scene, **options), render_mode)

    @classmethod
    def make_setup(
        cls, scene: str | Path | Scene | None = None, **options: Unpack[FeedOptions]
    ) -> TaskSetup:
        """Return what all episodes share; arguments are those of the environment."""
        options.setdefault("tasks", cls.default_tasks)
        scene = cls.default_scene if scene is None else scene
        return TaskSetup(cls.make_episodes, scene, **options)

    @property
    def tasks(self) -> tuple[Any, ...]:
        """The tasks that `reset` draws from."""
        return self.setup.tasks

    @property
    def task(self) -> Task:
        """The task of this episode."""
        return self.tasks[int(self._running().numbers[0])]

    def baseline_of(self, task: int) -> Baseline:
        """Return the baseline of the task with a given number.

        This may take some seconds if neither the package nor the disk cache contains it.
        """
        store = self._baselines
        return store.get(store.names[self.setup.number_of(task)])

    def plan_of(self, numbers: Sequence[int]) -> Plan:
        """Return a function that plays the baseline schedule of each given task in its own row."""
        return self._baselines.plan(numbers)

    @property
    def _baselines(self) -> TaskStore:
        return self.make_episodes.baselines(self.setup)


class FeedTrackEnv(CameraTrackEnv):
    """Base class for feeding a given chain back and forth; subclasses define the goal.

    Arguments are those of `magfold_env.envs.camera_track.CameraTrackEnv`.
    """

    metadata = {"render_modes": list(RENDER_MODES), "render_fps": 50}  # noqa: RUF012

    @property
    def horizon(self) -> int:
        """Number of steps allowed in an episode."""
        return cast("type[FeedEpisodes]", self.make_episodes).horizon

    @property
    def history(self) -> tuple[float, ...]:
        """Feed speeds in all steps so far [m/s]; see `to_scene`."""
        episodes = cast("FeedEpisodes", self._running())
        return tuple(episodes.driven[0, : int(episodes.steps[0])].tolist())

    def to_scene(self) -> Scene:
        """Return the concrete scene of the episode.

        `replay` repeats the episode bit for bit from this scene and `history`. The scene's feed
        speeds include the drawn factors.
        """
        return self._running().scene(0)


def replay(scene: Scene, speeds: Sequence[float]) -> DynamicChains:
    """Repeat an episode bit for bit and return its chain.

    Parameters
    ----------
    scene : Scene
        The scene that `FeedTrackEnv.to_scene` returns.
    speeds : sequence of float
        The value of `FeedTrackEnv.history` [m/s].
    """
    chains, row = DynamicChains((scene,), 1, endless=True), np.array([0])
    chains.begin(row, [np.random.default_rng()])
    chains.drive_as(scene)
    chains.load(row, np.array([[signs_of(faces) for faces in scene.sequence]]))
    for speed in speeds:
        if chains.arrays.status[0] == 0:
            chains.push(row, np.array([speed]), INTERVAL)
    return chains
