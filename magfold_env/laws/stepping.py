"""Look at a chain after every time step, or every few."""

from __future__ import annotations

from collections.abc import Callable
from typing import Self

import numpy.typing as npt

from magfold_env.engine.outcomes import CAPPED
from magfold_env.engine.state import FRESH, SECOND, SECOND_STEPS, STEPS, TIME, Model
from magfold_env.fold import FoldStatus
from magfold_env.scene import Scene
from magfold_env.simulation.session import Session


class SteppedSession(Session):
    """A session that stops after steps of the integrator, and goes on unchanged.

    Parameters
    ----------
    scene
        What to simulate; nothing may be left to draw.
    look
        Called with the session after each of these stops.
    stride
        Steps from one stop to the next.
    """

    def __init__(
        self, scene: Scene, look: Callable[[Self], None] = lambda _: None, stride: int = 1
    ) -> None:
        super().__init__(scene)
        self._look = look
        self._stride = stride
        # A second of simulated time that ends every few steps stops the run there. The model is
        # made once, since handing a new one to the kernels costs more than a step.
        self._whole: Model = self._model
        self._model: Model = self._model._replace(max_steps_per_second=stride)
        self._second, self._second_steps = 0.0, 0

    def throw(self, rates: npt.ArrayLike, base_velocity: npt.ArrayLike = (0.0, 0.0)) -> None:
        """Set the rates (n,) [rad/s] and the outer hinge's velocity (2,) [m/s]; not in a tube."""
        self._state.v[: self.n] = rates
        self._state.v[self.n :] = base_velocity
        self._state.counter[FRESH] = 1

    def turn(self, angle: float) -> None:
        """Turn the chain [rad] about the outer hinge of component 1; not in a tube."""
        self._state.q[: self.n] += angle
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
        counter, clock = self._state.counter, self._state.clock
        while True:
            # The engine's own rule, see `engine.work_cap`.
            if clock[TIME] >= self._second + 1.0:
                self._second, self._second_steps = float(clock[TIME]), int(counter[STEPS])
            if counter[STEPS] - self._second_steps >= self._whole.max_steps_per_second:
                self._model = self._whole
                self._end(*self._ending(CAPPED))
                return False
            clock[SECOND], counter[SECOND_STEPS] = clock[TIME], counter[STEPS]
            before = self.steps
            reached = super()._advance(until)
            self._look(self)
            stopped = self.steps >= before + self._stride and self.steps < self._whole.max_steps
            if reached or not stopped or self.status is not FoldStatus.UNSETTLED:
                return reached
            self.go_on()
