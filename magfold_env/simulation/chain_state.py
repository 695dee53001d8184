"""The chain as it is: what an observation is made from."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from magfold_env.shapes import centres


@dataclass(frozen=True)
class ChainState:
    """What is known of a chain's motion, component 1 first."""

    angles: NDArray[np.float64]
    rates: NDArray[np.float64]
    """Headings [rad] and their rates [rad/s], shape (n,)."""
    base: NDArray[np.float64]
    base_velocity: NDArray[np.float64]
    """Outer hinge of component 1 [m], mouth of the tube at the origin, and its velocity [m/s],
    shape (2,)."""

    @property
    def joint_angles(self) -> NDArray[np.float64]:
        """Relative angles [rad], shape (n - 1,)."""
        return np.diff(self.angles)

    @property
    def is_finite(self) -> bool:
        """Whether every number is finite."""
        return all(np.isfinite(values).all() for values in vars(self).values())

    def centres(self, side: float) -> NDArray[np.float64]:
        """Return the components' centres [m], shape (n, 2)."""
        return centres(self.angles, side=side, base=self.base)

    def velocities(self, side: float) -> NDArray[np.float64]:
        """Return the velocities of the centres [m/s], shape (n, 2)."""
        turning = np.column_stack((-np.sin(self.angles), np.cos(self.angles)))
        links = np.sqrt(2.0) * side * self.rates[:, None] * turning
        return self.base_velocity + np.cumsum(links, axis=0) - links / 2
