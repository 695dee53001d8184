"""How a scene ends, whether two endings are the same, and scenes that cannot end well."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from magfold_env.fold import FoldStatus
from magfold_env.laws.overlap import deepest_overlap
from magfold_env.laws.random_scenes import designed_sequence
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


TOO_DEEP = 1e-3  # overlap, share of the side


class Ending(NamedTuple):
    """How a hopeless scene ended, and what is wrong with that, if anything."""

    outcome: Outcome | None
    wrong: str


def hopeless_scenes(max_steps: int) -> dict[str, Scene]:
    """Return scenes beyond all reason by name, each allowed so many steps."""
    n = 8
    rng = np.random.default_rng(0)
    plain = Scene(sequence=designed_sequence(rng, n)).draw(rng)
    plain = plain.replace(solver={"max_steps": max_steps})
    tube = plain.replace(mount="tube", start_angles=None).draw(rng)
    straight = np.zeros(n - 1)
    closed = np.full(n - 1, np.pi / 2.0)
    return {
        "tolerance out of reach": plain.replace(solver={"tolerance": 1e-12}),
        "tolerance out of reach, tube": tube.replace(solver={"tolerance": 1e-12}),
        "masses of 1 ng and 1 t": plain.replace(casing={"mass": (1e-12, 1e3) * (n // 2)}),
        "no mass to speak of": plain.replace(casing={"mass": 1e-300}),
        "masses beyond squaring": plain.replace(casing={"mass": 1e300}),
        "inertia without mass": plain.replace(casing={"inertia": 1e12}),
        "magnets of a thousand tesla": plain.replace(magnets={"remanence": 1e3}),
        "charges beyond squaring": plain.replace(magnets={"pole_charge": 1e200}),
        "squares in one another": plain.replace(start_angles=closed),
        "squares in one another, friction 10": plain.replace(start_angles=closed, friction=10.0),
        "feed at 1e6 m/s": tube.replace(feed={"speed": 1e6}),
        "feed at 1e-9 m/s": tube.replace(feed={"speed": 1e-9}),
        "gravity of a neutron star": plain.replace(gravity={"in_plane": (1e12, 0.0)}),
        "friction of 1e12": plain.replace(friction=1e12),
        "perfectly straight": plain.replace(start_angles=straight, friction=0.0),
    }


def ending(scene: Scene) -> Ending:
    """Simulate a hopeless scene and say what is wrong with how it ended."""
    try:
        outcome = Outcome.of(scene)
    except (ArithmeticError, ValueError) as error:
        return Ending(None, f"raised {type(error).__name__}: {error}")
    if not outcome.message:
        return Ending(outcome, "no message")
    if outcome.steps > scene.solver.max_steps:
        return Ending(outcome, "more steps than allowed")
    joints = np.array(outcome.joints)
    if not np.isfinite(joints).all():
        return Ending(outcome, "not a number")
    at_rest = outcome.status in {FoldStatus.FOLDED, FoldStatus.MISFOLDED}
    angles = np.concatenate([[0.0], np.cumsum(joints)])
    deep = deepest_overlap(scene.alone(), angles, np.zeros(2), scene.n)
    if at_rest and deep > TOO_DEEP * scene.casing.side:
        return Ending(outcome, "at rest with squares in one another")
    return Ending(outcome, "")
