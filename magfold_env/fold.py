"""Fold: what a simulation ends with, and Trajectory: how it got there."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from magfold_env.files import write_text
from magfold_env.scene import Scene
from magfold_env.shapes import centres

FloatArray = npt.NDArray[np.float64]


class FoldStatus(StrEnum):
    """How a simulation ended."""

    FOLDED = "folded"
    """At rest, every joint within 0.05 rad of ±90°."""
    MISFOLDED = "misfolded"
    """At rest otherwise."""
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
    released: npt.NDArray[np.int64]
    """Number of components out of the tube, n where there is none, shape (m,)."""

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.time)

    def finite(self) -> Trajectory:
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
        return Trajectory(**{name: value[:count] for name, value in vars(self).items()})


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
        return cast("dict[str, Any]", _finite(data))

    def to_json(self, path: str | Path) -> None:
        """Write `to_dict` to a file, under a temporary name first."""
        write_text(path, json.dumps(self.to_dict(), indent=2, allow_nan=False) + "\n")

    def to_html(self, path: str | Path) -> None:
        """Write a page that plays the fold: see `magfold_env.replay.write_html`."""
        # Above this module: the page shows energies along the way.
        from magfold_env.replay import write_html  # noqa: PLC0415

        write_html(self, path)


def _finite(value: Any) -> Any:
    """Return plain values in which a number JSON cannot hold (a failed fold's) is None."""
    if isinstance(value, np.ndarray):
        return _finite(value.tolist())
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in cast("dict[str, Any]", value).items()}
    if isinstance(value, list):
        return [_finite(item) for item in cast("list[Any]", value)]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
