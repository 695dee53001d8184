"""The result of a simulation, `Fold`, and its recorded motion, `Trajectory`."""

import json
import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field, replace
from enum import StrEnum
from pathlib import Path
from typing import Any, Self

import numpy as np
import numpy.typing as npt
from pydantic_core import from_json, to_json

from magfold_env.files import reading_json, write_text
from magfold_env.replay import Recording, page, page_data, write_html
from magfold_env.replay.data import feed_text
from magfold_env.reporting.notebook import NotebookDisplay
from magfold_env.reporting.page import Block, Frame
from magfold_env.reporting.tables import Columns
from magfold_env.scene import Scene
from magfold_env.shapes import BoolArray, FloatArray, IntArray, centres, parse_word

FORMAT = "magfold_env fold 1"

MOST_JOINTS = 12
"""Largest number of joint angles in one line; a line shows up to four times as many letters."""


class FoldStatus(StrEnum):
    """The status of a simulation at its end."""

    FOLDED = "folded"
    """At rest, with every joint within 0.05 rad of ±90°."""
    MISFOLDED = "misfolded"
    """At rest in any other shape."""
    HELD = "held"
    """At rest while a feed that has ended keeps components in the tube."""
    JAMMED = "jammed"
    """The drive slipped for 0.1 s, because the chain needed more than the drive's largest force."""
    UNSETTLED = "unsettled"
    """The time or the number of steps reached its limit while the chain was moving."""
    FAILED = "failed"
    """The numbers became invalid; the fold's message describes where."""


@dataclass(frozen=True, eq=False, repr=False)
class Trajectory(Columns):
    """A recorded fold: m frames of n components, component 1 first.

    Frames are evenly spaced in time except for the last one, which is the end of the fold.
    """

    time: FloatArray
    """Times [s], shape (m,)."""
    angles: FloatArray
    """Absolute headings [rad], shape (m, n)."""
    base: FloatArray
    """Component 1's outer hinge [m], shape (m, 2)."""
    rates: FloatArray
    """Rates of the headings [rad/s], shape (m, n)."""
    released: IntArray
    """Number of components out of the tube, n without a tube, shape (m,)."""
    base_velocity: FloatArray
    """Velocity of component 1's outer hinge [m/s], shape (m, 2)."""
    push: FloatArray
    """Mean force of the feed along the tube since the previous frame [N], shape (m,); negative
    where it pulls. The first frame includes the impulse that sets the chain in motion."""
    side: float
    """Edge of a casing [m]."""

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.time)

    def __repr__(self) -> str:
        """Return the number of frames and their time span."""
        span = f", {self.time[0]:.3g} to {self.time[-1]:.3g} s" if len(self) else ""
        return f"<Trajectory: {len(self)} frames of {self.angles.shape[1]} components{span}>"

    @property
    def centres(self) -> FloatArray:
        """The casings' centres [m], shape (m, n, 2)."""
        return centres(self.angles, side=self.side, base=self.base)

    def columns(self) -> dict[str, npt.NDArray[Any]]:
        """Return the frames as columns, in SI units, component 1 first.

        The columns are ``time``, ``released``, ``push``, the outer hinge's ``base_x``, ``base_y``,
        ``base_vx`` and ``base_vy``, and ``x_k``, ``y_k``, ``angle_k`` and ``rate_k`` for each
        component k.
        """
        x, y = np.moveaxis(self.centres, 2, 0)
        each = {"x": x, "y": y, "angle": self.angles, "rate": self.rates}
        hinge = np.concatenate([self.base, self.base_velocity], axis=1).T
        return {
            **{name: getattr(self, name) for name in ("time", "released", "push")},
            **dict(zip(("base_x", "base_y", "base_vx", "base_vy"), hinge, strict=True)),
            **{f"{name}_{k + 1}": each[name][:, k] for k in range(x.shape[1]) for name in each},
        }

    def finite(self) -> Self:
        """Return the frames before the first frame with numbers that are not finite.

        Raises
        ------
        ValueError
            If this is the first frame of the trajectory.
        """
        arrays = (self.time[:, None], self.angles, self.base, self.rates, self.base_velocity)
        sound = np.logical_and.reduce([np.isfinite(array).all(axis=1) for array in arrays])
        count = len(self) if sound.all() else int(sound.argmin())
        if count == 0:
            raise ValueError("folds: a trajectory without a finite frame is not allowed")
        cut = {
            name: np.asarray(value)[:count] for name, value in vars(self).items() if name != "side"
        }
        return replace(self, **cut)


