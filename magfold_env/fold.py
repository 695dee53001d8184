"""Fold: what a simulation ends with; Trajectory: how it got there, and what moved on the way."""

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any, Self

import numpy as np
import numpy.typing as npt
from pydantic_core import from_json, to_json

from magfold_env.files import write_text
from magfold_env.replay import Recording, write_html
from magfold_env.scene import Scene
from magfold_env.shapes import BoolArray, FloatArray, IntArray, centres


class FoldStatus(StrEnum):
    """How a simulation ended."""

    FOLDED = "folded"
    """At rest, every joint within 0.05 rad of ±90°."""
    MISFOLDED = "misfolded"
    """At rest otherwise."""
    HELD = "held"
    """At rest while a feed that has come to its end keeps components in the tube."""
    JAMMED = "jammed"
    """The drive slipped for 0.1 s: the chain took more than it can push or pull with."""
    UNSETTLED = "unsettled"
    """Out of time or of steps while still moving."""
    FAILED = "failed"
    """Numbers broke down; the fold's message says where."""


@dataclass(frozen=True, eq=False)
class Trajectory:
    """A recorded fold: m frames of n components, component 1 first."""

    time: FloatArray
    """[s], shape (m,)."""
    angles: FloatArray
    """Absolute headings [rad], shape (m, n)."""
    base: FloatArray
    """Component 1's outer hinge [m], shape (m, 2)."""
    rates: FloatArray
    """Rates of the headings [rad/s], shape (m, n)."""
    released: IntArray
    """Number of components out of the tube, n where there is none, shape (m,)."""

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.time)

    def finite(self) -> Self:
        """Return the frames before numbers broke down: all of them, if none did.

        Raises
        ------
        ValueError
            If there is none.
        """
        arrays = (self.time[:, None], self.angles, self.base, self.rates)
        sound = np.logical_and.reduce([np.isfinite(array).all(axis=1) for array in arrays])
        count = len(self) if sound.all() else int(sound.argmin())
        if count == 0:
            raise ValueError("folds: a trajectory without a finite frame is not allowed")
        return type(self)(**{name: value[:count] for name, value in vars(self).items()})


@dataclass(frozen=True, eq=False)
class Fold:
    """The result of one simulation."""

    scene: Scene
    """The scene as drawn: simulating it again gives this fold, whatever the seed."""
    status: FoldStatus
    """How it ended."""
    message: str
    """The status in words; for a failure, where it happened."""
    word: str
    """The nearest fold word, component 1 to n; empty where numbers broke down."""
    angles: FloatArray
    """Absolute headings at the end [rad], shape (n,)."""
    base: FloatArray
    """Component 1's outer hinge at the end [m], shape (2,)."""
    energy: float
    """Magnetic energy at the end [J], each pair of components once."""
    time: float
    """Simulated time [s]."""
    steps: int
    """Time steps taken."""
    evaluations: int
    """Evaluations of the accelerations."""
    trajectory: Trajectory | None = None
    """The recorded motion, if it was asked for."""
    magnetic_energy: Callable[[Scene, Trajectory], FloatArray] | None = field(
        default=None, repr=False
    )
    """What finds the magnetic energies of frames [J], shape (m,), when they are asked for.

    Simulations set it: to find them costs several times as much as the fold.
    """

    @property
    def joint_angles(self) -> FloatArray:
        """Relative angles at the end [rad], shape (n-1,)."""
        return np.diff(self.angles)

    def centres(self) -> FloatArray:
        """Return the casings' centres at the end [m], shape (n, 2)."""
        return centres(self.angles, side=self.scene.casing.side, base=self.base)

    def to_dict(self) -> dict[str, Any]:
        """Return the fold as plain values that JSON can hold; numbers that broke down are None."""
        data: dict[str, Any] = {
            "status": self.status.value,
            "message": self.message,
            "word": self.word,
            "angles": self.angles,
            "joint_angles": self.joint_angles,
            "base": self.base,
            "centres": self.centres(),
            "energy": self.energy,
            "time": self.time,
            "steps": self.steps,
            "evaluations": self.evaluations,
            "scene": self.scene.model_dump(mode="json"),
        }
        if self.trajectory is not None:
            data["trajectory"] = dict(vars(self.trajectory))
        return from_json(to_json(data, inf_nan_mode="null", fallback=np.ndarray.tolist))

    def to_json(self, path: str | Path) -> None:
        """Write `to_dict` to a file, under a temporary name first."""
        write_text(path, json.dumps(self.to_dict(), indent=2, allow_nan=False) + "\n")

    def to_html(self, path: str | Path) -> None:
        """Write a page that plays the fold: see `magfold_env.replay.write_html`.

        Raises
        ------
        ValueError
            If the fold was not recorded, or broke down at once.
        """
        write_html(recording(self), path)


