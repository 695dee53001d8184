"""What networks are shown of what is observed, in training and wherever they play."""

from typing import Any, cast

import numpy as np
from gymnasium import Space, spaces
from gymnasium.vector.utils import batch_space

from magfold_env.envs.chains.arrays import Bools
from magfold_env.envs.spaces.observation import Layout
from magfold_env.envs.wrappers.vector import Frames
from magfold_env.scoring.policy_file import Shown


def blind(layout: Layout, observation: Any) -> Any:
    """Return an observation, or many, without motion; `layout` says where that lies.

    What is known without looking stays: the target, the magnets and speeds asked for so far, and
    which components are out, as many as there were steps. What a camera would have to measure
    (joints, headings, rates, positions and velocities; the goal achieved) is 0. Forces, events and
    time are not in it. Zero is what networks that count from the mouth see in place of components
    that are not out, and no side is favoured by it. Where time runs, the force is 0 as well.
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
    """Return the space of what is shown of observations."""
    return batch_space(space, shown.frames) if shown.frames > 1 else space


class View:
    """What is shown of many environments, all of which are observed at once.

    Parameters
    ----------
    shown : Shown
        What is wanted.
    layout : Layout or None
        That of the observations, which only the blind need.
    space : gymnasium.Space
        Of one observation.
    count : int
        How many environments.
    """

    def __init__(self, shown: Shown, layout: Layout | None, space: Space[Any], count: int) -> None:
        self._layout = layout if shown.blind else None
        self.frames = None
        if shown.frames > 1:
            self.frames = Frames(cast("spaces.Box", space), shown.frames, count)

    def of(self, observations: Any, begun: Bools) -> Any:
        """Return what is shown; some environments have begun, the others made a step."""
        if self._layout is not None:
            observations = blind(self._layout, observations)
        return self.frames.push(observations, begun, ~begun) if self.frames else observations

    def last(self, observation: Any, row: int) -> Any:
        """Return what is shown at the end of an episode; the next one's start is shown after."""
        if self._layout is not None:
            observation = blind(self._layout, observation)
        return self.frames.last(observation, row) if self.frames else observation
