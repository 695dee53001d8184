"""What has happened in many episodes since they began: enough to play them again."""

import copy
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class Chronicle(NamedTuple):
    """How each episode began, and what was chosen in it since.

    An episode is decided by its draws and by what is chosen. So this is the state of a chain,
    however much the engine keeps of it.
    """

    rngs: NDArray[Any]  # states of the random numbers before anything was drawn, (m,)
    targets: Ints  # numbers among the task's targets, (m,)
    steps: Ints  # steps made, (m,)
    patterns: Ints  # of every step, (m, steps, components at a time)
    speeds: Floats  # feed speeds asked for [m/s], (m, steps)
    scaled: Floats  # the same on the log scale, (m, steps)

    @classmethod
    def empty(cls, count: int, horizon: int, components: int) -> "Chronicle":
        """Return the chronicle of episodes that have not begun."""
        return cls(
            np.full(count, None, dtype=object),
            np.zeros(count, dtype=np.int64),
            np.zeros(count, dtype=np.int64),
            np.zeros((count, horizon, components), dtype=np.int64),
            np.zeros((count, horizon)),
            np.zeros((count, horizon)),
        )

    def begin(self, rows: Ints, rngs: list[Any], targets: Ints) -> None:
        """Note that some episodes begin."""
        for row, state in zip(rows.tolist(), rngs, strict=True):
            self.rngs[row] = state
        self.targets[rows] = targets
        self.steps[rows] = 0

    def note(self, rows: Ints, patterns: Ints, speeds: Floats, scaled: Floats) -> None:
        """Note what is chosen in a step."""
        steps = self.steps[rows]
        self.patterns[rows, steps] = patterns
        self.speeds[rows, steps], self.scaled[rows, steps] = speeds, scaled
        self.steps[rows] = steps + 1

    def copy(self) -> "Chronicle":
        """Return one that stays as it is."""
        return copy.deepcopy(self)
