"""How a scene ends, and whether two endings are the same."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from magfold_env.fold import FoldStatus
from magfold_env.scene import Scene
from magfold_env.simulation.simulate import simulate
from magfold_env.simulation.start import hinge_offsets

Floats = npt.NDArray[np.float64]

TIGHTER = 20  # a reference's tolerance is the scene's over this
SAME_WITHIN = 0.02  # [rad] of a joint angle
MOVED = 1e-6  # [rad] that a reference's start is moved by
PAIRS_OF_MOVES = 3


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
    """Yield the scene with its start moved a little, in opposite pairs.

    The first pairs move all joints, or in a tube all hinges, the last one a single one of them.
    """
    size = scene.n + 1 if scene.mount == "tube" else scene.n - 1
    for pair in range(PAIRS_OF_MOVES):
        move = rng.choice([-MOVED, MOVED], size)
        if pair == PAIRS_OF_MOVES - 1:
            move *= np.arange(size) == rng.integers(size)
        for moved in (move, -move):
            yield moved_start(scene, moved)


def moved_start(scene: Scene, move: Floats) -> Scene:
    """Return a concrete scene that starts otherwise.

    ``move`` is added to the joint angles [rad], (n − 1,). In a tube it is the hinges that move,
    (n + 1,), in units of a quarter diagonal: no joint turns by much more than the largest of them.
    """
    if scene.mount == "tube":
        moved = hinge_offsets(scene) + 0.25 * scene.casing.diagonal * move
        return scene.replace(start_offsets=np.clip(moved, -scene.play, scene.play))
    joints = np.array(scene.start_angles) + move
    return scene.replace(start_angles=np.clip(joints, -np.pi / 2, np.pi / 2))
