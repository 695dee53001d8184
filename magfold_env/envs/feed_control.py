"""``MagFold/FeedControl-v0``: steer a given chain into one of its folds by the feed speed alone."""

from collections.abc import Sequence
from pathlib import Path
from typing import Unpack

import numpy as np
from numpy.typing import NDArray

from magfold_env.envs.chain_env import ChainEnv
from magfold_env.envs.chains.arrays import Bools, Floats, Ints
from magfold_env.envs.chains.draws import REFERENCE_SPEED, DrawnChains
from magfold_env.envs.chains.dynamic import DynamicChains
from magfold_env.envs.chains.lattice import LatticeFeed
from magfold_env.envs.episodes import Columns, Episodes, Lines
from magfold_env.envs.pictures.viewer import RENDER_MODES
from magfold_env.envs.spaces.actions import FASTEST, SpeedTable, signs_of
from magfold_env.envs.spaces.observation import squash
from magfold_env.envs.tasks.control_tasks import ControlOptions, ControlSetup, ControlTask
from magfold_env.envs.tasks.forecast import or_dash
from magfold_env.envs.tasks.goals import Goals
from magfold_env.envs.vector_env import ChainVectorEnv
from magfold_env.scene import Scene

INTERVAL = 0.02
"""Time between two decisions [s]."""

HORIZON = 250
"""Steps until an episode is truncated: 5 s."""

FORCE_SCALE = 1.0
"""Push that is shown as one half [N]."""


class ControlEpisodes(Episodes[NDArray[np.float32]]):
    """Episodes in which given chains are fed at speeds that change from step to step."""

    world: ControlSetup
    chains: DynamicChains
    kept = (*Episodes.kept, "steps", "asked")

    def __init__(
        self, world: ControlSetup, count: int, threads: int = 1, frame_rate: float | None = None
    ) -> None:
        super().__init__(world, count, threads)
        self.steps: Ints = np.zeros(count, dtype=np.int64)
        """Number of steps taken in each episode, (m,)."""
        self.asked: Floats = np.zeros((count, HORIZON))
        """Feed speeds asked for in each step [m/s]."""
        self.avoided = Goals([task.avoid for task in world.tasks], world.match, count)

    def _make_chains(self, threads: int, frame_rate: float | None) -> DynamicChains:
        templates = self.world.templates
        return DynamicChains(DrawnChains(templates, self.count, threads, endless=True))

    @property
    def truncated(self) -> Bools:
        """Which episodes were ended by the limit of time, (m,)."""
        return (self.steps == HORIZON) & ~self.terminated

    def scene(self, row: int) -> Scene:
        """Return the drawn scene of a chain, whose feed speeds say what factors were drawn."""
        return self.world.scene_of(int(self.numbers[row]), self.chains.drawn_scene(row))

    def acting(self, row: int) -> int:
        """Return how many components of a chain have magnets that act, in the order of feed."""
        n = self.world.scene.n
        if self.world.scene.feed.loading == "preloaded":
            return n
        out = int(self.arrays.released[row].sum())
        return min(out + (self.chains.progress_of_next(row) > 0.0), n)

    def lattice(self, row: int) -> LatticeFeed:
        """Return what energy minimisation needs to know of a chain."""
        return self.world.lattice(int(self.numbers[row]))

    def told(self, rows: Ints) -> Columns:
        """Return the info of some episodes: the little there is on their way."""
        return {
            "target": self.goals.names[rows],
            "avoid": self.avoided.names[rows],
            "word": self.words(rows),
            "time": INTERVAL * self.steps[rows],
            "force": self.chains.force[rows],
        }

    def told_at_end(self, rows: Ints) -> Columns:
        """Return what is told besides of episodes that have terminated."""
        ends = super().told_at_end(rows)
        avoided = self.avoided.judge(rows, self.arrays.status, self.arrays.angles)[2] == 1.0
        return ends | {"score": np.where(avoided, 0.0, ends["score"])}

    def observe(self) -> NDArray[np.float32]:
        """Return new observations, (m, size)."""
        layout = self.world.layout
        out = np.empty((self.count, layout.size), dtype=np.float32)
        words = np.concatenate([self.goals.one_hot, self.avoided.one_hot], axis=1)
        layout.fill(self.arrays, words, out)
        group = layout.slices["feed"]
        for row in range(self.count):
            step = int(self.steps[row])
            out[row, group] = (
                1.0 if self.arrays.forward[row] else -1.0,
                self.chains.progress_of_next(row),
                (float(self.asked[row, step - 1]) if step else 0.0) / FASTEST,
                squash(float(self.chains.force[row]) / FORCE_SCALE),
                step / HORIZON,
            )
        return out

    def _shown(self, row: int) -> tuple[str, Lines, Lines]:
        step, out = int(self.steps[row]), int(self.arrays.released[row].sum())
        wanted: Lines = [("target", self.goals.names[row]), ("to avoid", self.avoided.names[row])]
        push = or_dash(float(self.chains.force[row]), "mN")
        done: Lines = [("time", f"{INTERVAL * step:.2f} s"), ("push", push)]
        if step:
            done.append(("feed speed", f"{1e3 * self.asked[row, step - 1]:.0f} mm/s"))
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

    def _want(self, rows: Ints) -> None:
        super()._want(rows)
        self.avoided.want(rows, self.numbers[rows])

    def _act(self, rows: Ints, choice: tuple[Floats]) -> None:
        (speeds,) = choice
        self.asked[rows, self.steps[rows]] = speeds
        self.steps[rows] += 1
        self.chains.push(rows, speeds, INTERVAL)