def recording(fold: Fold) -> Recording:
    """Return what a page needs to play a fold, with its energies along the way.

    Raises
    ------
    ValueError
        If the fold was not recorded, or broke down at once.
    """
    if fold.trajectory is None:
        raise ValueError(
            "fold: a fold without trajectory is not allowed; simulate it with a frame_rate"
        )
    scene, motion = fold.scene, (fold.trajectory if len(fold.trajectory) else _still(fold)).finite()
    find = fold.magnetic_energy if scene.magnets is not None else None
    return Recording(
        scene=scene,
        word=fold.word,
        status=fold.status.value,
        message=fold.message,
        energy=fold.energy,
        duration=fold.time,
        time=motion.time,
        angles=motion.angles,
        base=motion.base,
        released=motion.released,
        order=turns(scene),
        loaded=loaded(scene, motion.angles, motion.base, motion.released).sum(axis=1),
        kinetic=kinetic_energy(scene, motion),
        magnetic=None if find is None else find(scene, motion),
    )


def _still(fold: Fold) -> Trajectory:
    """Return the one frame of a chain that ended where it started."""
    return Trajectory(
        time=np.array([fold.time]),
        angles=fold.angles[None],
        base=fold.base[None],
        rates=np.zeros_like(fold.angles)[None],
        released=np.array([fold.scene.n]),
    )


def loaded(
    scene: Scene, angles: FloatArray, base: FloatArray, released: npt.ArrayLike
) -> BoolArray:
    """Return which components have their magnets in m states, component 1 first, shape (m, n).

    All, unless the scene loads them at the mouth: then those whose leading hinge would be outside
    if all between it and what the tube holds were in line.

    Parameters
    ----------
    scene
        Whose states they are.
    angles, base
        Headings [rad], (m, n), and outer hinges of component 1 [m], (m, 2).
    released
        Numbers of components out of the tube, (m,).
    """
    n, diagonal = scene.n, scene.casing.diagonal
    if scene.mount != "tube" or scene.feed.loading == "preloaded":
        return np.ones((len(angles), n), dtype=np.bool_)
    out = np.asarray(released)
    along = np.cumsum(diagonal * np.cos(angles), axis=1)
    hinges = base[:, :1] + np.concatenate([np.zeros((len(along), 1)), along], axis=1)
    forward = scene.feed.direction == "forward"
    # The leading hinge of the outermost component that the tube holds.
    place = np.take_along_axis(hinges, (out if forward else n - out)[:, None], axis=1)
    behind = out[:, None] - turns(scene)
    return (behind >= 0) & (place + behind * diagonal > 1e-6 * scene.casing.side)


def turns(scene: Scene) -> IntArray:
    """Return how many components leave the tube before each, shape (n,)."""
    numbers = np.arange(scene.n)
    backward = scene.mount == "tube" and scene.feed.direction == "backward"
    return numbers[::-1] if backward else numbers


def kinetic_energy(scene: Scene, motion: Trajectory) -> FloatArray:
    """Return the kinetic energies of a recorded motion [J], shape (m,).

    Of all components, those in the tube too. A trajectory holds the rates of the headings, and no
    velocity of the chain as a whole. That follows from the feed while a component is in the tube;
    later from central differences of the centre of mass, which impacts within the chain do not
    make jump.

    Parameters
    ----------
    scene
        That was simulated; nothing in it may be left to chance.
    motion
        Its trajectory, all of it finite.
    """
    lever = scene.casing.diagonal * motion.rates
    turning = np.stack([-lever * np.sin(motion.angles), lever * np.cos(motion.angles)], axis=-1)
    # A component's centre is moved by those before it over their lengths, by itself over half.
    velocity = np.cumsum(turning, axis=1) - turning / 2.0
    velocity += _base_velocity(scene, motion, velocity, turning.sum(axis=1))[:, None]
    moving = np.einsum("i,mia,mia->m", scene.masses, velocity, velocity)
    return 0.5 * (moving + motion.rates**2 @ scene.inertias)


def _base_velocity(
    scene: Scene, motion: Trajectory, inner: FloatArray, end: FloatArray
) -> FloatArray:
    """Return the velocity of component 1's outer hinge [m/s], shape (m, 2).

    Relative to it, `inner` are those of the centres, shape (m, n, 2), and `end` that of component
    n's outer hinge, shape (m, 2).
    """
    velocity = np.zeros_like(motion.base)
    if scene.mount == "pinned":
        return velocity
    held = motion.released < scene.n
    if scene.feed.schedule is None:
        leaving = turns(scene)[motion.released[held]]  # turns are their own inverse
        velocity[held, 0] = scene.speeds[leaving]
    elif held.sum() > 1:
        last = motion.base[held, 0]
        if scene.feed.direction == "forward":
            last = last + scene.casing.diagonal * np.cos(motion.angles[held]).sum(axis=1)
        velocity[held, 0] = np.gradient(last, motion.time[held])
    if scene.feed.direction == "forward":
        velocity[held] -= end[held]
    free = ~held
    if free.sum() > 1:
        share = scene.masses / scene.masses.sum()
        place = centres(motion.angles[free], scene.casing.side, motion.base[free])
        drift = np.gradient(np.einsum("i,mia->ma", share, place), motion.time[free], axis=0)
        velocity[free] = drift - np.einsum("i,mia->ma", share, inner[free])
    return velocity
