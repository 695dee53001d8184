"""What the page is told of a fold: lengths in mm, energies in mJ, rounded to what can be seen."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from magfold_env.fold import Fold, Trajectory
from magfold_env.minimiser.trajectory import loaded, trajectory_energies, turns
from magfold_env.scene import Scene
from magfold_env.scene.magnets import Length

_MILLI = 1e3
_TIME = 6  # digits after the point: µs
_ANGLE = 4  # 0.006°
_LENGTH = 4  # of a mm
_DIGITS = 5  # of the largest energy


def page_data(fold: Fold) -> dict[str, Any]:
    """Return what the page shows as values that JSON can hold.

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
    energies = trajectory_energies(scene, motion)
    return {
        "word": fold.word,
        "status": fold.status.value,
        "message": fold.message,
        "sequence": list(scene.sequence),
        "side": _rounded(_MILLI * scene.casing.side, _LENGTH),
        "order": turns(scene).tolist(),
        "magnets": _magnets(scene),
        "pinned": scene.mount == "pinned",
        "tube": _tube(scene),
        "field": _field(scene),
        "facts": _facts(fold),
        "time": _rounded(motion.time, _TIME),
        "angles": _rounded(motion.angles, _ANGLE),
        "base": _rounded(_MILLI * motion.base, _LENGTH),
        "released": motion.released.tolist(),
        "loaded": loaded(scene, motion.released).sum(axis=1).tolist(),
        "magnetic": None if scene.magnets is None else _millijoules(energies.magnetic),
        "kinetic": _millijoules(energies.kinetic),
    }


def _still(fold: Fold) -> Trajectory:
    """Return the one frame of a chain that ended where it started."""
    return Trajectory(
        time=np.array([fold.time]),
        angles=fold.angles[None],
        base=fold.base[None],
        rates=np.zeros_like(fold.angles)[None],
        released=np.array([fold.scene.n]),
    )


def _magnets(scene: Scene) -> dict[str, list[float]] | None:
    if scene.magnets is None:
        return None
    names: tuple[Length, ...] = ("width", "thickness", "inset")
    return {name: _rounded(_MILLI * scene.magnets.by_face(name), _LENGTH) for name in names}


def _tube(scene: Scene) -> dict[str, float] | None:
    if scene.mount != "tube":
        return None
    return {
        "bore": _rounded(_MILLI * scene.bore, _LENGTH),
        "wall": _rounded(_MILLI * scene.feed.wall, _LENGTH),
    }


def _field(scene: Scene) -> dict[str, Any] | None:
    """Return an outer field: even flux density [mT], and the corners of a fixed magnet [mm]."""
    if scene.field is None or not scene.field.any:
        return None
    magnet = scene.field.magnet
    return {
        "uniform": [_MILLI * component for component in scene.field.uniform],
        "corners": None if magnet is None else _rounded(_MILLI * magnet.corners, _LENGTH),
    }


def _facts(fold: Fold) -> list[list[str]]:
    """Return what is written under the drawing: names and values."""
    scene = fold.scene
    facts = {"Sequence": " ".join(scene.sequence), "Mount": scene.mount}
    if scene.mount == "tube":
        slowest, fastest = float(scene.speeds.min()), float(scene.speeds.max())
        speed = f"{slowest:.4g}" if slowest == fastest else f"{slowest:.4g} to {fastest:.4g}"
        facts["Feed"] = f"{scene.feed.direction}, {speed} m/s, {scene.feed.loading}"
    facts["Casing"] = f"{_MILLI * scene.casing.side:.4g} mm"
    facts["Friction"] = f"{scene.friction:.4g}"
    if np.isfinite(fold.energy):
        facts["Magnetic energy at the end"] = f"{_MILLI * fold.energy:.4f} mJ".replace("-", "−")
    facts["Simulated time"] = f"{fold.time:.4f} s"
    return [[name, value] for name, value in facts.items()]


def _millijoules(joules: npt.NDArray[np.float64]) -> list[float]:
    largest = _MILLI * float(np.abs(joules).max())
    digits = _DIGITS if largest == 0.0 else _DIGITS - int(np.ceil(np.log10(largest)))
    return _rounded(_MILLI * joules, digits)


def _rounded(values: float | npt.NDArray[np.float64], digits: int) -> Any:
    """Return plain rounded numbers, in lists if there are many; no -0."""
    return (np.round(np.asarray(values), digits) + 0.0).tolist()