@dataclass(frozen=True, eq=False, repr=False)
class Fold(NotebookDisplay):
    """The result of one simulation."""

    scene: Scene
    """The scene after random draws; simulating it again gives this fold for any seed."""
    status: FoldStatus
    """Status of the fold."""
    message: str
    """A message about the status; for a failure, it describes where the failure happened."""
    word: str
    """The nearest fold word, component 1 to n; empty if the simulation failed."""
    angles: FloatArray
    """Absolute headings at the end [rad], shape (n,)."""
    base: FloatArray
    """Component 1's outer hinge at the end [m], shape (2,)."""
    energy: float
    """Magnetic energy at the end [J]; each pair of components counts once."""
    time: float
    """Simulated time [s]."""
    steps: int
    """Number of time steps."""
    evaluations: int
    """Number of evaluations of the accelerations."""
    push_peak: float = 0.0
    """Largest mean force of the feed along the tube over a whole millisecond [N]. It is positive
    where the feed pushes and negative where it pulls, and 0 without a tube. Impulses of impacts and
    of changes of speed are included; the impulse that sets the chain in motion is not."""
    in_tube: int = 0
    """Number of components in the tube at the end."""
    trajectory: Trajectory | None = None
    """The recorded motion, if recording was requested."""
    magnetic_energy: Callable[[Scene, Trajectory], FloatArray] | None = field(
        default=None, repr=False
    )
    """Function that returns the magnetic energies of frames [J], shape (m,).

    The energies are computed only on request, because they take several times as long as the fold.
    """

    def __repr__(self) -> str:
        """Return the result in one line, with relative joint angles in degrees."""
        joints = ", ".join(f"{angle:.1f}" for angle in np.degrees(self.joint_angles[:MOST_JOINTS]))
        more = ", …" if len(self.joint_angles) > MOST_JOINTS else ""
        cut = f"{self.word[: 4 * MOST_JOINTS]}…" if len(self.word) > 4 * MOST_JOINTS else self.word
        word = f" {cut}" if cut else ""
        frames = "" if self.trajectory is None else f", {len(self.trajectory)} frames"
        return (
            f"<Fold{word}: {self.status} after {self.time:.3g} s, joints at ({joints}{more})°, "
            f"{1e3 * self.energy:.4g} mJ{frames}>"
        )

    def _shown(self) -> list[Block]:
        with suppress(ValueError):
            return [Frame("Playable fold", page(page_data(recording(self))))]
        return [repr(self)[1:-1], *self.scene.pictured(self.angles)]

    @property
    def joint_angles(self) -> FloatArray:
        """Relative angles at the end [rad], shape (n-1,)."""
        return np.diff(self.angles)

    def centres(self) -> FloatArray:
        """Return the casings' centres at the end [m], shape (n, 2)."""
        return centres(self.angles, side=self.scene.casing.side, base=self.base)

    def to_dict(self) -> dict[str, Any]:
        """Return the fold as JSON values, in which numbers that are not finite become None."""
        left_out = {"scene", "trajectory", "magnetic_energy"}
        data: dict[str, Any] = {
            "format": FORMAT,
            **{name: value for name, value in vars(self).items() if name not in left_out},
            "joint_angles": self.joint_angles,
            "centres": self.centres(),
            "scene": self.scene.model_dump(mode="json"),
        }
        if self.trajectory is not None:
            data["trajectory"] = vars(self.trajectory)
        return from_json(to_json(data, inf_nan_mode="null", fallback=np.ndarray.tolist))

    def to_json(self, path: str | Path) -> None:
        """Write the values of `to_dict` to a file, through a temporary file."""
        write_text(path, json.dumps(self.to_dict(), indent=2, allow_nan=False) + "\n")

    @classmethod
    def from_json(cls, path: str | Path) -> Self:
        """Read a fold that `to_json` wrote, without its trajectory.

        Raises
        ------
        ValueError
            If the file is not a fold.
        """
        with reading_json(path, "a fold", FORMAT) as data:
            scene = Scene(**data["scene"])
            angles, base = (np.array(data[key], dtype=np.float64) for key in ("angles", "base"))
            if angles.shape != (scene.n,) or base.shape != (2,):
                raise ValueError(f"angles and base must have shapes ({scene.n},) and (2,)")
            return cls(
                scene=scene,
                status=FoldStatus(data["status"]),
                message=str(data["message"]),
                word=parse_word(data["word"]),
                angles=angles,
                base=base,
                energy=math.nan if data["energy"] is None else float(data["energy"]),
                time=float(data["time"]),
                steps=int(data["steps"]),
                evaluations=int(data["evaluations"]),
                push_peak=float(data["push_peak"]),
                in_tube=int(data["in_tube"]),
            )

    def to_html(self, path: str | Path) -> None:
        """Write a page that plays the fold; see `magfold_env.replay.write_html`.

        Raises
        ------
        ValueError
            If the fold was not recorded, or failed at its start.
        """
        write_html(recording(self), path)


