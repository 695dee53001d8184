"""How deep casings of a chain overlap, and an energy that pushes them apart."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from magfold_env.engine.state import Array

APART = 4
"""Components nearer along the chain cannot overlap while the stops between them hold."""

_CORNERS = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])


class Overlap(NamedTuple):
    """A corner of one casing behind a face of another."""

    first: int
    """The casing with the face, 0-based."""
    second: int
    """The casing with the corner."""
    depth: float
    """How far the corner lies behind the face [m]."""
    normal: Array
    """Of the face, towards the second casing, shape (2,)."""
    corner: Array
    """Where it is [m], shape (2,)."""


def overlaps(centres: Array, headings: Array, side: float) -> list[Overlap]:
    """Return which corners have passed which faces where casings overlap.

    Two squares are apart if a face of one of them separates them. Else the face that comes nearest
    to it is the one to push at, and all corners behind it are to be pushed: squares that lie flush
    press on each other with two.

    Parameters
    ----------
    centres : (n, 2) array
        [m]
    headings : (n,) array
        [rad]
    side
        Edge length [m].
    """
    found: list[Overlap] = []
    away = np.hypot(*(centres[:, None] - centres[None, :]).transpose(2, 0, 1))
    for i, j in np.argwhere(np.triu(away < np.sqrt(2.0) * side, APART)).tolist():
        candidates = [
            _behind_face(a, b, centres, headings, 0.5 * side) for a, b in ((i, j), (j, i))
        ]
        least = min(candidates, key=lambda corners: max(corner.depth for corner in corners))
        if all(any(corner.depth > 0.0 for corner in corners) for corners in candidates):
            found += [corner for corner in least if corner.depth > 0.0]
    return found


def push(found: list[Overlap], stiffness: float, force: Array, moment: Array) -> float:
    """Add the forces [N] that push overlapping casings apart, and their moments [N·m].

    Parameters
    ----------
    found
        The corners to push at.
    stiffness
        Force by depth [N/m].
    force : (n, 2) array
    moment : (n,) array
        About the origin.

    Returns
    -------
    float
        The energy whose gradient they are, half of stiffness times depth² for each corner [J].
    """
    for first, second, depth, normal, corner in found:
        strength = stiffness * depth * normal
        turning = corner[0] * strength[1] - corner[1] * strength[0]
        force[second] += strength
        force[first] -= strength
        moment[second] += turning
        moment[first] -= turning
    return 0.5 * stiffness * sum(overlap.depth**2 for overlap in found)


def _behind_face(a: int, b: int, centres: Array, headings: Array, half: float) -> list[Overlap]:
    """Return how far b's corners lie behind the face of a that comes nearest to separating them."""
    axes, others = _axes(headings[a]), _axes(headings[b])
    along = axes @ (centres[b] - centres[a])
    k = int(np.argmin(half * np.abs(axes @ others.T).sum(axis=1) - np.abs(along)))
    normal = axes[k] if along[k] >= 0.0 else -axes[k]
    corners = centres[b] + half * _CORNERS @ others
    depths = half - (corners - centres[a]) @ normal
    return [
        Overlap(a, b, float(depth), normal, corner)
        for depth, corner in zip(depths, corners, strict=True)
    ]


def _axes(heading: float) -> Array:
    """Return two normals of a casing's faces, one a row."""
    along, across = np.cos(heading + 0.25 * np.pi), np.sin(heading + 0.25 * np.pi)
    return np.array([[along, across], [-across, along]])
