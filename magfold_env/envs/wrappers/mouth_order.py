"""Observations of tube feed, ordered from the mouth of the tube.

The environment lists components from the chain's first to its last, so the position of the
component that left the tube last changes with every step. Here that component always comes first,
and earlier ones follow. The target begins at the joint that folds next. What a network learns at
one joint thus applies to the others. Missing entries are 0. The step number comes last, one-hot.
"""

from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.utils import RecordConstructorArgs
from numpy.typing import NDArray

from magfold_env.envs.spaces.observation import Layout, chain_layout

WIDTHS = {"magnets": 4, "speed": 1, "heading": 2, "rate": 1, "position": 2, "velocity": 2}
"""Groups with entries for each component, and the number of entries per component."""

LETTERS = 3
"""Number of entries per target letter."""


def mouth_order(n: int, width: int, backward: bool) -> NDArray[np.int64]:
    """Return the indices of the ordered entries at each step from 0 to n, (n + 1, entries).

    The target comes first, with `width` entries per joint, then the chain of `n` components. A
    missing entry has the index after the last. If `backward`, component ``n`` leaves first.
    """
    layout = chain_layout(n, side=1.0, words=())
    target = slice(0, width * (n - 1))
    missing = target.stop + layout.size

    entries = np.arange(missing)

    def group(span: slice, width: int) -> NDArray[np.int64]:
        """Return a group's indices, one row per component or joint, in the order of feed."""
        rows = entries[span].reshape(-1, width)
        return rows[::-1] if backward else rows

    def pick(rows: NDArray[np.int64], places: NDArray[np.int64]) -> NDArray[np.int64]:
        exists = (places >= 0) & (places < len(rows))
        return np.where(exists[:, None], rows[places % len(rows)], missing).ravel()

    wanted = group(target, width)
    angles = target.stop + group(layout.slices["joint"], 1)
    components = [target.stop + group(layout.slices[name], each) for name, each in WIDTHS.items()]
    steps: list[NDArray[np.int64]] = []
    for step in range(n + 1):
        # The joint that folds next is between the component that is out and the next one.
        ahead = np.arange(step - 1, step + n - 2)
        behind = np.arange(step - 2, step - n - 1, -1)
        out = np.arange(step - 1, step - n - 1, -1)
        known = [pick(wanted, ahead), pick(wanted, behind), pick(angles, behind)]
        steps.append(np.concatenate(known + [pick(rows, out) for rows in components]))
    return np.array(steps)


class MouthOrder:
    """Reorders one or many observations of ``MagFold/TubeFeed-v0``, the only accepted layout.

    If `backward`, component ``n`` leaves the tube first.
    """

    def __init__(self, layout: Layout, backward: bool) -> None:
        if layout != chain_layout(layout.n, layout.side):
            raise ValueError(
                f"env: observations of {', '.join(layout.slices)} are not allowed; "
                "must be those of MagFold/TubeFeed-v0"
            )
        self._order = mouth_order(layout.n, LETTERS, backward)
        self._released = layout.slices["released"]

    @property
    def space(self) -> spaces.Box:
        """The space of one observation."""
        return spaces.Box(-1.0, 1.0, (sum(self._order.shape),), np.float32)

    def __call__(self, entries: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the observations, (…, entries), in the new order."""
        step = entries[..., self._released].sum(axis=-1).round().astype(np.int64)
        padded = np.concatenate([entries, np.zeros_like(entries[..., :1])], axis=-1)
        ordered = np.take_along_axis(padded, self._order[step], axis=-1)
        one_hot = np.eye(len(self._order), dtype=np.float32)[step]
        return np.concatenate([ordered, one_hot], axis=-1)


class MouthOrderObservation(gymnasium.ObservationWrapper[Any, Any, Any], RecordConstructorArgs):
    """Reorders observations of ``MagFold/TubeFeed-v0`` from the mouth of the tube.

    The vector form is `magfold_env.envs.wrappers.vector.MouthOrderObservation`. It does not
    accept the goal environment, because hindsight replay changes goals afterwards; its learners
    must reorder observations themselves with `mouth_order`.

    Parameters
    ----------
    env : gymnasium.Env
        The environment.

    Raises
    ------
    ValueError
        If the observations of `env` have another layout.
    """

    def __init__(self, env: gymnasium.Env[Any, Any]) -> None:
        RecordConstructorArgs.__init__(self)
        super().__init__(env)
        backward = env.get_wrapper_attr("scene").feed.direction == "backward"
        self._ordered = MouthOrder(env.get_wrapper_attr("layout"), backward)
        self.observation_space = self._ordered.space

    def observation(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the observation in the new order."""
        return self._ordered(observation)
