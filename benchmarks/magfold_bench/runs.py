"""Functions that configure, finish, record, compare and time whole runs of scenes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal, NamedTuple

import numpy as np

from magfold_bench import timing
from magfold_env.engine.state import Array
from magfold_env.fold import Fold
from magfold_env.scene import Magnets, Scene, Solver
from magfold_env.simulation.session import Session

STEPS_ALLOWED = 10_000_000  # the work limit must not end an accurate run early
FRAME_RATE = 2000.0  # [1/s] at which motions are compared
NUDGE = 1e-6  # [rad]
CLOSE = 0.02  # [rad] allowed error of an angle
FRICTION = 0.35
SPEED = 0.1  # [m/s] of the tube's feed

KINDS: dict[str, dict[str, Any]] = {
    "free, no friction": {"mount": "free", "friction": 0.0},
    f"free, friction {FRICTION}": {"mount": "free", "friction": FRICTION},
    f"tube, {SPEED} m/s": {"mount": "tube", "friction": FRICTION, "feed": {"speed": SPEED}},
}
"""Changes that turn a scene into one of each kind."""

Method = Literal["adaptive", "paper"]


class Setting(NamedTuple):
    """One way to run a scene."""

    method: Method
    step: float  # tolerance [rad], or the paper's time step [s]
    accuracy: float | None = None
    """Accuracy of the magnets; None if the scene has no such option or keeps its own value."""

    def __str__(self) -> str:
        step = f"{self.step:g} rad"
        if self.method == "paper":
            step = f"paper's, {1e3 * self.step:.3g} ms"
        return step if self.accuracy is None else f"{step}, magnets {self.accuracy:g}"

    @property
    def is_default(self) -> bool:
        """Whether this is the default setting of scenes."""
        default = self.accuracy in (None, Magnets().accuracy)
        return default and (self.method, self.step) == (Solver().method, Solver().tolerance)

    def as_tight(self, other: Setting) -> bool:
        """Return whether this setting has the other's method and is no looser in any value."""
        finer = (self.accuracy or 0.0) <= (other.accuracy or 0.0)
        return self.method == other.method and self.step <= other.step and finer

    def on(self, scene: Scene) -> Scene:
        """Return a scene with this setting and a sufficient work limit."""
        solver: dict[str, object] = {
            "method": self.method,
            "max_steps": STEPS_ALLOWED,
            "max_steps_per_second": STEPS_ALLOWED,
            "tolerance" if self.method == "adaptive" else "time_step": self.step,
        }
        changed = scene.replace(solver=solver)
        if self.accuracy is None:
            return changed
        return changed.replace(magnets={"accuracy": self.accuracy})


def has_accuracy(scene: Scene) -> bool:
    """Return whether magnets have an accuracy; point magnets have fixed nodes instead."""
    return scene.magnets is not None and scene.magnets.model == "strips"


def finish(session: Session) -> None:
    """Feed and settle a session's chain to the end."""
    while session.status is None and session.released < session.n:
        session.feed_one()
    session.settle()


def ended(scene: Scene, frame_rate: float | None = None) -> Session:
    """Run a drawn scene and return its session at the end."""
    session = Session(scene, frame_rate)
    finish(session)
    return session


def recorded(scene: Scene) -> Fold:
    """Run a drawn scene and record its motion."""
    return ended(scene, FRAME_RATE).fold()


def run_task(*scenes: Scene, frame_rate: float | None = None) -> timing.Task:
    """Return a task to time, which runs drawn scenes in turn; their preparation is not timed."""

    def prepare() -> Callable[[], None]:
        sessions = [Session(scene, frame_rate) for scene in scenes]

        def call() -> None:
            for session in sessions:
                finish(session)

        return call

    return prepare


def difference(one: Fold, other: Fold) -> float:
    """Return the largest difference of a joint angle at any time [rad]; ended runs are at rest."""
    last = max(one.time, other.time)
    times = np.append(np.arange(0.0, last, 1.0 / FRAME_RATE), last)
    return float(np.abs(_joints(one, times) - _joints(other, times)).max(initial=0.0))


def _joints(fold: Fold, times: Array) -> Array:
    """Return joint angles at some times, (n - 1, times) [rad], interpolated between frames.

    The angles are constant after the last frame. The paper's solver has frames at its steps' ends.
    """
    motion = fold.trajectory
    assert motion is not None
    angles = np.diff(motion.angles, axis=1)
    joints: list[Array] = [np.interp(times, motion.time, joint) for joint in angles.T]
    return np.array(joints).reshape(-1, times.size)


def final_difference(one: Fold, other: Fold) -> float:
    """Return the largest difference in a joint's angle at the end [rad]."""
    return float(np.abs(one.joint_angles - other.joint_angles).max(initial=0.0))
