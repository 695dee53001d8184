"""The parts of a chain for the workshop: its magnets by kind, and a description of its casings."""

from typing import NamedTuple

import numpy as np

from magfold_env.replay.data import number_range
from magfold_env.reporting.tables import letters
from magfold_env.scene import Scene
from magfold_env.shapes import FloatArray, IntArray

MILLI = 1e3
_DIGITS = 6  # of sizes and strengths that count as equal


class Kind(NamedTuple):
    """Magnets of one size, strength and depth."""

    name: str
    """A, B, ..."""
    width: float
    """Width [m], like all sizes."""
    height: float
    thickness: float
    inset: float
    strength: str
    """Remanence and grade, or pole charge, as text."""
    pieces: int


def kinds(scene: Scene) -> tuple[list[Kind], IntArray]:
    """Return the kinds of magnets of a chain and their places.

    Returns
    -------
    list of Kind
        The kinds in the order of their first use, component 1 first.
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
                values = (*(length[f] for length in lengths), strength[k, f])
                width, height, thickness, inset, strong = (
                    float(f"{value:.{_DIGITS}g}") for value in values
                )
                key = width, height, thickness, inset, strong
                where[k, f] = known.setdefault(key, len(known))
    found = [
        Kind(letters(index), *key[:4], _strength(scene, key[4]), int((where == index).sum()))
        for key, index in known.items()
    ]
    return found, where


def kind_text(kind: Kind) -> str:
    """Return the order text for a kind, and its place in the casing."""
    size = " × ".join(millimetres(each) for each in (kind.width, kind.height, kind.thickness))
    return f"{kind.pieces} pieces, {size} mm, inset {millimetres(kind.inset)} mm: {kind.strength}"


def casing_texts(scene: Scene) -> list[str]:
    """Return the facts about the casings, one per line."""
    casing = scene.casing
    lines = [
        f"{scene.n} casings, side {millimetres(casing.side)} mm, {_milli_range(scene.masses)} g "
        "each with magnets; neighbours hinged at opposite corners"
    ]
    stops = "Joints stop at ±90°, face on face" if scene.contact else "No joint stops"
    lines.append(f"{stops}; friction with the floor {number_range(scene.frictions)}")
    return lines


def release_text(scene: Scene) -> str:
    """Return the text on the release of the chain."""
    if scene.mount != "tube":
        return (
            "Component 1's outer hinge is pinned." if scene.mount == "pinned" else "Free release."
        )
    first = 1 if scene.feed.direction == "forward" else scene.n
    loading = "; magnets are set at the mouth" if scene.feed.loading == "at_mouth" else ""
    speeds = _milli_range(scene.speeds)
    if (schedule := scene.feed.schedule) is not None:
        speeds = f"back and forth at {_milli_range(schedule.speeds)}"
    else:
        speeds = f"at {speeds}"
    return (
        f"Tube of bore {millimetres(scene.bore)} mm, fed {scene.feed.direction}: component {first} "
        f"leaves first, {speeds} mm/s{loading}."
    )


def millimetres(metres: float) -> str:
    """Return a length in mm without trailing zeros."""
    return f"{MILLI * metres:.4g}"


def _milli_range(values: FloatArray) -> str:
    """Return a thousand times some values: one number, or their range."""
    return number_range(MILLI * values)


def _strength(scene: Scene, strength: float) -> str:
    if scene.magnets is not None and scene.magnets.strength_name == "pole_charge":
        return f"pole charge {strength:.4g} A·m"
    return f"remanence {strength:.3g} T ({grade_text(strength)})"


# --- grades ----------------------------------------------------------------------------------


class Grade(NamedTuple):
    """A commercial grade: smallest and largest remanence [T]."""

    name: str
    low: float
    high: float

    def __str__(self) -> str:
        return f"{self.name}, {self.low:.2f}–{self.high:.2f} T"


# Values from suppliers' tables. Sintered grades agree between suppliers to 0.01 T; the names of
# bonded ones vary more, so ranges are printed with them.
GRADES = (
    Grade("bonded NdFeB BN2", 0.30, 0.38),
    Grade("bonded NdFeB BN3", 0.35, 0.43),
    Grade("bonded NdFeB BN4", 0.42, 0.50),
    Grade("bonded NdFeB BN5", 0.48, 0.55),
    Grade("bonded NdFeB BN6", 0.53, 0.60),
    Grade("bonded NdFeB BN7", 0.58, 0.65),
    Grade("bonded NdFeB BN8", 0.62, 0.68),
    Grade("bonded NdFeB BN10", 0.65, 0.71),
    Grade("NdFeB N30", 1.08, 1.13),
    Grade("NdFeB N33", 1.13, 1.17),
    Grade("NdFeB N35", 1.17, 1.22),
    Grade("NdFeB N38", 1.22, 1.25),
    Grade("NdFeB N40", 1.25, 1.28),
    Grade("NdFeB N42", 1.28, 1.32),
    Grade("NdFeB N45", 1.32, 1.38),
    Grade("NdFeB N48", 1.38, 1.42),
    Grade("NdFeB N50", 1.40, 1.45),
    Grade("NdFeB N52", 1.43, 1.48),
)


def nearest_grade(remanence: float) -> Grade:
    """Return the grade whose range contains a remanence [T], or the nearest grade.

    If several ranges contain it, the one whose middle is nearest is returned.
    """

    def distance(grade: Grade) -> tuple[float, float]:
        outside = max(grade.low - remanence, remanence - grade.high, 0.0)
        return outside, abs(remanence - (grade.low + grade.high) / 2.0)

    return min(GRADES, key=distance)


def grade_text(remanence: float) -> str:
    """Return a text that names the grade to buy for a remanence [T]."""
    grade = nearest_grade(remanence)
    if grade.low <= remanence <= grade.high:
        return str(grade)
    return f"no common grade; nearest {grade}"
