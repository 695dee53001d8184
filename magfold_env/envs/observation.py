"""The flat observation of a chain that is being fed: its layout and how it is filled."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from magfold_env.envs.actions import FASTEST, SLOWEST, Choice
from magfold_env.shapes import LETTERS, centres

VELOCITY_SCALE = 1.0
"""Velocity that is shown as one half [m/s]."""

RATE_SCALE = 100.0
"""Angular rate that is shown as one half [rad/s]."""


@dataclass(frozen=True)
class ChainState:
    """What the engine knows of the chain, component 1 first.

    Attributes
    ----------
    angles, rates : array, shape (n,)
        Headings [rad] and their rates [rad/s].
    base, base_velocity : array, shape (2,)
        Outer hinge of component 1 [m], mouth of the tube at the origin, and its velocity [m/s].
    """

    angles: NDArray[np.float64]
    rates: NDArray[np.float64]
    base: NDArray[np.float64]
    base_velocity: NDArray[np.float64]

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


@dataclass(frozen=True)
class ObservationLayout:
    """Where each group of entries lies in the observation of a chain of `n` components.

    Attributes
    ----------
    n : int
        Number of components.
    side : float
        Edge length of a casing [m].
    """

    n: int
    side: float

    @cached_property
    def slices(self) -> dict[str, slice]:
        """Slice of each group, by name, in the order in which they lie."""
        n = self.n
        sizes = {
            "target": 3 * (n - 1),
            "released": n,
            "magnets": 4 * n,
            "speed": n,
            "joint": n - 1,
            "heading": 2 * n,
            "rate": n,
            "position": 2 * n,
            "velocity": 2 * n,
        }
        ends = np.cumsum(list(sizes.values())).tolist()
        return {
            name: slice(end - size, end)
            for (name, size), end in zip(sizes.items(), ends, strict=True)
        }

    @property
    def space(self) -> spaces.Box[np.float32]:
        """The observation space: every entry lies in [−1, 1]."""
        size = self.slices["velocity"].stop
        return spaces.Box(-1.0, 1.0, shape=(size,), dtype=np.float32)

    def observe(
        self,
        state: ChainState,
        released: NDArray[np.bool_],
        choices: Mapping[int, Choice],
        target: str,
    ) -> NDArray[np.float32]:
        """Return a new observation.

        Parameters
        ----------
        state : ChainState
            The chain as it is.
        released : array of bool, shape (n,)
            Which components have left the tube.
        choices : dict
            Settings of the components fed so far, by index.
        target : str
            The word that is wanted.
        """
        length = self.n * np.sqrt(2.0) * self.side
        joints = np.diff(state.angles)
        groups = {
            "target": np.array([[letter == other for other in LETTERS] for letter in target]),
            "released": released,
            "magnets": self._magnets(choices),
            "speed": self._speeds(choices),
            "joint": np.arctan2(np.sin(joints), np.cos(joints)) / np.pi,
            "heading": np.column_stack((np.sin(state.angles), np.cos(state.angles))),
            "rate": squash(state.rates / RATE_SCALE),
            "position": squash(state.centres(self.side) / length),
            "velocity": squash(state.velocities(self.side) / VELOCITY_SCALE),
        }
        observation = np.empty(self.space.shape, dtype=np.float32)
        for name, values in groups.items():
            observation[self.slices[name]] = values.ravel()
        # Rounding to single precision may leave the interval by one unit in the last place.
        return np.clip(observation, -1.0, 1.0)

    def _magnets(self, choices: Mapping[int, Choice]) -> NDArray[np.float64]:
        """Return +1 for N, −1 for S, 0 for not set yet, shape (n, 4)."""
        magnets = np.zeros((self.n, 4))
        for index, choice in choices.items():
            magnets[index] = [1.0 if face == "N" else -1.0 for face in choice.faces]
        return magnets

    def _speeds(self, choices: Mapping[int, Choice]) -> NDArray[np.float64]:
        """Return the feed speeds asked for on a log scale over [−1, 1], 0 where not set yet."""
        speeds = np.zeros(self.n)
        middle = np.sqrt(SLOWEST * FASTEST)
        for index, choice in choices.items():
            speeds[index] = np.log(choice.speed / middle) / np.log(FASTEST / middle)
        return speeds


def squash(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return ``x / (1 + |x|)``: inside (−1, 1), strictly increasing, so nothing is clipped away."""
    return values / (1.0 + np.abs(values))
