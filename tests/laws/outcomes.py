"""How a scene ends, and whether two endings are the same."""

from __future__ import annotations

import time
from typing import NamedTuple

import numpy as np

from magfold_bench.laws.outcomes import SAME_WITHIN
from magfold_env.fold import FoldStatus
from magfold_env.scene import Scene
from magfold_env.simulation.simulate import simulate

TIGHTER = 20  # a reference's tolerance is the scene's over this
LEAST_TOLERANCE = 1e-12


class Outcome(NamedTuple):
    """The end of one simulation."""

    status: str
    message: str
    word: str
    joints: tuple[float, ...]  # joint angles [rad]
    time: float  # simulated [s]
    steps: int
    evaluations: int
    seconds: float  # of computing

    @classmethod
    def of(cls, scene: Scene) -> Outcome:
        """Simulate a scene in which nothing is left to draw."""
        begun = time.perf_counter()
        fold = simulate(scene)
        return cls(
            status=fold.status.value,
            message=fold.message,
            word=fold.word,
            joints=tuple(fold.joint_angles.tolist()),
            time=fold.time,
            steps=fold.steps,
            evaluations=fold.evaluations,
            seconds=time.perf_counter() - begun,
        )

    @property
    def failed(self) -> bool:
        """Whether the simulation broke down."""
        return self.status == FoldStatus.FAILED

    def angle_from(self, other: Outcome) -> float:
        """Return the largest difference of a joint angle [rad]."""
        return float(np.abs(np.subtract(self.joints, other.joints)).max(initial=0.0))

    def difference(self, other: Outcome) -> str:
        """Return `word`, `status` or `angles` for the first thing that differs, else nothing."""
        if self.word != other.word:
            return "word"
        if self.status != other.status:
            return "status"
        # Not "<=": an angle that is no number differs.
        return "" if self.angle_from(other) <= SAME_WITHIN else "angles"


def reference_of(scene: Scene, tighter: int = TIGHTER) -> Scene:
    """Return the scene with tighter settings, and as much more work allowed."""
    solver = scene.solver
    changes = {
        "tolerance": max(solver.tolerance / tighter, LEAST_TOLERANCE),
        "max_steps": solver.max_steps * tighter,
        "max_steps_per_second": solver.max_steps_per_second * tighter,
    }
    return scene.replace(solver=changes)
