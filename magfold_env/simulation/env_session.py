"""A simulated chain as environments need it: its state is read, copied and restored."""

import copy
from typing import Any, Self, cast

import numpy as np
from numpy.typing import NDArray

from magfold_env.fold import Trajectory
from magfold_env.simulation.chain_state import ChainState
from magfold_env.simulation.frames import Frames
from magfold_env.simulation.session import Session


class EnvSession(Session):
    """A session that can be copied in the middle of its run; copies record no frames."""

    @property
    def held(self) -> NDArray[np.bool_]:
        """Which components friction holds, shape (n,)."""
        stuck = self._state.stuck == 1
        return np.array([stuck[self._view.index(k)] for k in range(self.n)])

    @property
    def motion(self) -> Trajectory | None:
        """The frames so far; None if none are recorded."""
        return self._frames.trajectory(self._view)

    def chain_state(self) -> ChainState:
        """Return a copy of the chain's state."""
        return ChainState(*self._seen())

    def copy(self) -> Self:
        """Return a session in exactly the same state that shares only what never changes."""
        twin = copy.copy(self)
        twin._model = self._model._replace(charge=self._model.charge.copy())
        twin._state = copied(self._state)
        # Scratch space too: accelerations and rigid pairs are carried over between steps.
        twin._work = copied(self._work)
        twin._frames = Frames(twin._model, twin._state, None)
        twin._faces = list(self._faces)
        twin._speeds = self._speeds.copy()
        twin._waiting = None if self._waiting is None else self._waiting.copy()
        return twin


def copied(value: Any) -> Any:
    """Return NamedTuples of arrays, at any depth, with arrays of their own."""
    if isinstance(value, np.ndarray):
        return cast("Any", value.copy())
    if isinstance(value, tuple):
        parts = cast("tuple[Any, ...]", value)
        return cast("Any", type(parts))(*map(copied, parts))
    return value
