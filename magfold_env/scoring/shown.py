"""The form in which networks get observations, in training and in play."""

from typing import Any, cast

import numpy as np
from gymnasium import Space, spaces
from gymnasium.vector.utils import batch_space

from magfold_env.envs.chains.arrays import Bools
from magfold_env.envs.spaces.observation import Layout
from magfold_env.envs.wrappers.vector import Frames
from magfold_env.scoring.policy_file import Shown


def blind(layout: Layout, observation: Any) -> Any:
    """Return an observation, or many, without motion; `layout` contains the groups of entries.

    Entries that are known without a camera stay: the target, the magnets and speeds chosen so far,
    and which components are out, one per step. Entries that a camera would measure (joints,
    headings, rates, positions and velocities; the achieved goal) become 0, as for components in the
    tube in networks that count from the mouth; zero favours no side. In tracks with time, the force
    is 0 as well.
    """
    if isinstance(observation, dict):
        seen = cast("dict[str, Any]", observation)
        return {
            **seen,
            "observation": blind(layout, seen["observation"]),
            "achieved_goal": np.zeros_like(seen["achieved_goal"]),
        }
    entries = observation.copy()
    for name in layout.measured:
        entries[..., layout.slices[name]] = 0.0
    return entries


def shown_space(shown: Shown, space: Space[Any]) -> Space[Any]:
    """Return the space of the observations in this form."""
    return batch_space(space, shown.frames) if shown.frames > 1 else space


class View:
    """The observations of many environments in the form for networks.

    `space` is that of one observation; its `layout` is needed only to remove motion.
    """

    def __init__(self, shown: Shown, layout: Layout | None, space: Space[Any], count: int) -> None:
        self._layout = layout if shown.blind else None
        self.frames = None
        if shown.frames > 1:
            self.frames = Frames(cast("spaces.Box", space), shown.frames, count)

    def of(self, observations: Any, begun: Bools) -> Any:
        """Return the observations; some environments have begun and the others made a step."""
        if self._layout is not None:
            observations = blind(self._layout, observations)
        return self.frames.push(observations, begun, ~begun) if self.frames else observations

    def last(self, observation: Any, row: int) -> Any:
        """Return the last observation of an episode, before the start of the next one is added."""
        if self._layout is not None:
            observation = blind(self._layout, observation)
        return self.frames.last(observation, row) if self.frames else observation
