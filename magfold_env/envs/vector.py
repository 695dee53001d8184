"""Vector environments: many chains stepped by one compiled call.

``gymnasium.make_vec(id, num_envs=m)`` makes one. It says what `gymnasium.vector.SyncVectorEnv` says
of as many single environments with the same seeds, bit for bit.
"""

from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from magfold_env.envs.chains.protocol import FOLDED, MISFOLDED
from magfold_env.envs.fold_vector import Floats, FoldVectorEnv, Infos, Ints
from magfold_env.envs.sequence_design import SequenceDesignEnv
from magfold_env.envs.tube_feed import TubeFeedEnv
from magfold_env.envs.tube_feed_goal import GoalObservation, TubeFeedGoalEnv, achieved_goals


class FlatVectorEnv(FoldVectorEnv[NDArray[np.float32]]):
    """Those whose observations are arrays."""

    def _observe(self) -> NDArray[np.float32]:
        layout = self.task.layout
        out = np.empty((self.num_envs, layout.size), dtype=np.float32)
        self.fleet.board.show(layout.side, self.goals.one_hot, out)
        return out

    def _each(self, rows: Ints) -> list[NDArray[np.float32]]:
        return list(self._observe()[rows])


class TubeFeedVectorEnv(FlatVectorEnv):
    """Many of `magfold_env.envs.tube_feed.TubeFeedEnv`.

    Arguments are those of `magfold_env.envs.fold_vector.FoldVectorEnv`.
    """

    single = TubeFeedEnv


class SequenceDesignVectorEnv(FlatVectorEnv):
    """Many of `magfold_env.envs.sequence_design.SequenceDesignEnv`."""

    single = SequenceDesignEnv


class TubeFeedGoalVectorEnv(FoldVectorEnv[GoalObservation]):
    """Many of `magfold_env.envs.tube_feed_goal.TubeFeedGoalEnv`."""

    single = TubeFeedGoalEnv

    def compute_reward(
        self, achieved_goal: NDArray[Any], desired_goal: NDArray[Any], info: object
    ) -> NDArray[np.float64] | float:
        """Return `TubeFeedGoalEnv.compute_reward`."""
        return cast("TubeFeedGoalEnv", self.template).compute_reward(
            achieved_goal, desired_goal, info
        )

    def _rewards(self, rows: Ints, ended: Ints, ends: Infos) -> Floats:
        goals = self._goals_of()
        rewards = self.compute_reward(*goals, None)
        return cast("Floats", rewards)[rows]

    def _goals_of(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return what is achieved and what is wanted, (m, n) each."""
        status = self.fleet.status
        settled = (status == FOLDED) | (status == MISFOLDED)
        achieved = achieved_goals(self.fleet.board.angles, settled)
        wanted = np.ones_like(achieved)
        wanted[:, :-1] = self.goals.turns
        return achieved, wanted

    def _observe(self) -> GoalObservation:
        layout = self.template.layout
        seen = np.empty((self.num_envs, layout.size), dtype=np.float32)
        self.fleet.board.show(layout.side, self._nothing, seen)
        achieved, wanted = self._goals_of()
        return {"observation": seen, "achieved_goal": achieved, "desired_goal": wanted}

    def _each(self, rows: Ints) -> list[GoalObservation]:
        seen = self._observe()
        return [{key: values[row] for key, values in seen.items()} for row in rows.tolist()]

    @property
    def _nothing(self) -> NDArray[np.float32]:
        """Words that are not shown."""
        return np.empty((self.num_envs, 0), dtype=np.float32)
