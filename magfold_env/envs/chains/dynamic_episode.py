"""An episode in which the chain is simulated."""

import copy
import math
from typing import Self

import numpy as np
from numpy.typing import NDArray

from magfold_env.envs.chains.progress import Progress
from magfold_env.fold import FoldStatus, Trajectory
from magfold_env.scene import Scene
from magfold_env.shapes import angles_to_word
from magfold_env.simulation.env_session import EnvSession

REFERENCE_SPEED = 0.1
"""Speed [m/s] that the scene's draw is applied to, to learn the factors it draws."""


class DynamicEpisode:
    """A chain in the tube; see `magfold_env.envs.chains.episode.Episode`.

    Parameters
    ----------
    template : Scene
        What `dynamic_template` returns.
    rng : numpy.random.Generator
        Source of every random number of the episode; nothing is drawn after construction.
    frame_rate : float, optional
        Frames of the motion that are recorded a simulated second [1/s]; they change nothing.
    """

    def __init__(
        self, template: Scene, rng: np.random.Generator, frame_rate: float | None = None
    ) -> None:
        self._frame_rate = frame_rate
        self._drawn = template.draw(rng)
        self._speed_factors = self._drawn.speeds / REFERENCE_SPEED
        self._session = EnvSession(self._drawn, frame_rate)
        self._fed = 0
        self.progress = Progress.begin(template.n, template.feed.direction)
        self.state = self._session.chain_state()

    @property
    def fed(self) -> int:
        """Number of components whose magnets and speed are chosen."""
        return self._fed

    @property
    def status(self) -> FoldStatus | None:
        """How the fold ended; None while it goes on."""
        return self._session.status

    @property
    def message(self) -> str:
        """The engine's account of how the fold ended."""
        return self._session.message

    @property
    def word(self) -> str:
        """The fold word nearest to the chain as it is."""
        return angles_to_word(self.state.joint_angles)

    @property
    def energy(self) -> float:
        """Magnetic energy of the chain as it is [J]; no number where the simulation failed."""
        return math.nan if self.status is FoldStatus.FAILED else self._session.energy()

    @property
    def held(self) -> NDArray[np.bool_]:
        """Which components friction holds, shape (n,)."""
        return self._session.held

    @property
    def motion(self) -> Trajectory | None:
        """What was recorded so far; None if nothing is."""
        motion = self._session.motion
        return motion.finite() if motion else motion

    @property
    def next_component(self) -> int:
        """Index of the component to be fed next (its number − 1)."""
        if self._fed == self._drawn.n:
            raise RuntimeError("every component has been fed")
        return self.progress.order[self._fed]

    def feed(self, faces: str, speed: float) -> None:
        """Set the next component's faces and speed [m/s] and feed it out."""
        index = self.next_component
        self.progress.choose(index, faces, speed)
        self._fed += 1
        session = self._session
        session.set_component(index, faces, float(speed * self._speed_factors[index]))
        session.feed_one()
        if self._fed == self._drawn.n and session.status is None:
            session.settle()
        self._look()

    def run(self, sequence: tuple[str, ...], speed: float) -> None:
        """Feed a whole chain out at one speed [m/s] and let it settle."""
        speeds: NDArray[np.float64] = speed * self._speed_factors
        scene = self._drawn.replace(sequence=sequence, feed={"speed": speeds})
        self._session = EnvSession(scene, self._frame_rate)
        for index, faces in enumerate(sequence):
            self.progress.choose(index, faces, speed)
        self._fed = self._drawn.n
        for _ in sequence:
            self._session.feed_one()
        self._session.settle()
        self._look()

    @property
    def scene_so_far(self) -> Scene:
        """The drawn scene, with the magnets and speeds of the components fed so far."""
        return self._session.scene()

    def to_scene(self) -> Scene:
        """Return the concrete scene that `magfold_env.simulation.simulate` replays bit for bit."""
        if self._fed < self._drawn.n:
            raise RuntimeError(
                f"{self._fed} of {self._drawn.n} components are set; a scene needs all of them"
            )
        return self.scene_so_far

    def copy(self) -> Self:
        """Return an episode in the same state that goes its own way from here."""
        twin = copy.copy(self)
        twin._session = self._session.copy()
        twin.progress = self.progress.copy()
        return twin

    def _look(self) -> None:
        """Take in where the chain is now."""
        self.progress.release(self._session.released)
        state = self._session.chain_state()
        if state.is_finite:
            self.state = state


def dynamic_template(scene: Scene) -> Scene:
    """Return `scene` as episodes draw from it: at a speed that shows the drawn factors."""
    return scene.replace(feed={"speed": (REFERENCE_SPEED,) * scene.n})
