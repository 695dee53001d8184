"""An episode in which a given chain is fed at a speed that may change at any time."""

import copy
import math
from collections.abc import Sequence
from typing import Self

import numpy as np
from numpy.typing import NDArray

from magfold_env.envs.chains.dynamic_episode import REFERENCE_SPEED
from magfold_env.envs.chains.progress import Progress
from magfold_env.envs.control.pushed_session import PushedSession
from magfold_env.envs.spaces.actions import SLOWEST
from magfold_env.fold import FoldStatus
from magfold_env.scene import Scene
from magfold_env.shapes import angles_to_word

INTERVAL = 0.02
"""Time between two decisions [s]."""

JAMMED = "jammed"
"""Status of a chain that does not give way to the push."""


class ControlEpisode:
    """A chain in the tube.

    Parameters
    ----------
    drawn : Scene
        A concrete scene whose feed speeds are `REFERENCE_SPEED`, times what was drawn.
    push_limit : float or None
        Largest force with which the feed can push [N]; None for any.
    """

    def __init__(self, drawn: Scene, push_limit: float | None) -> None:
        self._drawn = drawn
        self._push_limit = push_limit
        self._speed_factors = drawn.speeds / REFERENCE_SPEED
        self._session = PushedSession(drawn)
        self._stuck = ""
        self.asked: list[float] = []
        self.force = 0.0
        self.progress = Progress.begin(drawn.n, drawn.feed.direction)
        for index, faces in enumerate(drawn.sequence):
            self.progress.signs[index] = self.progress.signs_of(faces)
        self.state = self._session.chain_state()

    @property
    def status(self) -> str | None:
        """How the fold ended: a `FoldStatus` or `JAMMED`; None while it goes on."""
        if self._stuck or self._session.jammed:
            return JAMMED
        return None if self._session.status is None else str(self._session.status)

    @property
    def fold_status(self) -> FoldStatus | None:
        """The same in the engine's terms: a chain that is stuck has misfolded."""
        return FoldStatus.MISFOLDED if self.status == JAMMED else self._session.status

    @property
    def message(self) -> str:
        """How it ended, in words."""
        return self._stuck or self._session.message

    @property
    def time(self) -> float:
        """Time since the beginning [s]."""
        return INTERVAL * len(self.asked)

    @property
    def held(self) -> NDArray[np.bool_]:
        """Which components friction holds, shape (n,)."""
        return self._session.held

    @property
    def out_of_next(self) -> float:
        """How far the component in the mouth is out, from 0 to 1; 1 if none is left inside."""
        return self._session.progress_of_next

    @property
    def word(self) -> str:
        """The fold word nearest to the chain as it is."""
        return angles_to_word(self.state.joint_angles)

    @property
    def energy(self) -> float:
        """Magnetic energy of the chain as it is [J]; no number where the simulation failed."""
        failed = self._session.status is FoldStatus.FAILED
        return math.nan if failed else self._session.energy()

    @property
    def acting(self) -> int:
        """Number of components whose magnets act, in the order of feed."""
        if self._drawn.feed.loading == "preloaded":
            return self._drawn.n
        out = int(self.progress.released.sum())
        return min(out + (self.out_of_next > 0.0), self._drawn.n)

    @property
    def scene_so_far(self) -> Scene:
        """The drawn scene, whose feed speeds say what factors were drawn."""
        return self._drawn

    def push(self, speed: float) -> None:
        """Feed at a speed [m/s] for one `INTERVAL`."""
        out = self._session.released
        self.asked.append(speed)
        self._session.push(speed * self._speed_factors, INTERVAL)
        for index in self.progress.order[out : self._session.released]:
            # A speed below the scale is at its lower end.
            self.progress.note_speed(index, max(speed, SLOWEST))
        self.progress.release(self._session.released)
        state = self._session.chain_state()
        if state.is_finite:
            self.state = state
        if self._session.status is None:
            self.force = self._session.push_force()
            limit = self._push_limit
            if limit is not None and self.force > limit:
                self._stuck = (
                    f"jammed at t = {self.time:.4g} s: the feed needs {self.force:.3g} N, "
                    f"{limit:.3g} N are its limit"
                )

    def copy(self) -> Self:
        """Return an episode in the same state that goes its own way from here."""
        twin = copy.copy(self)
        twin._session = self._session.copy()
        twin.progress = self.progress.copy()
        twin.asked = list(self.asked)
        return twin


def replay(scene: Scene, speeds: Sequence[float], push_limit: float | None) -> ControlEpisode:
    """Return the episode that `scene` and the speeds asked for [m/s] lead to, bit for bit."""
    episode = ControlEpisode(scene, push_limit)
    for speed in speeds:
        episode.push(speed)
    return episode
