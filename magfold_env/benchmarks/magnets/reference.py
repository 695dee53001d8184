"""Exact forces between magnets, in plain NumPy and independent of the engine's kernels.

A pole face is an evenly charged rectangle whose field is closed: with r the vector from a corner,
the components of ∫ r/|r|³ dA are an arcsinh, an arcsinh and an arctangent a corner. The field of
one face is summed over the other with Gauss-Legendre nodes along both its sides; unlike the
engine, which has the integral out of the plane closed and sums over nodes of both faces. Nodes are
as many as rounding is worth: more for faces that are near.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from magfold_env.engine.state import Array, IntArray
from magfold_env.scene import Scene
from magfold_env.scene_parts import MU0, Magnets

FACE_NORMALS = np.radians([45.0, 135.0, -135.0, -45.0])  # from the heading
FACES = 8  # of a casing: four outer ones, then their inner counterparts

# Distances of faces' centres in widths of a face, and nodes along and across a face beyond them;
# tests see no change above 1e-9 of the flush force when there are half again as many.
RULES = ((0.0, 40, 20), (0.95, 20, 10), (1.7, 12, 6), (4.0, 6, 4), (12.0, 4, 2))
CHUNK = 400_000  # points at a time


@dataclass(frozen=True, eq=False)
class Faces:
    """All pole faces of some casings, casing by casing; arrays have shape (8·casings,)."""

    centre: Array
    """(faces, 2) [m]"""
    along: Array
    """Unit vectors along the widths, (faces, 2)."""
    charge: Array
    """[A·m]"""


def faces_of(scene: Scene, places: Array, headings: Array) -> Faces:
    """Return the pole faces of casings with centres ``places`` (n, 2) [m] and headings (n,).

    Raises
    ------
    ValueError
        If the scene has no magnets.
    """
    magnets = magnets_of(scene)
    angle = headings[:, None] + FACE_NORMALS
    normal = np.stack([np.cos(angle), np.sin(angle)], axis=2)
    outer = scene.casing.side / 2.0 - magnets.inset
    centre = [places[:, None] + depth * normal for depth in (outer, outer - magnets.thickness)]
    along = np.stack([-normal[..., 1], normal[..., 0]], axis=2)
    pole = magnets.charge * np.array(
        [[1.0 if f == "N" else -1.0 for f in w] for w in scene.sequence]
    )
    return Faces(
        np.concatenate(centre, axis=1).reshape(-1, 2),
        np.concatenate([along, along], axis=1).reshape(-1, 2),
        np.concatenate([pole, -pole], axis=1).ravel(),
    )


def magnets_of(scene: Scene) -> Magnets:
    """Return the magnets of a scene.

    Raises
    ------
    ValueError
        If it has none.
    """
    if scene.magnets is None:
        raise ValueError("magnets: the scene has none")
    return scene.magnets


def forces(scene: Scene, places: Array, headings: Array) -> tuple[Array, Array]:
    """Return the forces (n, 2) [N] on casings and the torques (n,) about their centres [N·m].

    Parameters
    ----------
    scene
        Poles, casings and magnets; where the casings are does not follow from it.
    places : (n, 2) array
        Centres [m].
    headings : (n,) array
        Headings [rad].
    """
    faces = faces_of(scene, places, headings)
    magnets, n = magnets_of(scene), len(headings)
    # The halves of all pairs of faces of different casings.
    one, other = np.triu_indices(FACES * n, 1)
    apart = one // FACES != other // FACES
    one, other = one[apart], other[apart]
    force, torque = np.zeros((n, 2)), np.zeros(n)
    for pairs, unit_pull, unit_moment in _pulls(faces, magnets, one, other):
        a, b = one[pairs] // FACES, other[pairs] // FACES
        size = MU0 / (4.0 * np.pi) * faces.charge[one[pairs]] * faces.charge[other[pairs]]
        pull, moment = size[:, None] * unit_pull, size * unit_moment
        arm, reach = faces.centre[one[pairs]] - places[a], places[b] - places[a]
        turning = moment + _cross(arm, pull)
        for axis in range(2):
            force[:, axis] += np.bincount(a, pull[:, axis], n) - np.bincount(b, pull[:, axis], n)
        torque += np.bincount(a, turning, n)
        # Forces act along lines: the reaction's torque about b is what balances the moments.
        torque += np.bincount(b, _cross(reach, pull) - turning, n)
    return force, torque


def flush_force(scene: Scene) -> float:
    """Force [N] between two opposite pole faces of casings that lie flush: the unit of errors."""
    return face_force(scene, 2.0 * magnets_of(scene).inset)


def face_force(scene: Scene, gap: float) -> float:
    """Force [N] between two equal pole faces that look at each other across a gap [m]."""
    magnets = magnets_of(scene)
    pull, _ = rectangle_pull(np.array([[0.0, gap]]), np.zeros(1), magnets, *RULES[0][1:])
    return float(MU0 / (4.0 * np.pi) * magnets.charge**2 * pull[0, 1])


def _pulls(
    faces: Faces, magnets: Magnets, one: IntArray, other: IntArray
) -> Iterator[tuple[IntArray, Array, Array]]:
    """Yield some of the pairs of faces at a time, and what the first of each feels.

    That is the force (k, 2) and the torque about the face's centre (k,), for unit charges and
    without µ0/4π.
    """
    between = faces.centre[one] - faces.centre[other]
    distance = np.hypot(*between.T) / magnets.width
    ends = [*(start for start, _, _ in RULES[1:]), np.inf]
    for (start, count, across), end in zip(RULES, ends, strict=True):
        chosen = np.flatnonzero((distance >= start) & (distance < end))
        for k in range(0, chosen.size, max(CHUNK // (count * across), 1)):
            pairs = chosen[k : k + max(CHUNK // (count * across), 1)]
            u, v = faces.along[other[pairs]], faces.along[one[pairs]]
            turn = np.arctan2(_cross(u, v), np.sum(u * v, axis=1))
            x, y = np.sum(u * between[pairs], axis=1), _cross(u, between[pairs])
            pull, moment = rectangle_pull(np.stack([x, y], axis=1), turn, magnets, count, across)
            # Back from the frame of the other face, whose width lies along its x.
            side = np.stack([-u[:, 1], u[:, 0]], axis=1)
            yield pairs, pull[:, :1] * u + pull[:, 1:] * side, moment


def rectangle_pull(
    offset: Array, turn: Array, magnets: Magnets, count: int, across: int
) -> tuple[Array, Array]:
    """In-plane forces (k, 2) on rectangles and torques (k,) about their centres.

    Both faces have unit charge; without µ0/4π [1/m², 1/m].

    Parameters
    ----------
    offset : (k, 2) array
        Centres [m] seen from the centre of another rectangle, whose width lies along x.
    turn : (k,) array
        Angles from x to their widths [rad].
    magnets
        Width and height of all of them; they stand on one plane.
    count, across
        Nodes along the width, and over the upper half of the height: the lower is its mirror image.
    """
    node, weight = np.polynomial.legendre.leggauss(count)
    level, share = np.polynomial.legendre.leggauss(across)
    s, z = node * magnets.width / 2.0, (level + 1.0) * magnets.height / 4.0
    weights = np.outer(weight, share) / 4.0
    x = offset[:, 0, None] + np.cos(turn)[:, None] * s
    y = offset[:, 1, None] + np.sin(turn)[:, None] * s
    field = np.stack(rectangle_field(x[..., None], y[..., None], z, magnets))
    pull = np.einsum("dkmn,mn->dkm", field, weights) / (magnets.width * magnets.height)
    moment = np.cos(turn)[:, None] * pull[1] - np.sin(turn)[:, None] * pull[0]
    return pull.sum(axis=2).T, moment @ s


def rectangle_field(x: Array, y: Array, z: Array, magnets: Magnets) -> tuple[Array, Array]:
    """In-plane components of ∫ r/|r|³ dA over the rectangle |x| ≤ width/2, |z| ≤ height/2, y = 0.

    That is the field of a face of one unit of charge an area, times 4π.
    """
    along, through = 0.0, 0.0
    for i in (-1.0, 1.0):
        for k in (-1.0, 1.0):
            u, w = x - i * magnets.width / 2.0, z - k * magnets.height / 2.0
            line = u * u + y * y
            r = np.sqrt(line + w * w)
            along = along - i * k * np.arcsinh(w / np.sqrt(line))
            # In the rectangle's own plane, beside it, the angles cancel.
            through = through + i * k * np.arctan2(u * w, np.abs(y) * r)
    return np.asarray(along), np.sign(y) * np.asarray(through)


def _cross(a: Array, b: Array) -> Array:
    """Z components of products of vectors (k, 2)."""
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
