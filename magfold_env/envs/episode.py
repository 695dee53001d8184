"""One chain that is fed out of the tube component by component."""

import math

import numpy as np
from numpy.typing import NDArray

from magfold_env.engine.session import Session
from magfold_env.envs.actions import Choice
from magfold_env.envs.observation import ChainState
from magfold_env.fold import FoldStatus
from magfold_env.scene import Scene
from magfold_env.shapes import angles_to_word

REFERENCE_SPEED = 0.1
"""Speed [m/s] that the scene's draw is applied to, to learn the factor it draws."""


class Episode:
    """A chain in the tube whose components get their magnets and speeds one at a time.

    Parameters
    ----------
    scene : Scene
        A tube scene with ``feed.loading`` ``at_mouth``. Its sequence and speeds are ignored.
    rng : numpy.random.Generator
        Source of every random number of the episode; nothing is drawn after construction.
    """

    def __init__(self, scene: Scene, rng: np.random.Generator) -> None:
        template = scene.replace(feed={"speed": (REFERENCE_SPEED,) * scene.n})
        self._drawn = template.draw(rng)
        self._speed_factors = np.asarray(self._drawn.feed.speed) / REFERENCE_SPEED
        self._session = Session(self._drawn)
        components = range(scene.n)
        forward = scene.feed.direction == "forward"
        self._order = tuple(components if forward else reversed(components))
        self._choices: dict[int, Choice] = {}
        self._state = self._read_state()

    @property
    def choices(self) -> dict[int, Choice]:
        """Settings of the components fed so far, by index (component number − 1)."""
        return dict(self._choices)

    @property
    def released(self) -> NDArray[np.bool_]:
        """Which components have left the tube, shape (n,)."""
        released = np.zeros(len(self._order), dtype=np.bool_)
        released[list(self._order[: self._session.released])] = True
        return released

    @property
    def state(self) -> ChainState:
        """The chain as it is, or as it last was while its numbers were finite."""
        return self._state

    @property
    def joint_angles(self) -> NDArray[np.float64]:
        """Relative angles [rad], shape (n - 1,)."""
        return np.diff(self._state.angles)

    @property
    def status(self) -> FoldStatus | None:
        """How the fold ended, None while components remain to be fed."""
        return self._session.status

    @property
    def message(self) -> str:
        """The engine's account of how the fold ended."""
        return self._session.message

    @property
    def word(self) -> str:
        """The fold word nearest to the chain as it is."""
        return angles_to_word(self.joint_angles)

    @property
    def energy(self) -> float:
        """Magnetic energy of the chain as it is [J]; no number where the simulation has failed."""
        return math.nan if self.status is FoldStatus.FAILED else self._session.energy()

    @property
    def finished(self) -> bool:
        """Whether the fold has ended."""
        return self._session.status is not None

    @property
    def next_component(self) -> int:
        """Index of the component to be fed next.

        Raises
        ------
        RuntimeError
            If all have been fed.
        """
        if len(self._choices) == len(self._order):
            raise RuntimeError("every component has been fed")
        return self._order[len(self._choices)]

    def feed(self, choice: Choice) -> None:
        """Set the next component, feed it out and, after the last one, let the chain settle."""
        index = self.next_component
        self._choices[index] = choice
        self._session.set_component(index, choice.faces, self._actual_speed(index))
        self._session.feed_one()
        if len(self._choices) == len(self._order) and not self.finished:
            self._session.settle()
        state = self._read_state()
        if state.is_finite:
            self._state = state

    @property
    def scene_so_far(self) -> Scene:
        """The drawn scene, with the magnets and speeds of the components fed so far."""
        return self._session.scene()

    def to_scene(self) -> Scene:
        """Return the concrete scene that `magfold_env.simulate` replays bit for bit.

        Raises
        ------
        RuntimeError
            While components remain to be fed: half a chain is not a scene.
        """
        fed, n = len(self._choices), len(self._order)
        if fed < n:
            raise RuntimeError(f"{fed} of {n} components are set; a scene needs all of them")
        return self.scene_so_far

    def _actual_speed(self, index: int) -> float:
        """Return the feed speed of a component that has been chosen [m/s], jitter included."""
        return float(self._choices[index].speed * self._speed_factors[index])

    def _read_state(self) -> ChainState:
        """Copy the chain's state out of the engine."""
        session = self._session
        return ChainState(
            angles=np.array(session.angles),
            rates=np.array(session.rates),
            base=np.array(session.base),
            base_velocity=np.array(session.base_velocity),
        )


def feedable(scene: Scene) -> Scene:
    """Return `scene` if its components can be given magnets one by one as they are fed.

    Raises
    ------
    ValueError
        If it has no tube, no magnets, magnets that act inside the tube, or a single component.
    """
    if scene.mount != "tube":
        raise ValueError(f"scene.mount: {scene.mount!r} is not allowed; must be 'tube'")
    if scene.feed.loading != "at_mouth":
        raise ValueError(
            f"scene.feed.loading: {scene.feed.loading!r} is not allowed; must be 'at_mouth', "
            "or magnets would act before they are chosen"
        )
    if scene.magnets is None:
        raise ValueError("scene.magnets: None is not allowed; must be given")
    if scene.n == 1:
        raise ValueError(
            f"scene.sequence: {scene.sequence} is not allowed; must have two components or more"
        )
    return scene
