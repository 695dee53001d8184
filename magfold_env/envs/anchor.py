"""``MagFold/Anchor-v0``: build a fold that withstands a pull, from the components of a tray."""

from dataclasses import replace
from typing import Any

import numpy as np

from magfold_env.envs.chains.arrays import HELD, OPENED, Bools, Floats, Ints
from magfold_env.envs.episodes import Columns, Lines
from magfold_env.envs.spaces.actions import AHEAD, PULL, TrayChoice, TrayTable
from magfold_env.envs.spaces.observation import Layout
from magfold_env.envs.tasks.feed_tasks import AnchorTask
from magfold_env.envs.tasks.setup import FeedOptions, TaskSetup
from magfold_env.envs.tray import TrayEnv, TrayEpisodes
from magfold_env.envs.vector_env import ChainVectorEnv
from magfold_env.simulation.endings import FOLDED_WITHIN

OUT = 0.95
"""Share of the last component's diagonal that leaves the tube."""

SETTLING = 0.3
"""Time for a chain to settle after its last component is fed [s]."""

STAGES = 5
"""Number of equal increments in which a pull grows to its full size."""

STAGE = 0.03
"""Time for which each increment before the last acts [s]."""

LASTING = 0.15
"""Time for which the full pull acts [s]."""

PULL_SCALE = 0.5
"""Component of a pull that an observation encodes as 0.5 [N]."""


class AnchorEpisodes(TrayEpisodes):
    """Episodes in which a fold must withstand a pull while the tube holds the last component."""

    task_kind = AnchorTask
    protocol = (*TrayEpisodes.protocol, OUT, SETTLING, STAGES, STAGE, LASTING)
    lacking = "not left"
    kept = (*TrayEpisodes.kept, "scores", "_tested")

    def allocate(self) -> None:
        """Allocate the arrays of the episodes."""
        super().allocate()
        self.scores: Floats = np.zeros(self.count)
        """Score of each episode, (m,); 0 unless the agent ended it by leaving the chain."""
        self._tested: Bools = np.zeros(self.count, dtype=np.bool_)  # whether the last step pulled
        self.sizes: Floats = np.array([task.pull for task in self.setup.tasks])
        """Size of each task's pull [N], (tasks,)."""
        towards = np.array([task.towards for task in self.setup.tasks])
        self.pulls: Floats = self.sizes[:, None] * np.stack([np.cos(towards), np.sin(towards)], 1)
        """Components of each task's pull along x and y [N], (tasks, 2)."""
        self._last_comes_out = OUT * self.setup.scene.casing.diagonal  # [m]

    @classmethod
    def spaces(cls, setup: TaskSetup, options: FeedOptions) -> tuple[TrayTable, Layout]:
        """Return the encoding of actions and the layout of observations."""
        table, layout = super().spaces(setup, options)
        sizes = {"pull": 2, **layout.sizes, "borne": 1}
        del sizes["target"]
        return replace(table, ways=3), replace(layout, sizes=sizes)

    def infos(self, rows: Ints) -> Columns:
        """Return the infos of the given episodes, running or ended."""
        return super().infos(rows) | {"pull": self.sizes[self.numbers[rows]]}

    def final_infos(self, rows: Ints) -> Columns:
        """Return additional infos of episodes that have terminated."""
        scores = self.scores[rows]
        return super().final_infos(rows) | {"score": scores, "is_success": scores == 1.0}

    def turned(self, rows: Ints) -> Bools:
        """Return which joints are within 0.05 rad of ±90°, (rows, n - 1)."""
        joints = np.diff(self.arrays.angles[rows], axis=1)
        return np.abs(np.abs(joints) - 0.5 * np.pi) <= FOLDED_WITHIN

    def is_whole(self, rows: Ints) -> Bools:
        """Return which of the given chains are completely fed, (rows,)."""
        return self.arrays.fed[rows] == self.n

    def is_tested(self, rows: Ints) -> Bools:
        """Return which of the given chains were pulled in the last step, (rows,)."""
        return self._tested[rows]

    def borne(self, rows: Ints) -> Floats:
        """Return the measured share of the pull that each chain withstood; 0 if not pulled."""
        share = np.clip(self._force[rows] / self.sizes[self.numbers[rows]], 0.0, 1.0)
        return np.where(self._tested[rows], share, 0.0)

    def groups(self) -> dict[str, Any]:
        """Return the entries of observations by group, except those that the camera measures."""
        groups, pulls = super().groups(), self.pulls[self.numbers] / PULL_SCALE
        del groups["target"]
        return groups | {
            "pull": pulls / (1.0 + np.abs(pulls)),
            "borne": self.borne(self.rows)[:, None],
        }

    def caption(self, row: int) -> tuple[str, Lines, Lines]:
        """Return the title of an episode's picture, and the text above and below its energies."""
        title, _, done = super().caption(row)
        task: Any = self.setup.tasks[int(self.numbers[row])]
        wanted: Lines = [("pull", f"{task.pull:.2f} N at {np.degrees(task.towards):.0f}°")]
        return title, wanted, done

    def prepare(self, rows: Ints) -> None:
        """Put all components on their trays and draw random strengths for their magnets."""
        super().prepare(rows)
        self.scores[rows], self._tested[rows] = 0.0, False

    def act(self, rows: Ints, choice: TrayChoice) -> None:
        """Feed a component of each tray, draw the last one back, or pull the chain."""
        parts, lies, speeds, way = choice
        leaves = (way == AHEAD) & self.is_whole(rows)
        pulled = leaves | (way == PULL)
        self._tested[rows] = pulled
        if pulled.any():
            self._test(rows[pulled], leaves[pulled])
        on = ~pulled
        if on.any():
            super().act(rows[on], (parts[on], lies[on], speeds[on], way[on]))

    def _feed(self, rows: Ints, parts: Ints, lies: Ints, speeds: Floats) -> None:
        super()._feed(rows, parts, lies, speeds)
        last = rows[self.is_whole(rows) & ~self.terminated[rows]]
        if len(last):
            self.chains.pull(last, np.zeros((len(last), 2)), SETTLING)

    def _until(self, rows: Ints, speeds: Floats) -> Floats:
        """Return the times [s] at which feeds pause, so that the tube holds the last component."""
        n, late = self.n, np.full(len(rows), self.late)
        factors = self.chains.factors[rows, np.where(self.arrays.forward[rows], n - 1, 0)]
        # If the drive has slipped, the component may already be out a little.
        way = self._last_comes_out - self.chains.engine.q[rows, n]
        last = self.arrays.fed[rows] == n - 1
        return np.where(last, np.minimum(self.times(rows) + way / (speeds * factors), late), late)

    def _test(self, rows: Ints, leaves: Bools) -> None:
        """Pull the given chains, and end the episodes where `leaves` is true."""
        began, turned = self.times(rows), self.turned(rows)
        borne = self._bear(rows, turned)
        size = self.sizes[self.numbers[rows]]
        self.speeds[rows] = 0.0
        self._took[rows] = self.times(rows) - began
        left = leaves & ~self.terminated[rows]
        score = np.where(turned.all(axis=1), 0.5 + 0.5 * borne, 0.5 * turned.mean(axis=1))
        self.scores[rows] = np.where(left, score, 0.0)
        self._measure(rows, borne * size)
        kept = borne == 1.0
        self.chains.stop(rows[left & kept], "left: no folded joint opened", HELD)
        self.chains.stop(rows[left & ~kept], "left: a folded joint opened", OPENED)
        self._stop_late(rows)

    def _bear(self, rows: Ints, turned: Bools) -> Floats:
        """Increase each pull until a folded joint opens; return the shares that were withstood."""
        borne, pulls = np.zeros(len(rows)), self.pulls[self.numbers[rows]]
        going = np.arange(len(rows))
        for stage in range(1, STAGES + 1):
            share = stage / STAGES
            lasting = LASTING if stage == STAGES else STAGE
            self.chains.pull(rows[going], share * pulls[going], lasting)
            keeps = (self.turned(rows[going]) | ~turned[going]).all(axis=1)
            going = going[keeps & ~self.terminated[rows[going]]]
            borne[going] = share
            if not len(going):
                break
        return borne


