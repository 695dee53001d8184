"""``MagFold/TubeFeedGoal-v0``: tube feed for goal-conditioned learners (hindsight replay)."""

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Unpack

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from magfold_env.envs.chains.episode import Episode
from magfold_env.envs.fold_env import FoldEnv
from magfold_env.envs.spaces.observation import ObservationLayout
from magfold_env.envs.tasks.goals import SUCCESS_TOLERANCE
from magfold_env.envs.tasks.options import ChainOptions, FoldOptions
from magfold_env.fold import FoldStatus
from magfold_env.scene import Scene
from magfold_env.shapes import angles_to_word, outline, word_to_angles

GoalObservation = dict[str, NDArray[np.float32]]

REST = (FoldStatus.FOLDED, FoldStatus.MISFOLDED)


class TubeFeedGoalEnv(FoldEnv[GoalObservation]):
    """`magfold_env.envs.tube_feed.TubeFeedEnv` with the goal apart from the observation.

    **Action**, horizon and info as there.

    **Observation**: a dictionary of

    - ``observation``: what `TubeFeedEnv` shows, less the target: ``14 n − 1`` entries;
    - ``achieved_goal``: the ``n − 1`` joint angles [rad], then 1 if the chain has settled (is at
      rest, folded or not) and 0 if it has not;
    - ``desired_goal``: the same of the target: its joint angles, and 1.

    **Reward**: 0 where the goal is achieved, −1 where it is not, at every step; see
    `compute_reward`. There is no baseline and no shaping: ``reward`` is ``sparse``.

    Arguments are those of `magfold_env.envs.fold_env.FoldEnv` but ``reward``, ``shaping``,
    ``gamma`` and ``baseline``.
    """

    def __init__(
        self,
        scene: str | Path | Scene | None = None,
        *,
        render_mode: str | None = None,
        **options: Unpack[ChainOptions],
    ) -> None:
        for key in FoldOptions.__annotations__.keys() - ChainOptions.__annotations__.keys():
            if key in options:
                raise ValueError(f"{key}: must be left out, rewards are -1 and 0")
        super().__init__(scene, render_mode=render_mode, reward="sparse", baseline=None, **options)
        joints = self.scene.n - 1
        low = np.array([-np.pi] * joints + [0.0], dtype=np.float32)
        high = np.array([np.pi] * joints + [1.0], dtype=np.float32)
        self._layout = replace(self.task.layout, words=())
        self.observation_space = spaces.Dict(
            observation=self._layout.space,
            achieved_goal=spaces.Box(low, high, dtype=np.float32),
            desired_goal=spaces.Box(low, high, dtype=np.float32),
        )

    @property
    def layout(self) -> ObservationLayout:
        """Where each group of entries lies in ``observation``."""
        return self._layout

    def compute_reward(
        self, achieved_goal: NDArray[Any], desired_goal: NDArray[Any], info: object
    ) -> NDArray[np.float64] | float:
        """Return the reward of having `achieved_goal` where `desired_goal` was wanted.

        It is 0 if every joint is within 0.05 rad of the one wanted, or, with ``match="outline"``,
        both lie within 0.05 rad of fully folded words with one outline, and if the chain has
        settled where it is wanted to. Otherwise it is −1.

        Parameters
        ----------
        achieved_goal, desired_goal : array, shape (n,) or (m, n)
            One goal, or a batch of them.
        info : object
            Not looked at.

        Returns
        -------
        float, or array of shape (m,)
            The rewards.
        """
        achieved, desired = np.asarray(achieved_goal), np.asarray(desired_goal)
        apart = np.abs(achieved[..., :-1] - desired[..., :-1])
        alike = (apart <= SUCCESS_TOLERANCE).all(axis=-1)
        if self.task.match == "outline":
            rows = zip(
                achieved.reshape(-1, achieved.shape[-1]),
                desired.reshape(-1, desired.shape[-1]),
                strict=True,
            )
            same = [_same_outline(one[:-1], other[:-1]) for one, other in rows]
            alike |= np.reshape(same, alike.shape)
        reward = np.where(alike & (achieved[..., -1] >= desired[..., -1]), 0.0, -1.0)
        return reward if reward.ndim else float(reward)

    def _observation(self) -> GoalObservation:
        episode = self._running()
        nothing = np.zeros(0, dtype=np.float32)
        wanted = np.append(word_to_angles(self._goal.word), 1.0)
        return {
            "observation": self._layout.observe(episode.state, episode.progress, nothing),
            "achieved_goal": self._achieved(),
            "desired_goal": wanted.astype(np.float32),
        }

    def _act(self, episode: Episode, faces: tuple[str, ...], speed: float) -> None:
        episode.feed(faces[0], speed)

    def _reward(self, before: float, info: Mapping[str, Any]) -> float:
        wanted = np.append(word_to_angles(self._goal.word), 1.0).astype(np.float32)
        return float(self.compute_reward(self._achieved(), wanted, info))

    def _achieved(self) -> NDArray[np.float32]:
        """Return the joint angles, turned into the interval from −π to π, and whether at rest."""
        episode = self._running()
        return achieved_goals(episode.state.angles, episode.status in REST)


def achieved_goals(angles: NDArray[np.float64], settled: Any) -> NDArray[np.float32]:
    """Return what chains achieve: their joint angles, from −π to π, and 1 if they have settled.

    Parameters
    ----------
    angles : array, shape (n,) or (m, n)
        Headings [rad].
    settled : bool or array of bool, shape (m,)
        Which are at rest.
    """
    out = np.empty(angles.shape, dtype=np.float32)
    joints = np.diff(angles)
    out[..., :-1] = np.arctan2(np.sin(joints), np.cos(joints))
    out[..., -1] = settled
    return out


def _same_outline(one: NDArray[Any], other: NDArray[Any]) -> bool:
    """Return whether two shapes are fully folded and cover the same cells."""
    words = [angles_to_word(joints) for joints in (one, other)]
    for word, joints in zip(words, (one, other), strict=True):
        apart = np.abs(word_to_angles(word) - joints)
        if "S" in word or (apart > SUCCESS_TOLERANCE).any():
            return False
    return _outline(words[0]) == _outline(words[1])


_outline = lru_cache(maxsize=4096)(outline)
