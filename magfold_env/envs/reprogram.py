"""``MagFold/Reprogram-v0``: fold a given chain, draw it in, and fold it into another word."""

from dataclasses import replace
from typing import Any

import numpy as np

from magfold_env.envs.baselines.three_speeds import ThreeSpeedStore
from magfold_env.envs.camera_track import INTERVAL, STEEPEST, FeedEpisodes, FeedTrackEnv
from magfold_env.envs.chains.arrays import FAILED, FOLDED, Bools, Floats, Ints
from magfold_env.envs.episodes import Columns
from magfold_env.envs.spaces.actions import SpeedTable
from magfold_env.envs.spaces.observation import Layout
from magfold_env.envs.tasks.feed_tasks import RefoldTask
from magfold_env.envs.tasks.goals import Goals
from magfold_env.envs.tasks.setup import FeedOptions, TaskSetup
from magfold_env.envs.vector_env import ChainVectorEnv

HORIZON = 500
"""Number of steps allowed in an episode: 10 s."""

LASTING = 5
"""Number of steps for which the first word must last before it counts as reached: 0.1 s."""

FIRST, BACK, SECOND = range(3)
"""Stages of an episode: reach the first word, draw the chain in, reach the second word."""


class ReprogramEpisodes(FeedEpisodes):
    """Episodes with two target folds, one after the other."""

    task_kind = RefoldTask
    horizon = HORIZON
    store = ThreeSpeedStore
    protocol = (INTERVAL, HORIZON, STEEPEST, LASTING)
    kept = (*FeedEpisodes.kept, "stage", "_lasted")

    def allocate(self) -> None:
        """Allocate the arrays of the episodes."""
        super().allocate()
        self.stage: Ints = np.zeros(self.count, dtype=np.int64)
        """The stage of each episode, (m,): FIRST, BACK or SECOND."""
        self._lasted: Ints = np.zeros(self.count, dtype=np.int64)  # in the first word
        words = zip(*(task.words for task in self.setup.tasks), strict=True)
        self.goals = Goals(sum(words, ()), self.setup.match, self.count)

    @classmethod
    def spaces(cls, setup: TaskSetup, options: FeedOptions) -> tuple[SpeedTable, Layout]:
        """Return the encoding of actions and the layout of observations."""
        table, layout = super().spaces(setup, options)
        return table, replace(layout, sizes={**layout.sizes, "stage": 3})

    def infos(self, rows: Ints) -> Columns:
        """Return the infos of the given episodes, running or ended."""
        return super().infos(rows) | {"stage": self.stage[rows]}

    def final_infos(self, rows: Ints) -> Columns:
        """Return additional infos of episodes that have terminated."""
        ends = super().final_infos(rows)
        second = ends["is_success"] & (self.stage[rows] == SECOND)
        score = np.where(self.arrays.status[rows] == FAILED, 0.0, self._reached(rows))
        return ends | {"score": score + 0.5 * second, "is_success": second}

    def is_last_held(self, rows: Ints) -> Bools:
        """Return for which of the given chains the tube holds only the last component."""
        return self.arrays.released[rows].sum(axis=1) == self.n - 1

    def is_in(self, rows: Ints) -> Bools:
        """Return which of the given chains have at most one component's centre outside."""
        return self._frames[1, rows, : self.n].sum(axis=1) <= 1.0

    def groups(self) -> dict[str, Any]:
        """Return the entries of observations by group, except those that the camera measures."""
        return super().groups() | {"stage": self.stage[:, None] == np.arange(3)}

    def _shaped(self, rows: Ints) -> Floats:
        """Return Φ: ½ per word reached, plus half of Φ for the next word unless drawing in."""
        sought = np.where(self.stage[rows] == BACK, 0.0, super()._shaped(rows))
        return self._reached(rows) + 0.5 * sought

    def _reached(self, rows: Ints) -> Floats:
        """Return ½ for each episode that has reached its first word, else 0."""
        return np.where(self.stage[rows] == FIRST, 0.0, 0.5)

    def _set_targets(self, rows: Ints) -> None:
        super()._set_targets(rows)
        self._seek(rows)

    def _seek(self, rows: Ints) -> None:
        """Set the goals of episodes to the words of their current stages."""
        later = np.where(self.stage[rows] == FIRST, 0, len(self.setup.tasks))
        self.goals.want(rows, self.numbers[rows] + later)

    def reset_rows(self, rows: Ints) -> None:
        """Draw random chains for the given episodes and put them into their tubes."""
        super().reset_rows(rows)
        self.stage[rows] = self._lasted[rows] = 0
        self._seek(rows)

    def act(self, rows: Ints, choice: tuple[Floats]) -> None:
        """Drive the feeds for one interval, and check which stages are complete."""
        super().act(rows, choice)
        stage = self.stage[rows]
        as_if = np.full(self.count, FOLDED)
        is_first = self.goals.judge(rows, as_if, self.arrays.angles)[2] == 1.0
        is_first &= (stage == FIRST) & self.is_last_held(rows)
        self._lasted[rows] = np.where(is_first, self._lasted[rows] + 1, 0)
        done = (self._lasted[rows] == LASTING) | ((stage == BACK) & self.is_in(rows))
        if done.any():
            self.stage[rows] += done
            self._seek(rows[done])


class ReprogramEnv(FeedTrackEnv):
    """Fold a chain into one word, draw it in, and fold it into another, on an unknown floor.

    Action (x requests ``0.6 x |x|`` m/s), camera, noise, options and the hidden draws of friction,
    magnets and hinges are those of `magfold_env.envs.unknown_floor.UnknownFloorEnv`. The drive
    runs at the requested speed.

    **Stages.** (0) The first word is reached when all joints, including the one at the held
    component, stay within 0.05 rad of its angles for 0.1 s (5 steps) while the tube holds only the
    last component. Once that component is out, the chain cannot be drawn in again. (1) The chain is
    drawn in when at most one component's centre is outside the tube. (2) The second word is reached
    when all components are out and at rest in that word.

    **End**: as in `UnknownFloorEnv`, except that the time limit is 10 s (500 steps).

    **Observation**: ``12 n + 5`` entries. These groups differ, and ``stage`` is new:

    ====== ========= ============================================================= ======
    group  entries   meaning and unit                                              range
    ====== ========= ============================================================= ======
    target 3 (n − 1) the next word, one-hot over L, S, R                           0, 1
    time   1         elapsed time, in units of 10 s                                 [0, 1]
    stage  3         the stage, one-hot                                            0, 1
    ====== ========= ============================================================= ======

    **Reward**: the score is ½ per word reached, however the episode ends, but 0 if the simulation
    breaks down. b is the score of the best of several schedules, each with three constant speeds
    (`magfold_env.envs.baselines.three_speeds`). An episode that reaches both words is a success.

    **Info**: that of `UnknownFloorEnv`, and ``stage``; ``target`` is the next word.

    Arguments are those of `magfold_env.envs.camera_track.CameraTrackEnv`.
    """

    make_episodes = ReprogramEpisodes
    default_scene = "reprogram"
    default_tasks = "two-words-6"


ReprogramVectorEnv = ChainVectorEnv[Any].of(ReprogramEnv)
