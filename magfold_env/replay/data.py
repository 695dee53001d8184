"""Data of a fold for the replay page, with lengths in mm, energies in mJ, and few digits."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from magfold_env.scene import Scene
from magfold_env.scene.magnets import Length
from magfold_env.shapes import FloatArray, IntArray

_MILLI = 1e3
_TIME = 6  # digits after the point: µs
_ANGLE = 4  # digits after the point, in rad: 0.006°
_LENGTH = 4  # digits after the point, in mm
_DIGITS = 5  # significant digits of the largest energy or force

WORDS = "one letter per joint, from component 1 on: L turns left, R right, S stays straight."
"""Explanation of a fold word."""


class Recording(NamedTuple):
    """A recorded fold: m finite frames of n components, component 1 first."""

    scene: Scene
    word: str  # at the end; empty if the simulation failed
    status: str
    message: str  # about the status
    energy: float  # magnetic, at the end [J]
    duration: float  # simulated time [s]
    time: FloatArray  # (m,) [s]
    angles: FloatArray  # absolute headings, (m, n) [rad]
    base: FloatArray  # component 1's outer hinge, (m, 2) [m]
    released: IntArray  # number of components out of the tube, (m,)
    order: IntArray  # number of components that leave the tube before each one, (n,)
    loaded: IntArray  # number of components with magnets, (m,)
    push: FloatArray  # force of the feed along the tube, (m,) [N]
    kinetic: FloatArray  # kinetic energy, (m,) [J]
    magnetic: FloatArray | None  # magnetic energy, (m,) [J]; None without magnets or if unknown
    feed: str  # description of the feed
    earlier: Sequence[tuple[int, Sequence[str]]] = ()
    """Sequences before the last one, each with the index of the first frame without it."""


def page_data(fold: Recording) -> dict[str, Any]:
    """Return the data of the page as JSON values."""
    scene = fold.scene
    return {
        "word": fold.word,
        "status": fold.status,
        "message": fold.message,
        "sequence": list(scene.sequence),
        "earlier": [[end, list(sequence)] for end, sequence in fold.earlier],
        "side": _millimetres(scene.casing.side),
        "order": fold.order.tolist(),
        "magnets": _magnets(scene),
        "pinned": scene.mount == "pinned",
        "tube": _tube(scene),
        "obstacles": [_millimetres(each.corners) for each in scene.obstacles],
        "field": _field(scene),
        "facts": _facts(fold),
        "time": _rounded(fold.time, _TIME),
        "angles": _rounded(fold.angles, _ANGLE),
        "base": _millimetres(fold.base),
        "released": fold.released.tolist(),
        "loaded": fold.loaded.tolist(),
        "magnetic": None if fold.magnetic is None else _scaled(_MILLI * fold.magnetic),
        "kinetic": _scaled(_MILLI * fold.kinetic),
        "push": _scaled(fold.push) if scene.mount == "tube" else None,
    }


def _magnets(scene: Scene) -> dict[str, list[float]] | None:
    if scene.magnets is None:
        return None
    names: tuple[Length, ...] = ("width", "thickness", "inset")
    return {name: _millimetres(scene.magnets.by_face(name)) for name in names}


def _tube(scene: Scene) -> dict[str, float] | None:
    if scene.mount != "tube":
        return None
    return {"bore": _millimetres(scene.bore), "wall": _millimetres(scene.feed.wall)}


def _field(scene: Scene) -> dict[str, Any] | None:
    """Return the uniform flux density [mT] and the corners of the fixed magnet [mm]."""
    if scene.field is None or not scene.field.any:
        return None
    magnet = scene.field.magnet
    return {
        "uniform": [_MILLI * component for component in scene.field.uniform],
        "corners": None if magnet is None else _millimetres(magnet.outline.corners),
    }


def _facts(fold: Recording) -> list[list[str]]:
    """Return the names and values that the page shows below the drawing."""
    scene = fold.scene
    facts = {"Sequence": " ".join(scene.sequence), "Mount": scene.mount}
    if scene.mount == "tube":
        facts["Feed"] = fold.feed
    facts["Casing"] = f"{_MILLI * scene.casing.side:.4g} mm"
    facts["Friction"] = number_range(scene.frictions)
    if np.isfinite(fold.energy):
        facts["Magnetic energy at the end"] = f"{_MILLI * fold.energy:.4f} mJ".replace("-", "−")
    facts["Simulated time"] = f"{fold.duration:.4f} s"
    return [[name, value] for name, value in facts.items()]


def feed_text(scene: Scene) -> str:
    """Return a description of the feed: direction, speed and loading."""
    schedule = scene.feed.schedule
    speeds = scene.speeds if schedule is None else schedule.speeds
    return f"{scene.feed.direction}, {number_range(speeds)} m/s, {scene.feed.loading}"


def number_range(values: FloatArray) -> str:
    """Return values as text: one number if they are equal, else the smallest and the largest."""
    low, high = float(values.min()), float(values.max())
    return f"{low:.4g}" if low == high else f"{low:.4g} to {high:.4g}"


def _scaled(values: FloatArray) -> list[float]:
    """Return numbers rounded relative to the largest number."""
    largest = float(np.abs(values).max())
    digits = _DIGITS if largest == 0.0 else _DIGITS - int(np.ceil(np.log10(largest)))
    return _rounded(values, digits)


def _millimetres(metres: float | FloatArray) -> Any:
    return _rounded(_MILLI * metres, _LENGTH)


def _rounded(values: float | FloatArray, digits: int) -> Any:
    """Return a rounded number, or lists of rounded numbers, without -0."""
    return (np.round(np.asarray(values), digits) + 0.0).tolist()
