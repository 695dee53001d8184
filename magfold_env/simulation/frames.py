"""The frames of one run: taken by the kernels, moved out of their room when it is full."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from magfold_env.engine.state import FRAMES, Array, Model, Record, State
from magfold_env.engine.stepping import recorder
from magfold_env.engine.stepping.step_limits import LONGEST_STEP
from magfold_env.engine.workspace import new_record
from magfold_env.fold import Trajectory
from magfold_env.simulation.orientation import Orientation

ROOM = 4096  # frames kept before they are moved out of the kernels' record


class Frames:
    """What was recorded of a chain so far.

    Parameters
    ----------
    model, state
        The chain.
    frame_rate
        Frames recorded a simulated second [1/s]; None records nothing.
    """

    def __init__(self, model: Model, state: State, frame_rate: float | None) -> None:
        interval = 0.0 if frame_rate is None else 1.0 / frame_rate
        capacity = ROOM + int(LONGEST_STEP / interval) if interval else 0
        self._model, self._state = model, state
        self._parts: list[tuple[Array, Array, Array, npt.NDArray[np.int64]]] = []
        self.record: Record = new_record(model, interval, capacity)
        """Where the kernels put frames."""

    def empty(self) -> None:
        """Make room in the record."""
        count, record = int(self._state.counter[FRAMES]), self.record
        self._parts.append(
            (
                record.time[:count].copy(),
                record.q[:count].copy(),
                record.v[:count].copy(),
                record.lo[:count].copy(),
            )
        )
        self._state.counter[FRAMES] = 0

    def take_straight(self, until: float) -> None:
        """Take the frames up to a time [s] of a chain that is all in the tube."""
        while not recorder.record_rest(self.record, self._model, self._state, until):
            self.empty()

    def trajectory(self, view: Orientation) -> Trajectory | None:
        """Return all frames as they are seen from outside; None if nothing is recorded."""
        if self.record.interval == 0.0:
            return None
        self.empty()
        time, q, v, lo = (np.concatenate(part) for part in zip(*self._parts, strict=True))
        n = self._model.n
        return Trajectory(
            time=time,
            angles=view.headings(q[:, :n]),
            base=view.outer_hinge(q, lo),
            rates=view.rates(v[:, :n]),
            released=n - lo,
        )
