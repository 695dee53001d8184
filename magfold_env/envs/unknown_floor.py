"""``MagFold/UnknownFloor-v0``: feed a given chain, forth and back, over a floor unknown."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Unpack

import numpy as np
from numpy.typing import NDArray

from magfold_env.envs.baselines.baseline import Baseline, unknown_baseline
from magfold_env.envs.baselines.constant_speed import ConstantSpeedStore
from magfold_env.envs.chain_env import ChainEnv
from magfold_env.envs.chains.arrays import UNSETTLED, Floats, Ints
from magfold_env.envs.chains.draws import REFERENCE_SPEED, DrawnChains
from magfold_env.envs.chains.dynamic import DynamicChains
from magfold_env.envs.chains.lattice import LatticeFeed
from magfold_env.envs.episodes import Columns, Episodes, Lines
from magfold_env.envs.pictures.viewer import RENDER_MODES
from magfold_env.envs.spaces.actions import FASTEST, SpeedTable, signs_of
from magfold_env.envs.spaces.observation import squash
from magfold_env.envs.tasks.feed_tasks import FeedOptions, FeedTask, FeedWorld
from magfold_env.envs.tasks.forecast import or_dash
from magfold_env.envs.vector_env import ChainVectorEnv
from magfold_env.scene import Scene

INTERVAL = 0.02
"""Time between two decisions [s]."""

HORIZON = 250
"""Steps after which it is too late: 5 s."""

STEEPEST = 0.2
"""Most that the drive changes its speed by from one step to the next [m/s]."""

TIME_COST = 0.02
"""What a second costs."""

FORCE_NOISE = 0.01
"""Standard deviation of a measured force [N]."""

FORCE_SCALE = 0.1
"""Force that is shown as one half [N]."""


class FloorEpisodes(Episodes[NDArray[np.float32]]):
    """Episodes in which given chains are fed at speeds that change from step to step."""

    world: FeedWorld
    chains: DynamicChains
    kept = (*Episodes.kept, "steps", "driven", "_frames", "_force")

    def __init__(
        self, world: FeedWorld, count: int, threads: int = 1, frame_rate: float | None = None
    ) -> None:
        super().__init__(world, count, threads)
        self.steps: Ints = np.zeros(count, dtype=np.int64)
        """Number of steps taken in each episode, (m,)."""
        self.driven: Floats = np.zeros((count, HORIZON))
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

    def find_baseline(self, number: int) -> Baseline:
        """Return what the best constant speed makes of a task, if the reward asks for it."""
        if self.world.rule.kind != "relative":
            return unknown_baseline(self.world.words[number])
        store = constant_speeds(self.world)
        return store.get(store.names[number])

    def told(self, rows: Ints) -> Columns:
        """Return the info of some episodes: the little there is on their way."""
        return {
            "target": self.goals.names[rows],
            "word": self.words(rows),
            "time": INTERVAL * self.steps[rows],
            "force": self._force[rows],
        }

    def told_at_end(self, rows: Ints) -> Columns:
        """Return what is told besides of episodes that have terminated."""
        ends = super().told_at_end(rows)
        late = self.arrays.status[rows] == UNSETTLED
        return ends | {"score": np.where(late, 0.0, ends["score"])}

    def observe(self) -> NDArray[np.float32]:
        """Return new observations, (m, size)."""
        layout, arrays = self.world.layout, self.arrays
        out = np.empty((self.count, layout.size), dtype=np.float32)
        length = layout.n * self.world.scene.casing.diagonal
        groups: dict[str, Any] = {
            "target": self.goals.one_hot,
            "magnets": arrays.signs.reshape(self.count, -1),
            "direction": np.where(arrays.forward, 1.0, -1.0)[:, None],
            # Rounded, or last bits would tell how the chain lay at first.
            "advance": np.round(self.chains.advances() / length, 9)[:, None],
            "speed": self._speeds(self.rows)[:, None] / FASTEST,
            "force": [[squash(force / FORCE_SCALE)] for force in self._force.tolist()],
            "time": self.steps[:, None] / HORIZON,
        }
        for name, entries in groups.items():
            out[:, layout.slices[name]] = entries
        out[:, layout.frame] = self._frames[0]
        return out

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
        late = rows[(self.steps[rows] == HORIZON) & ~self.terminated[rows]]
        self.chains.give_up(late, f"late: not at rest and all out after {INTERVAL * HORIZON:g} s")

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


def constant_speeds(world: FeedWorld) -> ConstantSpeedStore:
    """Return what the best constant speeds make of the tasks of a world."""
    return ConstantSpeedStore(FloorEpisodes, world, (INTERVAL, HORIZON, STEEPEST))


class UnknownFloorEnv(ChainEnv[NDArray[np.float32]]):
    """Feed a chain, forth and back, so that it folds into a target on a floor that is not known.

    `reset` picks a task: a sequence, the direction of its feed, the fold to reach; and draws what
    stays hidden: the floor's friction, evenly on a scale of powers from 0.05 to 1, the strength of
    all magnets ±30 % and of each ±15 %, and how the chain lies in its tube. Every step says how
    fast the feed goes for the next 20 ms. Components that it draws in again may be held again.

    **End**: when the chain is all out and at rest; when the drive has slipped for 0.1 s (status
    ``jammed``); after 5 s, 250 steps (``unsettled``); or when the simulation breaks down. All of
    them terminate the episode: the time is the task's own.

    **Action**: ``Box(−1, 1, (1,))``: x asks for the speed 0.6 m/s · x |x|, negative back, and for
    standstill below 0.025 m/s. The drive changes its speed by 0.2 m/s a step at most.
    `magfold_env.envs.spaces.actions.SpeedTable` has the other ways, a table of speeds among them.

    **Observation**: a flat ``Box(−1, 1)`` of ``12 n + 2`` entries, component 1 first. Frames are
    not stacked.

    ========= ========= ======================================================== =============
    group     entries   meaning and unit                                         range
    ========= ========= ======================================================== =============
    target    3 (n − 1) the wanted letter of each joint, one-hot over L, S, R    0, 1
    magnets   4 n       front-left, back-left, back-right, front-right:          −1, 0, 1
                        1 N, −1 S, as the chain was ordered, not as strong as
                        it came
    direction 1         of the feed: 1 forward, −1 backward                      −1, 1
    seen      n         1 where the camera sees a component: it is not held and  0, 1
                        its centre is outside the tube. 20 ms ago, as are the
                        next two, which are 0 for those not seen
    heading   2 n       sine and cosine of the heading, noise of 1°              [−1, 1]
    position  2 n       centre, mouth of the tube at 0, x / chain length, noise  (−1, 1) *
                        of 0.3 mm along x and y
    advance   1         how far the feed has gone, x / chain length; 1 with all  [0, 1]
                        out
    speed     1         of the feed in the last step, x / (0.6 m/s)              [−1, 1]
    force     1         of the drive, mean over the last step, noise of 10 mN,   (−1, 1) *
                        x / (0.1 N); negative pulls
    time      1         x / (5 s)                                                [0, 1]
    ========= ========= ======================================================== =============

    Entries marked * are squashed by ``x / (1 + |x|)``. Noise is normal, with these standard
    deviations. Velocities are not shown, and nothing of what is drawn.

    **Reward**: at the end the score: 1 in the target, else half the similarity to it, and 0 if the
    time is over or the simulation broke down; ``reward="sparse"``: 1 in the target, else 0;
    ``reward="relative"``: the score less b, what the best constant speed scores
    (`magfold_env.envs.baselines.constant_speed`). Every second costs 0.02, in equal parts at every
    step. Shaping: `magfold_env.envs.tasks.reward`.

    **Info**: ``target``, ``word``, ``time`` [s], ``force`` [N], as measured; at the end also
    ``status``, ``message``, ``energy`` [J], ``score``, ``baseline``, ``baseline_flagged`` (the
    reward asks for none) and ``is_success``.

    Parameters
    ----------
    scene : str, Path or Scene
        A tube scene; its sequence, direction and speeds are ignored.
    render_mode : {"human", "rgb_array", "ansi"}, optional
        What `render` returns; ``human`` shows every step in a window by itself.
    **options
        See `magfold_env.envs.tasks.feed_tasks.FeedOptions`.

    Raises
    ------
    ValueError
        For any argument that is not allowed; the message names it and what is.
    """

    metadata = {"render_modes": list(RENDER_MODES), "render_fps": 50}  # noqa: RUF012
    make_episodes = FloorEpisodes
    world: FeedWorld

    def __init__(
        self,
        scene: str | Path | Scene = "unknown-floor",
        *,
        render_mode: str | None = None,
        **options: Unpack[FeedOptions],
    ) -> None:
        super().__init__(FeedWorld(scene, **options), render_mode)

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
        """Return what the best constant speed makes of a task, by its number.

        May take some seconds where neither the package nor the disk cache has it.
        """
        store = constant_speeds(self.world)
        return store.get(store.names[self.world.number_of(task)])

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
        What `UnknownFloorEnv.to_scene` returns.
    speeds : sequence of float
        What `UnknownFloorEnv.history` is.
    """
    chains, row = DynamicChains(DrawnChains((scene,), 1, endless=True)), np.array([0])
    chains.begin(row, [np.random.default_rng()])
    chains.drawn.factors[:] = scene.speeds / REFERENCE_SPEED
    chains.load(row, np.array([[signs_of(faces) for faces in scene.sequence]]))
    for speed in speeds:
        if chains.arrays.status[0] == 0:
            chains.push(row, np.array([speed]), INTERVAL)
    return chains


class UnknownFloorVectorEnv(ChainVectorEnv[NDArray[np.float32]]):
    """Many of `UnknownFloorEnv`.

    Arguments are those of `magfold_env.envs.vector_env.ChainVectorEnv`.
    """

    single = UnknownFloorEnv
