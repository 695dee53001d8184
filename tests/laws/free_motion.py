"""Chains left alone: momenta that stay, films that run backwards, and rest to the last bit."""

import math
from typing import Literal

import numpy as np

from magfold_bench.laws.along_folds import SteppedSession
from magfold_bench.laws.mechanics import Floats, kinetic_energy, momenta
from magfold_bench.laws.random_scenes import LARGEST, SMALLEST, random_scene, random_sequence
from magfold_env.engine import entries as at
from magfold_env.fold import FoldStatus
from magfold_env.scene import Scene
from magfold_env.simulation.simulate import simulate

Kind = Literal["thrown", "pendulum", "magnetic"]

RATES, DRIFT = 30.0, 0.3  # largest of a thrown chain [rad/s, m/s]
THROWN_FOR = 0.3  # [s]
SWINGS = 6.0  # duration of a pendulum over √(length of a component / g)
NEARLY_SHUT = 1.4  # [rad] a magnetic chain is followed until a joint is there


class FreeSession(SteppedSession):
    """A session whose chain can be left to itself for longer than it needs."""

    def go_on(self) -> None:
        """Forget that the run has ended, and give it its time to settle again."""
        self.status, self.message = None, ""
        self._state.clock[at.END] = self.time + self.scene.duration

    def wait(self, duration: float) -> None:
        """Go on for a time [s], whatever happened before."""
        self.go_on()
        self._state.clock[at.END] = math.inf
        self._go_on(keep=-1, until=self.time + duration)


def thrown(seed: int, tolerance: float, *, contact: bool) -> FreeSession:
    """Return a free chain without magnets and friction that begins with random rates."""
    rng = np.random.default_rng([seed, 1])
    n = int(rng.integers(SMALLEST, LARGEST + 1))
    scene = Scene(
        sequence=("NNNN",) * n,
        magnets=None,
        friction=0.0,
        contact=contact,
        duration=THROWN_FOR,
        start_angle_spread=0.5,
    )
    scene = scene.replace(solver={"tolerance": tolerance}).draw(rng)
    session = FreeSession(scene)
    session.throw(rng.uniform(-RATES, RATES, n), rng.uniform(-DRIFT, DRIFT, 2))
    return session


def momentum_errors(seed: int, tolerance: float, *, contact: bool) -> tuple[float, float]:
    """Return the changes of a thrown chain's linear and angular momentum.

    Relative to its mass times √(2 · energy / mass), and that times its length.
    """
    session = thrown(seed, tolerance, contact=contact)
    scene = session.scene
    energy = float(kinetic_energy(scene, session.angles, session.rates, session.base_velocity))
    size = float(np.sqrt(2.0 * energy * scene.masses.sum()))
    before = _momenta(session)
    session.run()
    after = _momenta(session)
    length = scene.n * scene.casing.diagonal
    linear = float(np.hypot(*(after[0] - before[0]))) / size
    return linear, float(abs(after[1] - before[1])) / (size * length)


def _momenta(session: FreeSession) -> tuple[Floats, Floats]:
    s = session
    return momenta(s.scene, s.angles, s.rates, s.base, s.base_velocity)


def reversal_error(kind: Kind, seed: int, tolerance: float) -> float:
    """Return how far a chain whose motion is turned round ends from its start [rad].

    Positions count in lengths of a component. Nothing is in contact and nothing rubs.
    """
    if kind == "thrown":
        session = thrown(seed, tolerance, contact=False)
    else:
        session = FreeSession(_smooth(kind, seed, tolerance))
    angles, base = session.angles, session.base
    for _ in range(2):
        session.go_on()
        session.settle()
        session.throw(-session.rates, -session.base_velocity)
    turned = np.abs(session.angles - angles).max()
    moved = np.hypot(*(session.base - base)) / session.scene.casing.diagonal
    return float(max(turned, moved))


def _smooth(kind: Kind, seed: int, tolerance: float) -> Scene:
    """Return a chain that swings, or one that magnets bend, for as long as that is smooth."""
    rng = np.random.default_rng([seed, 2])
    n = int(rng.integers(SMALLEST, LARGEST + 1))
    scene = Scene(sequence=random_sequence(rng, n), friction=0.0).draw(rng)
    scene = scene.replace(solver={"tolerance": tolerance}, contact=False)
    if kind == "magnetic":
        duration = _first_shut(scene)
        return scene.replace(duration=duration)
    return scene.replace(
        mount="pinned",
        magnets=None,
        gravity={"in_plane": (0.0, -9.8)},
        duration=SWINGS * float(np.sqrt(scene.casing.diagonal / 9.8)),
    )


def _first_shut(scene: Scene) -> float:
    """Return when a joint comes near its stop for the first time [s]."""
    fold = simulate(scene.replace(duration=0.1), frame_rate=2000.0)
    assert fold.trajectory is not None
    joints = np.abs(np.diff(fold.trajectory.angles, axis=1)).max(axis=1)
    shut = np.flatnonzero(joints > NEARLY_SHUT)
    return float(fold.trajectory.time[shut[0] if shut.size else -1])


WAIT = 1000.0  # [s]
LEAST_FRICTION = 0.2


def creep(seed: int) -> float | None:
    """Return how far a fold that came to rest moves in a thousand seconds [rad].

    Positions count in lengths of a component. None if the scene never comes to rest.
    """
    scene = random_scene(seed)
    scene = scene.replace(friction=np.maximum(scene.frictions, LEAST_FRICTION))
    session = FreeSession(scene)
    session.run()
    if session.status not in {FoldStatus.FOLDED, FoldStatus.MISFOLDED}:
        return None
    angles, base = session.angles, session.base
    session.wait(WAIT)
    moved = float(np.abs(session.base - base).max()) / scene.casing.diagonal
    return max(float(np.abs(session.angles - angles).max()), moved)
