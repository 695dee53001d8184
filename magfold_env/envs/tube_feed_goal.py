"""``MagFold/TubeFeedGoal-v0``: tube feed for goal-conditioned learners (hindsight replay)."""

from functools import lru_cache
from pathlib import Path
from typing import Any, Unpack

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from magfold_env.envs.chains.arrays import FOLDED, MISFOLDED, Floats, Ints
from magfold_env.envs.episodes import Columns
from magfold_env.envs.fold_env import FoldEnv, FoldEpisodes
from magfold_env.envs.spaces.observation import chain_layout
from magfold_env.envs.tasks.goals import SUCCESS_TOLERANCE, Match
from magfold_env.envs.tasks.setup import ChainOptions, FoldOptions
from magfold_env.envs.vector_env import ChainVectorEnv
from magfold_env.scene import Scene
from magfold_env.shapes import angles_to_word, outline, word_to_angles

GoalObservation = dict[str, NDArray[np.float32]]


class GoalEpisodes(FoldEpisodes):
    """Episodes with goals separate from the observations, and with a reward in every step."""

    def observe(self) -> GoalObservation:
        """Return a dictionary of new observations, (m, …) each."""
        seen = self.observed(np.empty((self.count, 0), dtype=np.float32))
        achieved, wanted = self._goals()
        return {"observation": seen, "achieved_goal": achieved, "desired_goal": wanted}

    def _goals(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return the achieved and the desired goals, (m, n) each."""
        status, joints = self.arrays.status, np.diff(self.arrays.angles)
        achieved = np.empty((self.count, self.n), dtype=np.float32)
        achieved[:, :-1] = np.arctan2(np.sin(joints), np.cos(joints))
        achieved[:, -1] = (status == FOLDED) | (status == MISFOLDED)
        wanted = np.ones_like(achieved)
        wanted[:, :-1] = self.goals.turns
        return achieved, wanted

    def step_rewards(self, rows: Ints) -> Floats:
        """Return 0 where the goal is achieved, else −1."""
        achieved, wanted = self._goals()
        return np.asarray(compute_reward(achieved[rows], wanted[rows], self.setup.match))

    def end_rewards(self, ends: Columns) -> Floats:
        """Return 0, because the end earns no additional reward."""
        return np.zeros(len(ends["score"]))


class TubeFeedGoalEnv(FoldEnv[GoalObservation]):
    """`magfold_env.envs.tube_feed.TubeFeedEnv` with the goal separate from the observation.

    **Action**, horizon and info are those of `TubeFeedEnv`.

    **Observation**: a dictionary of

    - ``observation``: the ``14 n − 1`` entries of `TubeFeedEnv` without the target;
    - ``achieved_goal``: the ``n − 1`` joint angles [rad], then 1 if the chain has settled, folded
      or not, and 0 otherwise;
    - ``desired_goal``: the joint angles of the target [rad], then 1.

    **Reward**: at every step 0 if the goal is achieved, and −1 otherwise; see `compute_reward`.
    There is no baseline and no shaping: ``reward`` is ``sparse``.

    Arguments are those of `magfold_env.envs.fold_env.FoldEnv`, except ``reward``, ``shaping``,
    ``gamma`` and ``baseline``.
    """

    make_episodes = GoalEpisodes

    def __init__(
        self,
        scene: str | Path | Scene | None = None,
        *,
        render_mode: str | None = None,
        **options: Unpack[ChainOptions],
    ) -> None:
        for key in FoldOptions.__annotations__.keys() - ChainOptions.__annotations__.keys():
            if key in options:
                raise ValueError(f"{key}: must be left out, because rewards are -1 and 0")
        super().__init__(scene, render_mode=render_mode, reward="sparse", baseline=None, **options)
        self.setup.layout = chain_layout(self.scene.n, self.scene.casing.side, words=())
        joints = self.scene.n - 1
        low = np.array([-np.pi] * joints + [0.0], dtype=np.float32)
        high = np.array([np.pi] * joints + [1.0], dtype=np.float32)
        self.observation_space = spaces.Dict(
            observation=self.layout.space,
            achieved_goal=spaces.Box(low, high, dtype=np.float32),
            desired_goal=spaces.Box(low, high, dtype=np.float32),
        )

    def compute_reward(
        self, achieved_goal: NDArray[Any], desired_goal: NDArray[Any], info: object
    ) -> NDArray[np.float64] | float:
        """Return the reward for `achieved_goal` given `desired_goal`.

        It is 0 if every joint is within 0.05 rad of the desired angle and the chain has settled
        if the goal requires it. With ``match="outline"``, both goals must instead be within 0.05
        rad of fully folded words with the same outline. Otherwise the reward is −1.

        Parameters
        ----------
        achieved_goal, desired_goal : array, shape (n,) or (m, n)
            One goal, or a batch of them.
        info : object
            Ignored.

        Returns
        -------
        float, or array of shape (m,)
            The rewards.
        """
        return compute_reward(achieved_goal, desired_goal, self.task.match)


class TubeFeedGoalVectorEnv(ChainVectorEnv[GoalObservation]):
    """The vector form of `TubeFeedGoalEnv`."""

    single = TubeFeedGoalEnv

    def compute_reward(self, *arguments: Any) -> NDArray[np.float64] | float:
        """Return the result of `TubeFeedGoalEnv.compute_reward`."""
        return self.template.compute_reward(*arguments)


def compute_reward(
    achieved_goal: NDArray[Any], desired_goal: NDArray[Any], match: Match
) -> NDArray[np.float64] | float:
    """Return the result of `TubeFeedGoalEnv.compute_reward` for the option `match`."""
    achieved, desired = np.asarray(achieved_goal), np.asarray(desired_goal)
    apart = np.abs(achieved[..., :-1] - desired[..., :-1])
    alike = (apart <= SUCCESS_TOLERANCE).all(axis=-1)
    if match == "outline":
        rows = zip(
            achieved.reshape(-1, achieved.shape[-1]),
            desired.reshape(-1, desired.shape[-1]),
            strict=True,
        )
        same = [_same_outline(one[:-1], other[:-1]) for one, other in rows]
        alike |= np.reshape(same, alike.shape)
    reward = np.where(alike & (achieved[..., -1] >= desired[..., -1]), 0.0, -1.0)
    return reward if reward.ndim else float(reward)


def _same_outline(one: NDArray[Any], other: NDArray[Any]) -> bool:
    """Return whether two shapes are fully folded and cover the same cells."""
    words = [angles_to_word(joints) for joints in (one, other)]
    for word, joints in zip(words, (one, other), strict=True):
        apart = np.abs(word_to_angles(word) - joints)
        if "S" in word or (apart > SUCCESS_TOLERANCE).any():
            return False
    return _outline(words[0]) == _outline(words[1])


_outline = lru_cache(maxsize=4096)(outline)