class AnchorEnv(TrayEnv):
    """From a tray's components, build a fold that withstands a pull while a tube holds its end.

    Rules that are not listed here are those of `magfold_env.envs.tray.TrayEnv`.

    `reset` selects a task: a tray, a feed direction, and the size [N] and direction of a pull. Any
    fold that withstands the pull is a success. Dead and weak magnets and the strength of each
    magnet are drawn as in `TrayEnv`. A common factor varies all strengths by ±30 %, and the
    friction coefficient is log-uniform from 0.05 to 1.

    The last component comes out by only 0.95 of its diagonal, so that the tube holds it. Then the
    chain has 0.3 s to settle. All components except the first can be drawn back and chosen again.
    The tube is 1.3 diagonals wide, but a fold may still jam in it when it is drawn back.

    **Pull**: like gravity, the pull acts on all mass outside the tube. It increases in five equal
    steps: four of 0.03 s each, then the full pull for 0.15 s. A joint within 0.05 rad of ±90° is
    folded; the pull ends early if a folded joint opens. An agent may *test* the pull at any time.
    After all components are fed, the next step that feeds applies a last pull and ends the episode:
    the agent *leaves* the chain.

    **End**: when the agent leaves the chain, with the status ``held`` if every folded joint stays
    folded under the full pull, else ``opened``; when the drive, limited to 10 N, has slipped for
    0.1 s (``jammed``); after 10 s of simulated time (``unsettled``); or when the simulation breaks
    down. Each of these terminates the episode.

    **Action**: ``MultiDiscrete([parts, 8, speeds, 3])``. The last number is 0 to feed or leave, 1
    to draw back, and 2 to test. A test ignores the other numbers.

    **Observation**: ``9 n + 7 + 9 parts`` entries: those of `TrayEnv` without ``target``, with
    ``pull`` as the first group and ``borne`` as the last.

    ===== ======= ================================================================ ========
    group entries meaning and unit                                                 range
    ===== ======= ================================================================ ========
    pull  2       components of the pull along x and y, divided by 0.5 N           (−1, 1) *
    borne 1       share of the pull that the chain withstood, measured with noise  [0, 1]
                  of 10 mN; 0 unless the last step was a test
    ===== ======= ================================================================ ========

    After a test, ``force`` is the force that the chain withstood.

    **Reward**: the score at the end. If the agent leaves a chain whose joints are all folded, the
    score is ½ plus half the share of the pull that it withstands; otherwise it is half the share of
    folded joints. Any other end scores 0. Success is a fold that withstands the full pull.
    ``reward="relative"`` subtracts the score of the minimiser's chain for the task's hidden target
    word at its best constant speed. Shaping uses the same word. Each simulated second costs 0.02.

    **Info**: that of `TrayEnv`, and ``pull`` [N].

    Arguments are those of `magfold_env.envs.camera_track.CameraTrackEnv`. In the scene,
    ``feed.loading`` must be ``at_mouth``.
    """

    make_episodes = AnchorEpisodes
    default_scene = "anchor-tray"
    default_tasks = "anchors-6"


AnchorVectorEnv = ChainVectorEnv[Any].of(AnchorEnv)
