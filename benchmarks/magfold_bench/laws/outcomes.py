"""Scenes with slightly moved starts or tighter settings, and comparisons of how runs end."""

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from magfold_env.fold import Fold
from magfold_env.scene import Scene
from magfold_env.simulation.pack import inner_offsets, reversed_inside

Floats = npt.NDArray[np.float64]

SAME_WITHIN = 0.02  # [rad] up to which joint angles count as the same
MOVED = 1e-6  # [rad] by which starts are moved
PAIRS_OF_MOVES = 3
TIGHTER = 20  # a reference divides the scene's tolerance by this
LEAST_TOLERANCE = 1e-12


def reference_of(scene: Scene, tighter: int = TIGHTER) -> Scene:
    """Return the scene with the tolerance divided, and step limits multiplied, by ``tighter``."""
    solver = scene.solver
    changes = {
        "tolerance": max(solver.tolerance / tighter, LEAST_TOLERANCE),
        "max_steps": solver.max_steps * tighter,
        "max_steps_per_second": solver.max_steps_per_second * tighter,
    }
    return scene.replace(solver=changes)


def difference(one: Fold, other: Fold) -> str:
    """Return what differs first, `word`, `status` or `angles`, or an empty string."""
    if one.word != other.word:
        return "word"
    if one.status != other.status:
        return "status"
    off = np.abs(one.joint_angles - other.joint_angles).max(initial=0.0)
    return "" if off <= SAME_WITHIN else "angles"  # NaN also counts as a difference


def moved_starts(
    scene: Scene, rng: np.random.Generator, by: float = MOVED, pairs: int = PAIRS_OF_MOVES
) -> Iterator[Scene]:
    """Yield scenes with slightly moved starts, in pairs of opposite moves ``by`` an angle [rad].

    The first pairs move all joints, or all hinges in a tube; the last pair moves only one of them.
    """
    size = scene.n + 1 if scene.mount == "tube" else scene.n - 1
    for pair in range(pairs):
        move = rng.choice([-by, by], size)
        if pair == pairs - 1:
            move *= np.arange(size) == rng.integers(size)
        for moved in (move, -move):
            yield moved_start(scene, moved)


def hinge_offsets(scene: Scene) -> Floats:
    """Return the initial offsets of hinges to the left of the tube's axis [m], (n + 1,).

    The scene must have a tube and be concrete. Component 1's outer hinge comes first.
    """
    offsets = inner_offsets(scene)
    return offsets[::-1] if reversed_inside(scene) else offsets


def moved_start(scene: Scene, move: Floats) -> Scene:
    """Return a concrete scene with a different start.

    ``move`` is added to the joint angles [rad], (n − 1,). In a tube, it moves the hinges, (n + 1,),
    in units of a quarter diagonal, so that no joint turns much more than the largest move.
    """
    if scene.mount == "tube":
        moved = hinge_offsets(scene) + 0.25 * scene.casing.diagonal * move
        return scene.replace(start_offsets=np.clip(moved, -scene.play, scene.play))
    joints = np.array(scene.start_angles) + move
    return scene.replace(start_angles=np.clip(joints, -np.pi / 2, np.pi / 2))
