"""A fold's states after every step, and its energies in these states."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from magfold_bench.laws import mechanics
from magfold_env.engine import indices as ix
from magfold_env.engine.outcomes import CAPPED
from magfold_env.engine.state import Model
from magfold_env.scene import Scene
from magfold_env.simulation.session import Session

Floats = npt.NDArray[np.float64]


class SteppedSession(Session):
    """A session of a concrete scene that stops every ``stride`` steps and continues unchanged.

    ``look`` is called with the session at each stop.
    """

    def __init__(
        self, scene: Scene, look: Callable[[Self], None] = lambda _: None, stride: int = 1
    ) -> None:
        super().__init__(scene)
        self._look = look
        self._stride = stride
        # The run stops every few steps because it reaches a limit on steps per simulated second.
        self._whole: Model = self._model
        self._chains.remodel(self._whole._replace(max_steps_per_second=stride))
        self._second, self._second_steps = 0.0, 0

    def turn(self, angle: float) -> None:
        """Turn the chain by an angle [rad] about component 1's outer hinge; not in a tube."""
        self._state.q[: self.n] += angle
        self._state.counter[ix.FRESH] = 1

    def throw(self, rates: npt.ArrayLike, base_velocity: npt.ArrayLike = (0.0, 0.0)) -> None:
        """Set angular rates (n,) [rad/s] and the base's velocity (2,) [m/s]; not in a tube."""
        self._state.v[: self.n] = rates
        self._state.v[self.n :] = base_velocity
        self._state.counter[ix.FRESH] = 1

    def _run(self, until: float) -> int:
        counter, clock = self._state.counter, self._state.clock
        while True:
            # This is the engine's own rule for the limit; see `engine.outcomes`.
            if clock[ix.TIME] >= self._second + 1.0:
                self._second, self._second_steps = float(clock[ix.TIME]), int(counter[ix.STEPS])
            if counter[ix.STEPS] - self._second_steps >= self._whole.max_steps_per_second:
                self._chains.remodel(self._whole)
                return CAPPED
            clock[ix.SECOND], counter[ix.SECOND_STEPS] = clock[ix.TIME], counter[ix.STEPS]
            before = self.steps
            outcome = super()._run(until)
            self._look(self)
            stopped = self.steps >= before + self._stride and self.steps < self._whole.max_steps
            if outcome != CAPPED or not stopped:
                return outcome


@dataclass(frozen=True)
class Motion:
    """The m states of a fold that precede the first state that is not finite."""

    scene: Scene
    time: Floats
    """Times [s], shape (m,)."""
    angles: Floats
    """Headings [rad], shape (m, n)."""
    rates: Floats
    """Rates of the headings [rad/s], shape (m, n)."""
    base: Floats
    """Outer hinge of component 1 [m], shape (m, 2)."""
    base_velocity: Floats
    """Velocity of that hinge [m/s], shape (m, 2)."""
    potential: Floats
    """Magnetic energy [J], shape (m,)."""
    work: Floats
    """Work so far by the drive, bumps and magnets that appear at the mouth [J], shape (m,)."""
    impacts: Floats
    """Energy lost in impacts so far [J], shape (m,)."""
    released: npt.NDArray[np.int64]
    """Number of components outside the tube, shape (m,)."""
    finite: bool
    """Whether all numbers are finite."""

    @cached_property
    def kinetic(self) -> Floats:
        """Kinetic energy [J], shape (m,)."""
        return mechanics.kinetic_energy(self.scene, self.angles, self.rates, self.base_velocity)

    @cached_property
    def total(self) -> Floats:
        """Sum of the magnetic, kinetic and in-plane gravitational energy [J], shape (m,)."""
        weight = mechanics.weight_energy(self.scene, self.angles, self.base)
        return self.potential + self.kinetic + weight

    @cached_property
    def own(self) -> Floats:
        """Total energy minus work [J], shape (m,); only friction and impacts change it."""
        return self.total - self.work

    @cached_property
    def rise(self) -> float:
        """Largest rise of `own`, relative to its range in the whole run."""
        extent = float(np.ptp(self.own)) if len(self.time) else 0.0
        if extent == 0.0:
            return 0.0
        return float((self.own - np.minimum.accumulate(self.own)).max()) / extent


def follow(scene: Scene, stride: int = 1) -> tuple[Motion, SteppedSession]:
    """Simulate a concrete scene and store a state every ``stride`` steps.

    Return the motion, including its start and end, and the session at the end.
    """
    rows: list[tuple[npt.NDArray[Any], ...]] = []

    def look(session: SteppedSession) -> None:
        account = session.account
        work = account.feed + account.bumps + account.loading
        place = (session.angles, session.rates, session.base, session.base_velocity)
        sums = (session.potential(), work, account.impacts, session.released)
        rows.append(tuple(np.array(each) for each in (session.time, *place, *sums)))

    session = SteppedSession(scene, look, stride)
    look(session)
    session.settle()
    look(session)
    columns = [np.stack(column) for column in zip(*rows, strict=True)]
    sound = np.logical_and.reduce(
        [np.isfinite(column.reshape(len(rows), -1)).all(axis=1) for column in columns]
    )
    count = len(rows) if sound.all() else int(sound.argmin())
    states = (column[:count] for column in columns)
    return Motion(scene, *states, finite=bool(sound.all())), session