class FeedControlEnv(ChainEnv[NDArray[np.float32]]):
    """Feed a chain whose magnets are given, so that it reaches one fold and not another.

    `reset` picks a task: a sequence, the direction of its feed, the fold to reach and the one to
    avoid, both of which the feed speed can bring about. Every step sets the feed speed for
    20 ms. The episode terminates when the whole chain is out and at rest, when the push
    needed is beyond ``push_limit`` for 0.1 s (status ``jammed``), or when the simulation breaks
    down. After 5 s, 250 steps, it is truncated.

    **Action**: ``Discrete(speeds + 1)``: 0 is standstill, k the k-th of ``speeds`` levels that are
    log-spaced from 0.01 to 0.6 m/s. `magfold_env.envs.spaces.actions.SpeedTable` has the other
    ways.

    **Observation**: a flat ``Box(−1, 1)`` of ``20 n − 2`` entries. First ``target`` and ``avoid``,
    3 (n − 1) entries each, one-hot over L, S, R; then ``released`` to ``velocity`` as in
    `magfold_env.envs.tube_feed.TubeFeedEnv` (all magnets are shown from the beginning, the
    speed of a component is the last before it left); then ``feed``: the direction (1 forward, −1
    backward), how far the component in the mouth is out (0 to 1), the last speed asked for
    (over 0.6 m/s), the push needed (x / (1 N), squashed) and the time (over 5 s).

    **Reward**: at termination the score: 1 in the target, 0 in the fold to avoid, else half the
    similarity to the target, 0 if the simulation fails; ``reward="sparse"``: 1 in the target, else
    0. Truncation is worth nothing. Shaping: `magfold_env.envs.tasks.reward`.

    **Info**: ``target``, ``avoid``, ``word``, ``time`` [s], ``force`` [N]; at the end also
    ``status``, ``message``, ``energy`` [J], ``score`` and ``is_success``.

    Parameters
    ----------
    scene : str, Path or Scene
        A tube scene; its sequence, direction and speeds are ignored.
    render_mode : {"human", "rgb_array", "ansi"}, optional
        What `render` returns; ``human`` shows every step in a window by itself.
    **options
        See `magfold_env.envs.tasks.control_tasks.ControlOptions`.

    Raises
    ------
    ValueError
        For any argument that is not allowed; the message names it and what is.
    """

    metadata = {"render_modes": list(RENDER_MODES), "render_fps": 50}  # noqa: RUF012
    make_episodes = ControlEpisodes
    world: ControlSetup

    def __init__(
        self,
        scene: str | Path | Scene = "tube-built",
        *,
        render_mode: str | None = None,
        **options: Unpack[ControlOptions],
    ) -> None:
        self.setup = ControlSetup(scene, **options)
        super().__init__(self.setup, render_mode)

    @property
    def tasks(self) -> tuple[ControlTask, ...]:
        """The tasks that `reset` draws from."""
        return self.setup.tasks

    @property
    def actions(self) -> SpeedTable:
        """How actions are read."""
        return self.setup.actions

    @property
    def task(self) -> ControlTask:
        """The task of this episode."""
        return self.setup.tasks[int(self._running().numbers[0])]

    @property
    def history(self) -> tuple[float, ...]:
        """The speeds asked for so far [m/s]; with `to_scene` they replay the episode."""
        episodes = self._running()
        return tuple(episodes.asked[0, : int(episodes.steps[0])].tolist())

    def to_scene(self) -> Scene:
        """Return the concrete scene of the episode.

        `replay` repeats the episode from it and `history`, bit for bit. The feed speeds in it hold
        the factors that were drawn.
        """
        return self._running().scene(0)


def replay(scene: Scene, speeds: Sequence[float]) -> DynamicChains:
    """Return the chain that `scene` and the speeds asked for [m/s] lead to, bit for bit.

    Parameters
    ----------
    scene : Scene
        What `FeedControlEnv.to_scene` returns.
    speeds : sequence of float
        What `FeedControlEnv.history` is.
    """
    chains, row = DynamicChains(DrawnChains((scene,), 1, endless=True)), np.array([0])
    chains.begin(row, [np.random.default_rng()])
    chains.drawn.factors[:] = scene.speeds / REFERENCE_SPEED
    chains.load(row, np.array([[signs_of(faces) for faces in scene.sequence]]))
    for speed in speeds:
        if chains.arrays.status[0] == 0:
            chains.push(row, np.array([speed]), INTERVAL)
    return chains


class FeedControlVectorEnv(ChainVectorEnv[NDArray[np.float32]]):
    """Many of `FeedControlEnv`.

    Arguments are those of `magfold_env.envs.vector_env.ChainVectorEnv`.
    """

    single = FeedControlEnv
