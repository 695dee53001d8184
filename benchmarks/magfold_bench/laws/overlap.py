"""Overlaps of round-cornered casings with each other and with obstacles, in plain NumPy.

A casing is a square core widened by the corner's radius, and an obstacle is a rectangle widened in
the same way. If cores are apart, their separation is the least distance from a corner of one to the
other. If they overlap, it is minus the shortest shift along an edge's normal that parts them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from magfold_env.scene import Scene
from magfold_env.shapes import centres

Floats = npt.NDArray[np.float64]

TO_FACE = 0.25 * np.pi  # from a casing's heading to the normal of its first face
SIGNS = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]])


class Boxes(NamedTuple):
    """Rectangles; all arrays except `turn` have the shape (k, 2)."""

    centre: Floats
    """Centres [m]."""
    turn: Floats
    """Direction of the first side [rad], shape (k,)."""
    half: Floats
    """Half the lengths of both sides [m]."""

    @property
    def axes(self) -> Floats:
        """Directions of the sides, shape (k, 2, 2), indexed by side, then by x and y."""
        c, s = np.cos(self.turn), np.sin(self.turn)
        return np.stack([np.stack([c, s], axis=1), np.stack([-s, c], axis=1)], axis=1)

    @property
    def corners(self) -> Floats:
        """Corners [m], shape (k, 4, 2)."""
        return self.centre[:, None] + (SIGNS * self.half[:, None]) @ self.axes

    def of(self, chosen: npt.NDArray[np.intp] | npt.NDArray[np.bool_]) -> Boxes:
        """Return the chosen boxes."""
        return Boxes(self.centre[chosen], self.turn[chosen], self.half[chosen])


class Depths(NamedTuple):
    """Depths of overlaps [m] in m states; 0 where no bodies overlap."""

    casings: Floats
    """The deepest overlap of two casings, shape (m,)."""
    solids: Floats
    """The deepest overlap of a casing and each of the scene's solids, shape (m, solids)."""

    @property
    def deepest(self) -> Floats:
        """The deepest overlap of any bodies, shape (m,)."""
        return np.maximum(self.casings, self.solids.max(axis=1, initial=0.0))


def depths(scene: Scene, angles: Floats, base: Floats, released: npt.NDArray[np.int64]) -> Depths:
    """Return the depths of overlaps between casings and with fixed bodies.

    The tube guides the components that it holds, so only components outside can overlap solids.
    The tube's walls separate the components outside from all held ones except the two next to the
    mouth. The arguments describe m states: headings (m, n) [rad], the outer hinge of component 1
    (m, 2) [m], and the number of components outside the tube (m,).
    """
    solids = obstacles(scene)
    found = Depths(np.zeros(len(angles)), np.zeros((len(angles), len(solids))))
    side, radius = scene.casing.side, scene.casing.corner_radius
    places = centres(angles, side, base)

    def cores(frame: npt.NDArray[np.intp], component: npt.NDArray[np.intp]) -> Boxes:
        half = np.full((len(frame), 2), 0.5 * side - radius)
        return Boxes(places[frame, component], angles[frame, component] + TO_FACE, half)

    free = order_in_feed(scene) < released[:, None]
    inside = order_in_feed(scene) > released[:, None] + 1
    # Casings do not meet if their centres are farther apart than a diagonal.
    reach2 = scene.casing.diagonal**2
    for apart in range(1, scene.n):
        away2 = ((places[:, apart:] - places[:, :-apart]) ** 2).sum(axis=2)
        walled = (inside[:, apart:] & free[:, :-apart]) | (free[:, apart:] & inside[:, :-apart])
        frame, i = np.nonzero((away2 < reach2) & ~walled)
        gap = separation(cores(frame, i), cores(frame, i + apart), 2.0 * radius)
        np.maximum.at(found.casings, frame, 2.0 * radius - gap)
    for k, (solid, edge) in enumerate(solids):
        near = ((places - solid.centre) @ solid.axes[0].T) ** 2
        within = (near < (solid.half + 0.5 * scene.casing.diagonal) ** 2).all(axis=2)
        frame, i = np.nonzero(free & within)
        alike = solid.of(np.zeros(len(frame), dtype=np.intp))
        gap = separation(cores(frame, i), alike, radius + edge)
        np.maximum.at(found.solids[:, k], frame, radius + edge - gap)
    return found


