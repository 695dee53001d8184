"""Between the public order, component 1 first, and the engine's, held end first."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from magfold_env.engine.state import Array


@dataclass(frozen=True)
class Orientation:
    """How a chain lies in the engine.

    Seen from its other end, a chain has its order reversed, its headings turned by π and its
    joint angles' signs changed.
    """

    flip: bool
    """Whether the engine counts from component n."""
    length: Array
    """Hinge to hinge [m], in the engine's order, shape (n,)."""

    def index(self, i: int) -> int:
        """Map a component's index to the engine's, or back."""
        return self.length.size - 1 - i if self.flip else i

    def start(self, joints: Array, *, centred: bool) -> Array:
        """Headings (n,) in the engine's order for public joint angles (n − 1,).

        The first is 0, or, if ``centred``, their mean is.
        """
        joints = -joints[::-1] if self.flip else joints
        headings = np.concatenate([[0.0], np.cumsum(joints)])
        return headings - headings.mean() if centred else headings

    def headings(self, inside: Array) -> Array:
        """Public headings for the engine's, shape (..., n)."""
        return inside[..., ::-1] + math.pi if self.flip else inside.copy()

    def rates(self, inside: Array) -> Array:
        """Public rates for the engine's, shape (..., n)."""
        return inside[..., ::-1].copy() if self.flip else inside.copy()

    def outer_hinge(self, q: Array, lo: npt.NDArray[np.int64]) -> Array:
        """Component 1's outer hinge [m], (m, 2), for coordinates (m, n + 2).

        ``lo`` (m,) is the first component that moves freely; the base is its inner hinge.
        """
        n = self.length.size
        links = self.length * np.exp(1j * q[:, :n])
        held = np.arange(n) < lo[:, None]
        base = q[:, n] + 1j * q[:, n + 1]
        if self.flip:
            hinge = base + np.where(held, 0.0, links).sum(axis=1)
        else:
            hinge = base - np.where(held, links, 0.0).sum(axis=1)
        return np.stack([hinge.real, hinge.imag], axis=1)
