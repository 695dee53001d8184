"""How far an episode has come: which components are out, and what was chosen for them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from magfold_env.envs.spaces.actions import PATTERNS, SIGNS, scaled_speed
from magfold_env.scene import SIGNS as SIGN_OF

_INDEX = {faces: index for index, faces in enumerate(PATTERNS)}


@dataclass(frozen=True)
class Progress:
    """What is chosen and released, component 1 first; arrays are filled in place.

    Attributes
    ----------
    order : tuple of int
        Indices of the components (number − 1) in the order in which they leave the tube.
    released : array of bool, shape (n,)
        Which components have left the tube.
    signs : array, shape (n, 4)
        Outward poles, N = 1 and S = −1; 0 where not set yet or without a magnet.
    speeds : array, shape (n,)
        Speeds asked for, on the log scale from −1 to 1; 0 where not set yet.
    """

    order: tuple[int, ...]
    released: NDArray[np.bool_]
    signs: NDArray[np.float64]
    speeds: NDArray[np.float64]

    @classmethod
    def begin(cls, n: int, direction: str) -> "Progress":
        """Return the progress of a chain of `n` components that is all in the tube."""
        order = tuple(range(n)) if direction == "forward" else tuple(reversed(range(n)))
        return cls(order, np.zeros(n, dtype=np.bool_), np.zeros((n, 4)), np.zeros(n))

    @staticmethod
    def signs_of(faces: str) -> NDArray[np.float64]:
        """Return the outward poles of a component, shape (4,)."""
        if faces in _INDEX:
            return SIGNS[_INDEX[faces]]
        return np.array([SIGN_OF[face] for face in faces])

    def choose(self, index: int, faces: str, speed: float) -> None:
        """Note the faces of a component and the speed [m/s] that was asked for."""
        self.signs[index] = self.signs_of(faces)
        self.note_speed(index, speed)

    def note_speed(self, index: int, speed: float) -> None:
        """Note the speed [m/s] that was asked for a component."""
        self.speeds[index] = scaled_speed(speed)

    def release(self, count: int) -> None:
        """Note that the first `count` components in the order of feed are out."""
        self.released[list(self.order[:count])] = True

    def copy(self) -> "Progress":
        """Return a copy with arrays of its own."""
        return Progress(self.order, self.released.copy(), self.signs.copy(), self.speeds.copy())