def deepest_overlap(scene: Scene, angles: Floats, base: Floats, released: int) -> float:
    """Return the deepest overlap [m] in one state, or 0; angles are (n,), the base is (2,)."""
    return float(depths(scene, angles[None], base[None], np.array([released])).deepest[0])


def order_in_feed(scene: Scene) -> npt.NDArray[np.intp]:
    """Return, for each component, how many components leave the tube before it, shape (n,)."""
    number = np.arange(scene.n)
    return number if scene.feed.direction == "forward" else number[::-1]


def beyond_bore(
    scene: Scene, angles: Floats, base: Floats, released: npt.NDArray[np.int64]
) -> Floats:
    """Return the largest distance of a held casing's corner beyond the tube's inner wall [m], (m,).

    The arguments are those of `depths`. Corners are treated as sharp.
    """
    turn = angles + TO_FACE
    half_height = 0.5 * scene.casing.side * (np.abs(np.cos(turn)) + np.abs(np.sin(turn)))
    reach = np.abs(centres(angles, scene.casing.side, base)[..., 1]) + half_height
    held = order_in_feed(scene) >= released[:, None]
    return np.where(held, reach - 0.5 * scene.bore, 0.0).max(axis=1, initial=0.0)


def obstacles(scene: Scene) -> list[tuple[Boxes, float]]:
    """Return the cores of fixed bodies and their corners' radii; the tube's mouth is at x = 0."""
    found: list[tuple[Boxes, float]] = []
    for solid in scene.solids:
        edge = min(scene.casing.corner_radius, 0.25 * min(solid.size))
        half = 0.5 * np.array([solid.size]) - edge
        found.append((Boxes(np.array([solid.position]), np.array([solid.heading]), half), edge))
    return found


def separation(one: Boxes, other: Boxes, wanted: float = np.inf) -> Floats:
    """Return the separations of pairs of boxes [m], (k,), which are negative for overlaps.

    Distances of at least ``wanted`` may be inexact but are never returned as less than ``wanted``.
    """
    away = other.centre - one.centre
    gap = np.full(len(away), -np.inf)
    for box, partner in ((one, other), (other, one)):
        axes = box.axes
        reach = np.abs(axes @ np.swapaxes(partner.axes, 1, 2)) @ partner.half[:, :, None]
        along = np.abs(axes @ away[:, :, None])[..., 0]
        gap = np.maximum(gap, (along - box.half - reach[..., 0]).max(axis=1))
    # If two corners are nearest, their distance is larger than that along any side's normal.
    close = (gap > 0.0) & (gap < wanted)
    if close.any():
        a, b = one.of(close), other.of(close)
        gap[close] = np.minimum(_corner_distance(a, b), _corner_distance(b, a))
    return gap


def squares_apart(places: Floats, headings: Floats, side: float, apart: int = 1) -> float:
    """Return the least separation of two sharp squares of a chain [m], negative if any overlap.

    The separation of a pair is the largest one along an edge's normal. The squares have centres
    (n, 2) [m], headings (n,) [rad] and a side [m]; pairs are at least ``apart`` components apart.
    """
    squares = Boxes(places, headings + TO_FACE, np.full((len(headings), 2), 0.5 * side))
    one, other = np.triu_indices(len(headings), apart)
    return float(separation(squares.of(one), squares.of(other), 0.0).min(initial=np.inf))


def _corner_distance(box: Boxes, partner: Boxes) -> Floats:
    """Return the least distance from a corner of ``partner`` to a box that does not overlap it."""
    seen = (partner.corners - box.centre[:, None]) @ np.swapaxes(box.axes, 1, 2)
    outside = np.maximum(np.abs(seen) - box.half[:, None], 0.0)
    return np.hypot(outside[..., 0], outside[..., 1]).min(axis=1)
