"""The form in which networks receive observations, in training and in play."""

from collections.abc import Callable
from functools import partial
from typing import Any, cast

import numpy as np
from gymnasium import Space, spaces
from gymnasium.vector.utils import batch_space

from magfold_env.envs.chains.arrays import Bools
from magfold_env.envs.spaces.observation import Layout
from magfold_env.envs.wrappers.canonical import CanonicalView
from magfold_env.envs.wrappers.vector import Frames
from magfold_env.scene import Scene
from magfold_env.scoring.policy_file import ObservationForm

TASK = ("target", "magnets", "direction")
"""Groups that say what the task is. In the canonical view, only the newest of several stacked
observations contains them; networks learn faster without the copies."""


def blind(layout: Layout, observation: Any) -> Any:
    """Return observations without measured motion; `layout` contains the groups of their entries.

    Entries that are known without a camera stay: the target, the magnets and speeds chosen so far,
    and which components are out of the tube. Entries that a camera would measure become 0: joints,
    headings, rates, positions, velocities and the achieved goal. 0 favours neither side, and
    networks whose inputs are ordered from the mouth already read 0 for components in the tube. In
    tracks with a time limit, the force becomes 0 as well.
    """
    if isinstance(observation, dict):
        seen = cast("dict[str, Any]", observation)
        return {
            **seen,
            "observation": blind(layout, seen["observation"]),
            "achieved_goal": np.zeros_like(seen["achieved_goal"]),
        }
    entries = observation.copy()
    layout.hide(entries)
    return entries


def form_space(shown: ObservationForm, space: Space[Any]) -> Space[Any]:
    """Return the space of the observations in this form."""
    return batch_space(space, shown.frames) if shown.frames > 1 else space


class ObservationView:
    """Brings observations of many environments into the form for networks.

    `space` is the space of one observation; its `layout` and the `scene` are those of the
    environment.
    """

    def __init__(
        self,
        shown: ObservationForm,
        layout: Layout,
        scene: Scene,
        space: Space[Any],
        count: int,
    ) -> None:
        changes: list[Callable[[Any], Any]] = []
        self._once = np.zeros(0, dtype=np.int64)
        if shown.blind:
            changes.append(partial(blind, layout))
        if shown.view == "canonical":
            changes.append(CanonicalView(layout, scene))
            entries = np.arange(layout.size)
            self._once = np.concatenate([entries[layout.slices[name]] for name in TASK])
        self._changes = changes
        self.frames = None
        if shown.frames > 1:
            self.frames = Frames(cast("spaces.Box", space), shown.frames, count)

    def _changed(self, observations: Any) -> Any:
        for change in self._changes:
            observations = change(observations)
        return observations

    def of(self, observations: Any, begun: Bools) -> Any:
        """Return observations in this form; those where `begun` is true follow a reset."""
        seen = self._changed(observations)
        return self._stacked(self.frames.push(seen, begun, ~begun)) if self.frames else seen

    def last(self, observation: Any, row: int) -> Any:
        """Return an episode's last observation in this form; call this before the next `of`."""
        seen = self._changed(observation)
        return self._stacked(self.frames.last(seen, row)) if self.frames else seen

    def _stacked(self, frames: Any) -> Any:
        """Remove the task from all but the newest of some frames, (…, frames, entries)."""
        frames[..., :-1, self._once] = 0.0
        return frames
