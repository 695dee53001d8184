"""How a scene ends, and whether two endings are the same."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from magfold_env.fold import FoldStatus
from magfold_env.scene import Scene
from magfold_env.simulation.simulate import simulate

TIGHTER = 20  # a reference's tolerance is the scene's over this
SAME_WITHIN = 0.02  # [rad] of a joint angle
MOVED = 1e-6  # [rad] that a reference's start is moved by
PAIRS_OF_MOVES = 3


@dataclass(frozen=True)
class Outcome:
    """The end of one simulation."""

    status: str
    message: str
    word: str
    joints: tuple[float, ...]
    """Joint angles [rad]."""
    time: float
    """Simulated [s]."""
    steps: int
    evaluations: int
    seconds: float
    """Of computing."""

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

    def to_dict(self) -> dict[str, Any]:
        """Return the fields as plain values."""
        return asdict(self)


def reference_of(scene: Scene) -> Scene:
    """Return the scene with tighter settings, and as much more work allowed."""
    solver = scene.solver
    tighter = {
        "tolerance": solver.tolerance / TIGHTER,
        "max_steps": solver.max_steps * TIGHTER,
        "max_steps_per_second": solver.max_steps_per_second * TIGHTER,
    }
    return scene.replace(solver=tighter)


def moved_starts(scene: Scene, rng: np.random.Generator) -> Iterator[Scene]:
    """Yield the scene with its start angles moved a little, in opposite pairs.

    The first pairs move all joints, the last one a single joint.
    """
    assert scene.start_angles is not None
    start = np.array(scene.start_angles)
    for pair in range(PAIRS_OF_MOVES):
        move = rng.choice([-MOVED, MOVED], start.size)
        if pair == PAIRS_OF_MOVES - 1:
            move *= np.arange(start.size) == rng.integers(start.size)
        for moved in (start + move, start - move):
            yield scene.replace(start_angles=np.clip(moved, -np.pi / 2, np.pi / 2))
