"""What an agent decides that takes components from a tray, and how it is written down."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from magfold_env.envs.spaces.actions import (
    FASTEST,
    PATTERNS,
    SLOWEST_LEVEL,
    ActionKind,
    Actions,
    Floats,
    Ints,
)
from magfold_env.envs.tasks.checks import one_of, whole

FACES: Ints = np.array(
    [np.roll(faces, turn) for faces in ([0, 1, 2, 3], [3, 2, 1, 0]) for turn in range(4)]
)
"""Which face of a component lies where, (8, 4), for every way to lie: with its one side up after 0
to 3 quarter turns to the left, then with the other side up, turned over about its long axis."""

LYING: Ints = np.array(
    [
        [PATTERNS.index("".join(faces[place] for place in places)) for places in FACES.tolist()]
        for faces in PATTERNS
    ]
)
"""Numbers of the patterns that each pattern makes in every way to lie, (16, 8)."""

AHEAD, BACK, PULL = range(3)
"""Ways to go: feed a component, draw one back, or pull at the chain."""

TrayKind = Literal["multidiscrete", "discrete"]
TrayChoice = tuple[Ints, Ints, Floats, Ints]
"""Components, ways to lie, feed speeds [m/s], and ways to go, (m,)."""


@dataclass(frozen=True)
class TrayTable(Actions):
    """How a component of a tray, how it lies, and a speed are written.

    Attributes
    ----------
    parts : int
        Number of components on the tray at first.
    levels : int
        Number of speed levels, log-spaced from 0.03 to 0.6 m/s, both included.
    kind : {"multidiscrete", "discrete"}
        ``multidiscrete``: the component, the way to lie, the speed level, and 1 to draw back with
        that speed instead. ``discrete``: the same as one number, the last digit 1 to draw back.
    ways : int
        Number of ways to go: 2, ahead and back, or 3, with which the last number, or digit, may be
        2, to pull at the chain.
    """

    parts: int
    levels: int
    kind: ActionKind = "multidiscrete"
    ways: int = 2

    def __post_init__(self) -> None:
        whole("speeds", self.levels, 2)
        one_of("actions", self.kind, TrayKind)

    @cached_property
    def speeds(self) -> Floats:
        """The speed levels [m/s], ascending."""
        return np.round(np.geomspace(SLOWEST_LEVEL, FASTEST, self.levels), 12)

    @property
    def sizes(self) -> tuple[int, ...]:
        """Number of components, ways to lie, speed levels, and of ways to go."""
        return self.parts, len(FACES), self.levels, self.ways

    @property
    def per_level(self) -> int:
        """How many of the ``discrete`` actions a speed level makes."""
        return int(np.prod(self.sizes)) // self.levels

    @cached_property
    def space(self) -> spaces.Space[Any]:
        """Gymnasium's description of the actions."""
        if self.kind == "discrete":
            return spaces.Discrete(int(np.prod(self.sizes)))
        return spaces.MultiDiscrete(list(self.sizes))

    def read(self, actions: Any, count: int) -> TrayChoice:
        """Return what `count` actions ask for, as Gymnasium batches them.

        Raises
        ------
        ValueError
            If one of `actions` is not in the space, or there are not `count`.
        """
        if self.kind == "discrete":
            number = self._digits(actions, (int(np.prod(self.sizes)),), count)
            digits = np.stack(np.unravel_index(number, self.sizes), axis=-1)
        else:
            digits = self._digits(actions, self.sizes, count)
        part, lie, level, way = digits.T
        return part, lie, self.speeds[level], way

    def encode(self, part: int, lie: int, speed: float, *, back: bool = False) -> Any:
        """Return the action for a component, a way to lie and the level next to a speed [m/s]."""
        level = int(np.argmin(np.abs(np.log(self.speeds / speed))))
        return self._written(part, lie, level, BACK if back else AHEAD)

    def write(self, choice: TrayChoice) -> Any:
        """Return the actions for components, ways to lie, levels next to speeds, and ways to go."""
        part, lie, speeds, way = choice
        level = np.abs(np.log(self.speeds / speeds[:, None])).argmin(axis=1)
        if self.kind == "discrete":
            return np.ravel_multi_index((part, lie, level, way), self.sizes)
        return np.stack([part, lie, level, way], axis=1)

    @property
    def pull(self) -> Any:
        """The action that pulls at the chain, where there is one."""
        return self._written(0, 0, 0, PULL)

    def _written(self, *digits: int) -> Any:
        if self.kind == "discrete":
            return np.int64(np.ravel_multi_index(digits, self.sizes))
        return np.array(digits)

    def masks(self, there: NDArray[np.bool_], back: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return which actions ask for what can be done, as sb3-contrib's ``MaskablePPO`` wants it.

        Parameters
        ----------
        there : array of bool, shape (m, parts)
            Which components are on the trays.
        back : array of bool, shape (m,)
            Whether a component can be drawn back.

        Returns
        -------
        array of bool, shape (m, …)
            One entry an action for ``discrete``, for ``multidiscrete`` the masks of its dimensions
            one after another.
        """
        count = len(back)
        go = np.ones((count, self.ways), dtype=np.bool_)
        go[:, BACK] = back
        if self.kind == "multidiscrete":
            others = np.ones((count, len(FACES) + self.levels), dtype=np.bool_)
            return np.concatenate([there, others, go], axis=1)
        mask = np.ones((count, *self.sizes), dtype=np.bool_)
        mask[..., AHEAD] = there[:, :, None, None]
        mask[..., BACK] = back[:, None, None, None]
        return mask.reshape(count, -1)

    @property
    def _allowed(self) -> str:
        """What an action must be, in words."""
        if self.kind == "discrete":
            return f"an integer, 0..{int(np.prod(self.sizes)) - 1}"
        most = [size - 1 for size in self.sizes]
        return (
            f"four integers, component 0..{most[0]}, way to lie 0..{most[1]}, speed level "
            f"0..{most[2]} and {self._ways_allowed}"
        )

    @property
    def _ways_allowed(self) -> str:
        return "0 or 1, to draw back" if self.ways == PULL else "0, 1, to draw back, or 2, to pull"
