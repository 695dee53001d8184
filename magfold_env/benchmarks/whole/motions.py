"""How far apart two runs of one scene are: on their way, compared at common times, and at the end.

The reference is the same scene at a tight tolerance with accurate magnets. How well it is converged
is told by a second run with both `LOOSER`; how much the scene itself amplifies, by a third whose
start is moved by `NUDGE`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from magfold_env.benchmarks.dynamics.contact_scenes import CLOSE, FRAME_RATE, NUDGE, nudged
from magfold_env.benchmarks.dynamics.features import finish
from magfold_env.benchmarks.whole.settings import Setting, has_accuracy
from magfold_env.engine.state import Array
from magfold_env.fold import Fold
from magfold_env.scene import Scene
from magfold_env.simulation.session import Session

LOOSER = 10.0


@dataclass(frozen=True, eq=False)
class Reference:
    """What a drawn scene does, and how well that is known."""

    scene: Scene
    fold: Fold
    known: float
    """What ten times looser settings change on the way [rad]."""
    sensitivity: float
    """What a start moved by `NUDGE` changes on the way [rad]."""

    @property
    def sensitive(self) -> bool:
        """Whether the scene, rather than a setting, decides what comes out."""
        return self.sensitivity > CLOSE

    @property
    def unsure(self) -> bool:
        """Whether it is not known well enough to judge by."""
        return self.known > CLOSE

    def error_on_the_way(self, run: Fold) -> float:
        """Largest difference of a joint's angle at any time [rad], as far as it is known."""
        return max(difference(run, self.fold), self.known, NUDGE)

    def final_error(self, run: Fold) -> float:
        """Largest difference of a joint's angle at the end [rad]."""
        off = np.abs(run.joint_angles - self.fold.joint_angles).max(initial=0.0)
        return max(float(off), NUDGE)


def reference(scene: Scene, tolerance: float, accuracy: float) -> Reference:
    """Run a drawn scene as exactly as asked for, and twice more to see how much that is worth."""
    tight = _setting(scene, tolerance, accuracy)
    looser = _setting(scene, LOOSER * tolerance, LOOSER * accuracy)
    exact, second = recorded(tight.on(scene)), recorded(looser.on(scene))
    moved = recorded(looser.on(nudged(scene)))
    return Reference(scene, exact, difference(second, exact), difference(moved, second))


def recorded(scene: Scene) -> Fold:
    """Run a drawn scene and record how it moves."""
    session = Session(scene, FRAME_RATE)
    finish(session)
    return session.fold()


def difference(one: Fold, other: Fold) -> float:
    """Largest difference of a joint's angle at any time [rad]; a chain at rest stays so."""
    last = max(one.time, other.time)
    times = np.append(np.arange(0.0, last, 1.0 / FRAME_RATE), last)
    return float(np.abs(_joints(one, times) - _joints(other, times)).max(initial=0.0))


def _joints(fold: Fold, times: Array) -> Array:
    """Joint angles at some times, (n - 1, times) [rad]; straight between frames, then at rest.

    The paper's solver has its frames at the ends of its own steps.
    """
    assert fold.trajectory is not None
    known: Array = np.append(fold.trajectory.time, fold.time)
    angles = np.diff(np.concatenate([fold.trajectory.angles, fold.angles[None]]), axis=1)
    joints: list[Array] = [np.interp(times, known, joint) for joint in angles.T]
    return np.array(joints).reshape(-1, times.size)


def _setting(scene: Scene, tolerance: float, accuracy: float) -> Setting:
    return Setting("adaptive", tolerance, accuracy if has_accuracy(scene) else None)
