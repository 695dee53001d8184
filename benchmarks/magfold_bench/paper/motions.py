"""Motions of sequence 3 with its first component held, and their comparison.

The paper films such a fold and compares its simulation with the film. The film is not available, so
this module compares the paper's solver with this project's.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from magfold_bench.paper import states
from magfold_bench.paper.quoted import COMPUTATIONS, FRAME_RATE, MAGNET_CHARGE, SNAP
from magfold_bench.tables import Progress, Row, Tick, each_case, select
from magfold_env.fold import FoldStatus, kinetic_energy
from magfold_env.scene import Scene, load_scene
from magfold_env.shapes import BoolArray, FloatArray, angles_to_word, centres
from magfold_env.simulation.frames import magnetic_energy
from magfold_env.simulation.simulate import energy, simulate

SEQUENCE = 3
UNTIL = 0.4  # [s] compared
INPUTS = (
    "charge of a pole face (B_r), friction, assumed masses and sizes, and reconstructed sequence "
    f"{SEQUENCE}; the chain starts straight, without spread."
)
EXACT = 1e-8  # tolerance of this project's solver [rad]
HALF, WHOLE = "half charge", "whole charge"


@dataclass(frozen=True, eq=False)
class Motion:
    """The frames of a fold at the camera's rate; a chain that comes to rest stays at rest."""

    scene: Scene
    time: FloatArray
    """Times [s], shape (m,)."""
    angles: FloatArray
    """Headings [rad], shape (m, n)."""
    end: float
    """When the chain came to rest, or `UNTIL` [s]."""
    ended: str
    """Status at the end: a `FoldStatus`, or "still moving"."""
    gained: float
    """Largest excess of kinetic plus magnetic energy over its value at the start [J]."""
    freed: float
    """Decrease of the magnetic energy from start to end [J]."""

    @property
    def joints(self) -> FloatArray:
        """Relative angles [rad], shape (m, n-1)."""
        return np.diff(self.angles, axis=1)

    @property
    def word(self) -> str:
        """The word nearest to the final shape."""
        return angles_to_word(self.joints[-1])

    def snaps(self) -> dict[int, float]:
        """Return the times [s] at which joints, numbered from 1, first snapped, in this order."""
        there = np.abs(self.joints) >= SNAP
        first = {k + 1: float(self.time[there[:, k].argmax()]) for k in range(there.shape[1])}
        reached = {k: at for k, at in first.items() if there[:, k - 1].any()}
        return dict(sorted(reached.items(), key=lambda item: item[1]))


def charges() -> dict[str, float]:
    """Return the magnetic charges per pole face that are tried [A m], by name.

    Equation 7 gives each of a magnet's two pole faces half the charge that a 0.6 T magnet has on
    each face.
    """
    magnets = load_scene(f"paper/sequence-{SEQUENCE}-literal").magnets
    assert magnets is not None  # the scene is shipped
    return {HALF: magnets.charge, WHOLE: MAGNET_CHARGE}


def each_charge(progress: Progress) -> Iterator[tuple[tuple[str, float], Tick]]:
    """Yield the names and magnitudes of the charges, each with a `Tick`."""
    return each_case(progress, list(charges().items()), lambda case: case[0])


def by_charge(rows: list[Row]) -> dict[str, list[Row]]:
    """Return the rows of each charge by its name."""
    return {name: select(rows, charge=name) for name in charges()}


def literal(charge: float) -> Scene:
    """Return the paper's model: a straight chain with the paper's point charges and solver."""
    scene = states.scene_of(SEQUENCE, "literal")
    return scene.replace(
        magnets={"pole_charge": charge}, start_angles=(0.0,) * (scene.n - 1), duration=UNTIL
    )


def stepped(scene: Scene, computations: int) -> Scene:
    """Return a scene for the paper's solver with ``computations`` time steps per frame."""
    return scene.replace(solver={"time_step": 1.0 / (FRAME_RATE * computations)})


def exact(scene: Scene) -> Scene:
    """Return a scene for this project's solver, with hard contact and a small tolerance."""
    return scene.replace(solver={"method": "adaptive", "tolerance": EXACT})


def rectangles(scene: Scene) -> Scene:
    """Return a scene in which rectangles of the same charge replace the point magnets."""
    return scene.replace(magnets={"model": "strips", "nodes": None, "accuracy": 1e-6})


def follow(scene: Scene) -> Motion:
    """Simulate a scene and return its frames up to `UNTIL`."""
    fold = simulate(scene, frame_rate=FRAME_RATE)
    assert fold.trajectory is not None
    seen = fold.trajectory.finite()
    time = np.arange(round(UNTIL * FRAME_RATE) + 1) / FRAME_RATE
    last = fold.angles if np.isfinite(fold.angles).all() else seen.angles[-1]
    padding = np.tile(last, (max(time.size - len(seen), 0), 1))
    angles = np.concatenate([seen.angles, padding])[: time.size]
    moving = fold.status is FoldStatus.UNSETTLED
    ended = "still moving" if moving else fold.status.value
    magnetic = magnetic_energy(fold.scene, seen)
    total = kinetic_energy(fold.scene, seen) + magnetic
    return Motion(
        fold.scene,
        time,
        angles,
        end=min(fold.time, UNTIL),
        ended=ended,
        gained=float((total - total[0]).max()),
        freed=float(magnetic[0] - energy(fold.scene, last)),
    )


def squared_error(one: Motion, other: Motion) -> FloatArray:
    """Return the mean squared difference in the relative angles [rad²], shape (m,)."""
    return np.square(one.joints - other.joints).mean(axis=1)


def displacement(one: Motion, other: Motion) -> FloatArray:
    """Return the mean distance between the components' centres in two motions [m], shape (m,)."""
    side = one.scene.casing.side
    apart = centres(one.angles, side) - centres(other.angles, side)
    return np.hypot(apart[..., 0], apart[..., 1]).mean(axis=1)


def before_snap(*motions: Motion) -> BoolArray:
    """Return which frames precede the first snap of a joint in any of the motions, shape (m,)."""
    first = min(min(motion.snaps().values(), default=UNTIL) for motion in motions)
    return motions[0].time < first


def default_steps(charge: float) -> Scene:
    """Return the paper's model with the time step that the paper chose."""
    return stepped(literal(charge), COMPUTATIONS)
