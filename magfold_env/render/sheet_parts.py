"""Facts that a workshop needs about a chain: its magnets by kind, its casings and its release."""

from typing import NamedTuple

import numpy as np

from magfold_env.fold import Fold
from magfold_env.replay.data import number_range
from magfold_env.reporting.tables import letters
from magfold_env.scene import Magnets, Scene
from magfold_env.shapes import IntArray

_MILLI = 1e3


class Kind(NamedTuple):
    """Magnets of the same size, strength and inset."""

    name: str
    """Letter of the kind: A, B, ..."""
    pieces: int
    text: str
    """Size, inset, strength and grade."""


def kinds(scene: Scene) -> tuple[list[Kind], IntArray]:
    """Return a chain's kinds of magnets, and the index of the kind behind each face, shape (n, 4).

    Kinds are in the order of their first use, beginning with component 1; the index -1 means no
    magnet. Magnets with the same printed sizes and strengths are of one kind.
    """
    where = np.full((scene.n, 4), -1)
    if scene.magnets is None:
        return [], where
    given = getattr(scene.magnets, scene.magnets.strength_name)
    strength = np.broadcast_to(np.asarray(given, dtype=np.float64), where.shape)
    known: dict[str, int] = {}
    for k, faces in enumerate(scene.sequence):
        for f, pole in enumerate(faces):
            if pole != "-":
                text = _magnet_text(scene.magnets, f, float(strength[k, f]))
                where[k, f] = known.setdefault(text, len(known))
    found = [Kind(letters(k), int((where == k).sum()), text) for text, k in known.items()]
    return found, where


def _magnet_text(magnets: Magnets, face: int, strength: float) -> str:
    sizes = (magnets.by_face(name)[face] for name in ("width", "height", "thickness"))
    size = " × ".join(map(_millimetres, sizes))
    strong = f"remanence {strength:.3g} T ({grade_text(strength)})"
    if magnets.strength_name == "pole_charge":
        strong = f"pole charge {strength:.4g} A·m"
    return f"{size} mm, inset {_millimetres(magnets.by_face('inset')[face])} mm: {strong}"


def facts(scene: Scene, fold: Fold) -> list[str]:
    """Return the facts about a chain and its surroundings, one per line."""
    stops = "Joints stop at ±90°, face on face" if scene.contact else "No joint stops"
    lines = [
        f"{scene.n} casings, side {_millimetres(scene.casing.side)} mm, "
        f"{number_range(_MILLI * scene.masses)} g each with magnets; "
        "neighbours hinged at opposite corners",
        f"{stops}; friction with the floor {number_range(scene.frictions)}",
    ]
    if scene.mount == "tube":
        lines += _feed_texts(scene, fold)
    else:
        pinned = scene.mount == "pinned"
        lines.append("Component 1's outer hinge is pinned." if pinned else "Free release.")
    if scene.obstacles:
        lines.append(f"Obstacles: {len(scene.obstacles)}; see the scene.")
    if scene.field is not None and scene.field.magnet is not None:
        x, y = map(_millimetres, scene.field.magnet.position)
        lines.append(f"A fixed magnet stands at ({x}, {y}) mm: see the scene.")
    return lines


def _feed_texts(scene: Scene, fold: Fold) -> list[str]:
    feed = scene.feed
    first = 1 if feed.direction == "forward" else scene.n
    speeds, how = scene.speeds, "at"
    if feed.schedule is not None:
        speeds, how = feed.schedule.speeds, "back and forth at"
    loading = "; magnets are set at the mouth" if feed.loading == "at_mouth" else ""
    return [
        f"Tube of bore {_millimetres(scene.bore)} mm, fed {feed.direction}: component {first} "
        f"leaves first, {how} {number_range(_MILLI * speeds)} mm/s{loading}.",
        f"The feed pushes or pulls with at most {abs(fold.push_peak):.2g} N.",
    ]


def _millimetres(metres: float) -> str:
    """Return a length in mm without trailing zeros."""
    return f"{_MILLI * metres:.4g}"


# Smallest and largest remanence [T] of commercial grades, from suppliers' tables. Suppliers agree
# to 0.01 T on sintered grades. They differ more on bonded grades, so texts contain the range too.
GRADES = {
    "bonded NdFeB BN2": (0.30, 0.38),
    "bonded NdFeB BN3": (0.35, 0.43),
    "bonded NdFeB BN4": (0.42, 0.50),
    "bonded NdFeB BN5": (0.48, 0.55),
    "bonded NdFeB BN6": (0.53, 0.60),
    "bonded NdFeB BN7": (0.58, 0.65),
    "bonded NdFeB BN8": (0.62, 0.68),
    "bonded NdFeB BN10": (0.65, 0.71),
    "NdFeB N30": (1.08, 1.13),
    "NdFeB N33": (1.13, 1.17),
    "NdFeB N35": (1.17, 1.22),
    "NdFeB N38": (1.22, 1.25),
    "NdFeB N40": (1.25, 1.28),
    "NdFeB N42": (1.28, 1.32),
    "NdFeB N45": (1.32, 1.38),
    "NdFeB N48": (1.38, 1.42),
    "NdFeB N50": (1.40, 1.45),
    "NdFeB N52": (1.43, 1.48),
}


def grade_text(remanence: float) -> str:
    """Return a text that names the grade to buy for a remanence [T].

    If several grades' ranges contain the remanence, the one with the nearest middle is named.
    """

    def distance(name: str) -> tuple[float, float]:
        low, high = GRADES[name]
        outside = max(low - remanence, remanence - high, 0.0)
        return outside, abs(remanence - (low + high) / 2.0)

    name = min(GRADES, key=distance)
    low, high = GRADES[name]
    common = "" if low <= remanence <= high else "no common grade; nearest "
    return f"{common}{name}, {low:.2f}–{high:.2f} T"
