"""How the feed speed alone is written as an action, standstill included."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, cast

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from magfold_env.envs.spaces.action_reading import as_integers, as_numbers
from magfold_env.envs.spaces.action_table import ActionKind
from magfold_env.envs.spaces.actions import FASTEST, speed_levels
from magfold_env.envs.tasks.checks import one_of


@dataclass(frozen=True)
class SpeedTable:
    """How a feed speed is written.

    Attributes
    ----------
    levels : int
        Number of speed levels besides standstill, log-spaced from 0.01 to 0.6 m/s.
    kind : {"discrete", "multidiscrete", "box", "dict"}
        ``discrete``: 0 is standstill, k the k-th level. ``multidiscrete``: the same as a list of
        one. ``box``: one number x from −1 to 1, for the speed 0.6 m/s · ((x + 1)/2)². ``dict``:
        ``speed``, as in ``box``.
    """

    levels: int
    kind: ActionKind = "discrete"

    def __post_init__(self) -> None:
        speed_levels(self.levels)
        one_of("actions", self.kind, ActionKind)

    @cached_property
    def speeds(self) -> NDArray[np.float64]:
        """Standstill and the levels [m/s], shape (levels + 1,), ascending."""
        return np.concatenate([[0.0], speed_levels(self.levels)])

    @cached_property
    def space(self) -> spaces.Space[Any]:
        """Gymnasium's description of the actions."""
        if self.kind == "discrete":
            return spaces.Discrete(self.levels + 1)
        if self.kind == "multidiscrete":
            return spaces.MultiDiscrete([self.levels + 1])
        box = spaces.Box(-1.0, 1.0, shape=(1,), dtype=np.float32)
        return box if self.kind == "box" else spaces.Dict(speed=box)

    def decode(self, action: Any) -> float:
        """Return the speed [m/s] that `action` asks for.

        Raises
        ------
        ValueError
            If `action` is not in the space.
        """
        if self.kind in ("discrete", "multidiscrete"):
            level = as_integers([action] if self.kind == "discrete" else action, (self.levels + 1,))
            if level is not None:
                return float(self.speeds[level[0]])
            wanted = f"an integer, 0..{self.levels}"
            wanted = wanted if self.kind == "discrete" else f"a list of {wanted}"
            raise ValueError(f"action: {action!r} is not allowed; must be {wanted}")
        value = action
        if self.kind == "dict" and isinstance(action, Mapping):
            value = cast("Mapping[str, Any]", action).get("speed")
        number = as_numbers(value, 1)
        if number is None:
            wanted = "one number from -1 to 1"
            wanted = wanted if self.kind == "box" else f"a mapping of speed ({wanted})"
            raise ValueError(f"action: {action!r} is not allowed; must be {wanted}")
        return FASTEST * float(0.5 * (number[0] + 1.0)) ** 2
