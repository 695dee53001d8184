"""What must hold after every step of a fold: no overlap, no joint past its stop, no new energy."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

import numpy as np

from magfold_env.benchmarks.dynamics_laws.mechanics import kinetic_energy
from magfold_env.benchmarks.dynamics_laws.overlap import deepest_overlap
from magfold_env.benchmarks.dynamics_laws.stepping import SteppedSession
from magfold_env.scene import Scene


@dataclass
class Watch:
    """Worst values so far of one fold."""

    scene: Scene
    overlap: float = 0.0
    """Share of the side."""
    past_stop: float = 0.0
    """[rad]."""
    finite: bool = True
    totals: list[float] = field(default_factory=list[float])
    """Magnetic and kinetic energy after each step [J]."""
    fed: int = 0
    """How many of these belong to the feed, which may add energy."""

    def __call__(self, session: SteppedSession) -> None:
        """Look at the session's present state."""
        angles, base = session.angles, session.base
        joints = np.abs(np.diff(angles))
        if not (np.isfinite(angles).all() and np.isfinite(session.rates).all()):
            self.finite = False
            return
        self.past_stop = max(self.past_stop, float((joints - np.pi / 2.0).max(initial=0.0)))
        deep = deepest_overlap(self.scene, angles, base, session.released)
        self.overlap = max(self.overlap, deep / self.scene.casing.side)
        moving = kinetic_energy(self.scene, angles, session.rates, session.base_velocity)
        self.totals.append(session.potential() + moving)
        if session.released < session.n:
            self.fed = len(self.totals)

    @property
    def rise(self) -> float:
        """Largest rise of the total energy, after the feed, over its range in the whole run."""
        total = np.array(self.totals)
        alone = total[self.fed :]
        extent = float(np.ptp(total)) if total.size else 0.0
        if extent == 0.0 or alone.size == 0:
            return 0.0
        return float((alone - np.minimum.accumulate(alone)).max()) / extent


@dataclass(frozen=True)
class FoldLimits:
    """Worst values along one fold, and how it ended."""

    overlap: float
    """Share of the side."""
    past_stop: float
    """[rad]."""
    rise: float
    """Of the total energy without feed, over its range."""
    finite: bool
    status: str
    message: str
    steps: int
    seconds: float


def limits_of(scene: Scene) -> FoldLimits:
    """Simulate a scene in which nothing is left to draw, and look at every step."""
    watch = Watch(scene)
    session = SteppedSession(scene, watch)
    begun = time.perf_counter()
    watch(session)
    session.run()
    assert session.status is not None
    return FoldLimits(
        overlap=watch.overlap,
        past_stop=watch.past_stop,
        rise=watch.rise,
        finite=watch.finite,
        status=session.status.value,
        message=session.message,
        steps=session.steps,
        seconds=time.perf_counter() - begun,
    )
