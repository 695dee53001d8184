"""What a chain is built of, for the workshop: its magnets by kind, and its casings in words."""

from __future__ import annotations

import string
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from magfold_env.render.grades import grade_text
from magfold_env.scene import Scene

MILLI = 1e3
_DIGITS = 6  # of sizes and strengths that count as equal


class Kind(NamedTuple):
    """Magnets of one size and strength, in one depth."""

    name: str
    """A, B, ..."""
    width: float
    """[m], as all sizes."""
    height: float
    thickness: float
    inset: float
    strength: str
    """Remanence and grade, or pole charge, in words."""
    pieces: int


def kinds(scene: Scene) -> tuple[list[Kind], npt.NDArray[np.int64]]:
    """Return the kinds of magnets a chain needs, and which is where.

    Returns
    -------
    list of Kind
        In the order in which they first occur, component 1 first.
    (n, 4) array of int
        Index of the kind behind each face, -1 where there is no magnet.
    """
    where = np.full((scene.n, 4), -1)
    if scene.magnets is None:
        return [], where
    lengths = [scene.magnets.by_face(name) for name in ("width", "height", "thickness", "inset")]
    given = getattr(scene.magnets, scene.magnets.strength_name)
    strength = np.broadcast_to(np.asarray(given, dtype=np.float64), (scene.n, 4))
    known: dict[tuple[float, float, float, float, float], int] = {}
    for k, faces in enumerate(scene.sequence):
        for f, pole in enumerate(faces):
            if pole != "-":
                values = (*(float(length[f]) for length in lengths), float(strength[k, f]))
                width, height, thickness, inset, strong = (_rounded(value) for value in values)
                key = width, height, thickness, inset, strong
                where[k, f] = known.setdefault(key, len(known))
    found = [
        Kind(_name(index), *key[:4], _strength(scene, key[4]), int((where == index).sum()))
        for key, index in known.items()
    ]
    return found, where


def kind_text(kind: Kind) -> str:
    """Return what to order of a kind, and where it sits."""
    size = " × ".join(millimetres(each) for each in (kind.width, kind.height, kind.thickness))
    return f"{kind.pieces} pieces, {size} mm, inset {millimetres(kind.inset)} mm: {kind.strength}"


def casing_texts(scene: Scene) -> list[str]:
    """Return what to know of the casings, a line a fact."""
    casing = scene.casing
    lines = [
        f"{scene.n} casings, side {millimetres(casing.side)} mm, {grams(scene.masses)} each with "
        "magnets; neighbours hinged at opposite corners"
    ]
    stops = "Joints stop at ±90°, face on face" if scene.contact else "No joint stops"
    lines.append(f"{stops}; friction with the floor {scene.friction:.3g}")
    return lines


def release_text(scene: Scene) -> str:
    """Return how the chain is let go."""
    if scene.mount != "tube":
        return (
            "Component 1's outer hinge is pinned." if scene.mount == "pinned" else "Free release."
        )
    first = 1 if scene.feed.direction == "forward" else scene.n
    slow, fast = float(scene.speeds.min()), float(scene.speeds.max())
    speed = f"{MILLI * slow:.4g}" + (f" to {MILLI * fast:.4g}" if fast > slow else "")
    loading = "; magnets are set at the mouth" if scene.feed.loading == "at_mouth" else ""
    return (
        f"Tube of bore {millimetres(scene.bore)} mm, fed {scene.feed.direction}: component {first} "
        f"leaves first, at {speed} mm/s{loading}."
    )


def millimetres(metres: float) -> str:
    """Return a length in mm without needless digits."""
    return f"{MILLI * metres:.4g}"


def grams(masses: Sequence[float] | npt.NDArray[np.float64]) -> str:
    """Return masses [kg] in g: one number, or their range."""
    low, high = min(masses), max(masses)
    return f"{MILLI * low:.4g}" + (f" to {MILLI * high:.4g}" if high > low else "") + " g"


def _rounded(value: float) -> float:
    return float(f"{value:.{_DIGITS}g}")


def _name(index: int) -> str:
    more, last = divmod(index, len(string.ascii_uppercase))
    return (_name(more - 1) if more else "") + string.ascii_uppercase[last]


def _strength(scene: Scene, strength: float) -> str:
    if scene.magnets is not None and scene.magnets.strength_name == "pole_charge":
        return f"pole charge {strength:.4g} A·m"
    return f"remanence {strength:.3g} T ({grade_text(strength)})"
