"""The pinned chain whose accelerations all contenders of the scaling benchmark find."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from magfold_env.engine.state import Array, Bodies

GRAVITY = (0.0, -9.81)  # [m/s²]
PITCH = 0.0177  # hinge to hinge [m]
MASS = 0.0037  # [kg]


@dataclass(frozen=True, eq=False)
class ChainProblem:
    """A chain that hangs from a fixed hinge, and its state; gravity is `GRAVITY`."""

    bodies: Bodies
    angles: Array
    """Headings (n,) [rad]."""
    rates: Array
    """Their rates (n,) [rad/s]."""
    torques: Array
    """Of the motors in the hinges (n,) [N·m]; motor i stands on component i − 1."""

    @property
    def n(self) -> int:
        """Number of components."""
        return self.angles.size

    @property
    def forces(self) -> Array:
        """Generalised forces (n,) [N·m] of the motors, which turn back what they stand on."""
        return self.torques - np.append(self.torques[1:], 0.0)

    @property
    def joint_angles(self) -> Array:
        """Turn of each component against the one before, the first against x; (n,) [rad]."""
        return np.diff(self.angles, prepend=0.0)

    @property
    def joint_rates(self) -> Array:
        """Their rates (n,) [rad/s]."""
        return np.diff(self.rates, prepend=0.0)


def random_problem(n: int, seed: int = 0) -> ChainProblem:
    """Return a chain of unequal squares, bent anyhow within its stops and moving."""
    rng = np.random.default_rng([seed, n])
    mass = MASS * rng.uniform(0.7, 1.3, n)
    bodies = Bodies(
        mass=mass,
        inertia=mass * PITCH**2 / 12.0 * rng.uniform(0.7, 1.3, n),
        reach=np.full(n, PITCH / 2.0),
        length=np.full(n, PITCH),
    )
    return ChainProblem(
        bodies=bodies,
        angles=np.cumsum(rng.uniform(-np.pi / 2.0, np.pi / 2.0, n)),
        rates=rng.normal(0.0, 10.0, n),
        torques=rng.normal(0.0, MASS * 9.81 * PITCH, n),
    )
