"""How deep casings with rounded corners lie in each other and in the walls; plain NumPy.

A casing is a square core widened by the corner's radius. Where cores are apart, what counts is the
least distance of a corner of one from an edge of the other; where they overlap, the least way out
along an edge's normal.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
import numpy.typing as npt

from magfold_env.scene import Scene
from magfold_env.shapes import centres

Floats = npt.NDArray[np.float64]


def deepest_overlap(scene: Scene, angles: Floats, base: Floats, released: int) -> float:
    """Return the deepest overlap of two casings, or of a casing and a wall [m]; 0 if none.

    Components that the tube holds are guided by it: walls are for the others.

    Parameters
    ----------
    angles
        Headings [rad], shape (n,).
    base
        Outer hinge of component 1 [m], shape (2,).
    released
        Components that are out of the tube.
    """
    side, radius = scene.casing.side, scene.casing.corner_radius
    places = centres(angles, side, base)
    cores = [square(p, a, side - 2.0 * radius) for p, a in zip(places, angles, strict=True)]
    reach = scene.casing.diagonal
    worst = 0.0
    for i, j in combinations(range(scene.n), 2):
        if np.hypot(*(places[i] - places[j])) < reach:
            worst = max(worst, 2.0 * radius - separation(cores[i], cores[j]))
    if scene.mount == "tube":
        edge = min(radius, 0.25 * scene.feed.wall)
        forward = scene.feed.direction == "forward"
        free = slice(released) if forward else slice(scene.n - released, None)
        for wall in walls(scene, edge):
            for core, place in zip(cores[free], places[free], strict=True):
                if place[0] < reach:
                    worst = max(worst, radius + edge - separation(core, wall))
    return worst


def square(centre: Floats, heading: float, side: float) -> Floats:
    """Corners (4, 2) of a square whose diagonal points along the heading, counterclockwise."""
    turn = heading + 0.5 * np.pi * np.arange(4)
    return centre + side / np.sqrt(2.0) * np.stack([np.cos(turn), np.sin(turn)], axis=1)


def walls(scene: Scene, radius: float) -> list[Floats]:
    """Cores (4, 2) of the tube's two walls, counterclockwise; the mouth is at x = 0."""
    left = -2.0 * (scene.n + 1) * scene.casing.diagonal
    found: list[Floats] = []
    for middle in (0.5, -0.5):
        y = middle * (scene.bore + scene.feed.wall)
        half = 0.5 * scene.feed.wall - radius
        low, high, right = y - half, y + half, -radius
        found.append(np.array([[left, low], [right, low], [right, high], [left, high]]))
    return found


def separation(one: Floats, other: Floats) -> float:
    """Distance of two convex polygons [m]; where they overlap, minus the shortest way out."""
    gaps = np.array([_largest_gap(one, other), _largest_gap(other, one)])
    if gaps.max() <= 0.0:
        return float(gaps.max())
    return min(_corner_distance(one, other), _corner_distance(other, one))


def _largest_gap(one: Floats, other: Floats) -> float:
    """Largest gap along an outward normal of an edge of ``one``."""
    edge = np.roll(one, -1, axis=0) - one
    normal = np.stack([edge[:, 1], -edge[:, 0]], axis=1) / np.hypot(*edge.T)[:, None]
    beyond = normal @ other.T - np.sum(normal * one, axis=1)[:, None]
    return float(beyond.min(axis=1).max())


def _corner_distance(one: Floats, other: Floats) -> float:
    """Least distance of a corner of ``other`` from an edge of ``one``."""
    edge = np.roll(one, -1, axis=0) - one
    away = other[:, None] - one
    share = np.sum(away * edge, axis=2) / np.sum(edge**2, axis=1)
    nearest = away - np.clip(share, 0.0, 1.0)[..., None] * edge
    return float(np.hypot(nearest[..., 0], nearest[..., 1]).min())