def motion_of(fold: Fold) -> Trajectory:
    """Return a fold's finite frames, or refuse a fold that was not recorded."""
    if fold.trajectory is None:
        allowed = "a fold without trajectory is not allowed; simulate it with a frame_rate"
        raise ValueError(f"fold: {allowed}")
    return fold.trajectory.finite()


def recording(fold: Fold) -> Recording:
    """Return the data that a page needs to play a fold, including energies over time.

    A fold that was not recorded, or failed at its start, raises a ValueError.
    """
    scene, motion = fold.scene, motion_of(fold)
    find = fold.magnetic_energy if scene.magnets is not None else None
    return Recording(
        scene=scene,
        word=fold.word,
        status=fold.status.value,
        message=fold.message,
        energy=fold.energy,
        duration=fold.time,
        **along(scene, motion),
        magnetic=None if find is None else find(scene, motion),
        feed=feed_text(scene),
    )


def along(scene: Scene, motion: Trajectory) -> dict[str, Any]:
    """Return the fields of a `Recording` that describe a motion, except the magnetic energies."""
    return {
        "time": motion.time,
        "angles": motion.angles,
        "base": motion.base,
        "released": motion.released,
        "order": turns(scene),
        "loaded": loaded(scene, motion.angles, motion.base, motion.released).sum(axis=1),
        "push": motion.push,
        "kinetic": kinetic_energy(scene, motion),
    }


def loaded(
    scene: Scene, angles: FloatArray, base: FloatArray, released: npt.ArrayLike
) -> BoolArray:
    """Return which components have magnets in each of m states, component 1 first, shape (m, n).

    All components have magnets unless the scene loads them at the mouth. In that case, a component
    has magnets if its leading hinge would be outside the tube after all components between it and
    the tube were straightened. ``angles`` are headings (m, n) [rad], ``base`` contains the outer
    hinges of component 1 (m, 2) [m], and ``released`` counts components out of the tube (m,).
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
    """Return the number of components that leave the tube before each one, shape (n,)."""
    numbers = np.arange(scene.n)
    backward = scene.mount == "tube" and scene.feed.direction == "backward"
    return numbers[::-1] if backward else numbers


def kinetic_energy(scene: Scene, motion: Trajectory) -> FloatArray:
    """Return the kinetic energies of a recorded motion [J], shape (m,).

    They include the energies of components in the tube. The scene must be concrete: nothing is left
    to draw. The motion must be finite.
    """
    lever = scene.casing.diagonal * motion.rates
    turning = np.stack([-lever * np.sin(motion.angles), lever * np.cos(motion.angles)], axis=-1)
    # Earlier components contribute with whole diagonals, the component itself with half of its own.
    velocity = motion.base_velocity[:, None] + np.cumsum(turning, axis=1) - turning / 2.0
    moving = np.einsum("i,mia,mia->m", scene.masses, velocity, velocity)
    return 0.5 * (moving + motion.rates**2 @ scene.inertias)
