"""Look at a chain after every time step."""

from __future__ import annotations

from collections.abc import Callable
from typing import Self

import numpy.typing as npt

from magfold_env.engine.session import Session
from magfold_env.engine.state import FRESH, STEPS
from magfold_env.fold import FoldStatus
from magfold_env.scene import Scene


class SteppedSession(Session):
    """A session that stops after every step of the integrator, and goes on unchanged.

    Parameters
    ----------
    scene
        What to simulate; nothing may be left to draw.
    look
        Called with the session after each step.
    """

    def __init__(self, scene: Scene, look: Callable[[Self], None] = lambda _: None) -> None:
        super().__init__(scene)
        self._look = look
        self._most_steps: int = self._model.max_steps

    def throw(self, rates: npt.ArrayLike, base_velocity: npt.ArrayLike = (0.0, 0.0)) -> None:
        """Set the rates (n,) [rad/s] and the outer hinge's velocity (2,) [m/s]; not in a tube."""
        self._state.v[: self.n] = rates
        self._state.v[self.n :] = base_velocity
        self._state.counter[FRESH] = 1

    def go_on(self) -> None:
        """Forget that the run has ended."""
        self._status = None
        self._message = ""

    def wait(self, duration: float) -> None:
        """Go on for a time [s], whatever happened before."""
        self.go_on()
        self._advance(self.time + duration)

    def run(self) -> None:
        """Feed and settle, as `simulate` does."""
        while self.status is None and self.released < self.n:
            self.feed_one()
        self.settle()

    def _advance(self, until: float) -> bool:
        while True:
            # The work cap ends every call after one step; the true cap still holds.
            allowed = min(int(self._state.counter[STEPS]) + 1, self._most_steps)
            self._model = self._model._replace(max_steps=allowed)
            before = self.steps
            reached = super()._advance(until)
            self._look(self)
            capped = self.status is FoldStatus.UNSETTLED and before < self._most_steps
            if reached or not capped:
                return reached
            self.go_on()
