"""Exact forces between magnets, in plain NumPy and independent of the engine's kernels.

A pole face is a uniformly charged rectangle, whose field, ∫ r/|r|³ dA, has a closed form: its
components sum an arcsinh, an arcsinh and an arctangent over the corners. The field of one
face is summed over the other face with Gauss-Legendre nodes along both its sides. The engine
instead integrates across the plane in closed form and sums over nodes of both faces. Nearer faces
get more nodes, so that errors approach rounding errors. Faces may differ in size and charge.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from magfold_env.engine.state import Array, IntArray
from magfold_env.scene import Magnets, Scene
from magfold_env.scene.base import MU0

FACE_NORMALS = np.radians([45.0, 135.0, -135.0, -45.0])  # from the heading
FACES = 8  # per casing: four outer faces, then their inner counterparts
COULOMB = MU0 / (4.0 * np.pi)  # [N/A²]

# Distances between faces' centres, relative to their longest side, and the numbers of nodes along
# and across a face from that distance on. In tests, half again as many nodes change no force by
# more than 1e-9 of the flush force.
RULES = ((0.0, 40, 20), (0.95, 20, 10), (1.7, 12, 6), (4.0, 6, 4), (12.0, 4, 2))
CHUNK = 400_000  # points computed at a time


class Faces(NamedTuple):
    """Pole faces, ordered by casing, with `FACES` per casing."""

    centre: Array  # (faces, 2) [m]
    along: Array  # unit vectors along the widths, (faces, 2)
    size: Array  # widths and heights, (faces, 2) [m]
    charge: Array  # (faces,) [A·m]


def faces_of(scene: Scene, places: Array, headings: Array) -> Faces:
    """Return the pole faces of casings with centres ``places`` (n, 2) [m] and headings (n,)."""
    magnets = magnets_of(scene)
    angle = headings[:, None] + FACE_NORMALS
    normal = np.stack([np.cos(angle), np.sin(angle)], axis=2)
    outer = scene.casing.side / 2.0 - magnets.by_face("inset")
    depths = (outer, outer - magnets.by_face("thickness"))
    centre = [places[:, None] + depth[:, None] * normal for depth in depths]
    along = np.stack([-normal[..., 1], normal[..., 0]], axis=2)
    size = np.stack([magnets.by_face("width"), magnets.by_face("height")], axis=1)
    return Faces(
        np.concatenate(centre, axis=1).reshape(-1, 2),
        np.concatenate([along, along], axis=1).reshape(-1, 2),
        np.tile(size, (2 * len(headings), 1)),
        np.concatenate([scene.charges, -scene.charges], axis=1).ravel(),
    )


def magnets_of(scene: Scene) -> Magnets:
    """Return the magnets of a scene, which must have magnets."""
    assert scene.magnets is not None
    return scene.magnets


def forces(scene: Scene, places: Array, headings: Array) -> tuple[Array, Array]:
    """Return the forces (n, 2) [N] on casings and the torques (n,) about their centres [N·m].

    The casings have centres ``places`` (n, 2) [m] and headings (n,) [rad].
    """
    faces, n = faces_of(scene, places, headings), len(headings)
    # Take each pair of faces on different casings once.
    one, other = np.triu_indices(FACES * n, 1)
    wanted = (one // FACES != other // FACES) & (faces.charge[one] * faces.charge[other] != 0.0)
    one, other = one[wanted], other[wanted]
    force, torque = np.zeros((n, 2)), np.zeros(n)
    for pairs, pull, moment in pulls(faces, one, other):
        a, b = one[pairs] // FACES, other[pairs] // FACES
        arm, reach = faces.centre[one[pairs]] - places[a], places[b] - places[a]
        turning = moment + cross(arm, pull)
        for axis in range(2):
            force[:, axis] += np.bincount(a, pull[:, axis], n) - np.bincount(b, pull[:, axis], n)
        torque += np.bincount(a, turning, n)
        # The reaction's torque about a is −turning; the first term refers it to b instead.
        torque += np.bincount(b, cross(reach, pull) - turning, n)
    return force, torque


def flush_force(scene: Scene) -> float:
    """Return the force [N] between opposite pole faces of flush casings, the unit of errors.

    If the four faces differ, the face counts that would attract an opposite copy of itself most
    strongly, with the largest charge that it has in any component.
    """
    insets = magnets_of(scene).by_face("inset").tolist()
    return max(face_force(scene, 2.0 * inset, face) for face, inset in enumerate(insets))


def face_force(scene: Scene, gap: float, face: int = 0) -> float:
    """Return the force [N] between two equal pole faces that lie opposite across a gap [m].

    Both have the largest charge that the face numbered ``face`` has in any component.
    """
    magnets = magnets_of(scene)
    size = np.array([[magnets.by_face("width")[face], magnets.by_face("height")[face]]])
    pull, _ = rectangle_pull(np.array([[0.0, gap]]), np.zeros(1), size, size, *RULES[0][1:])
    charge = magnets.charges(scene.n)[:, face].max()
    return float(COULOMB * charge**2 * pull[0, 1])


def pulls(faces: Faces, one: IntArray, other: IntArray) -> Iterator[tuple[IntArray, Array, Array]]:
    """Yield batches of pairs of faces, with the force and torque on the first face of each pair.

    The forces are (k, 2) [N], and the torques about that face's centre are (k,) [N·m].
    """
    between = faces.centre[one] - faces.centre[other]
    longest = np.maximum(faces.size[one], faces.size[other]).max(axis=1)
    distance = np.hypot(*between.T) / longest
    ends = [*(start for start, _, _ in RULES[1:]), np.inf]
    for (start, count, across), end in zip(RULES, ends, strict=True):
        chosen = np.flatnonzero((distance >= start) & (distance < end))
        for k in range(0, chosen.size, max(CHUNK // (count * across), 1)):
            pairs = chosen[k : k + max(CHUNK // (count * across), 1)]
            i, j = one[pairs], other[pairs]
            u, v = faces.along[j], faces.along[i]
            turn = np.arctan2(cross(u, v), np.sum(u * v, axis=1))
            x, y = np.sum(u * between[pairs], axis=1), cross(u, between[pairs])
            offset = np.stack([x, y], axis=1)
            pull, moment = rectangle_pull(offset, turn, faces.size[i], faces.size[j], count, across)
            # Rotate back from the frame of the other face, in which its width lies along x.
            side = np.stack([-u[:, 1], u[:, 0]], axis=1)
            charges = COULOMB * faces.charge[i] * faces.charge[j]
            yield (
                pairs,
                charges[:, None] * (pull[:, :1] * u + pull[:, 1:] * side),
                charges * moment,
            )


def rectangle_pull(
    offset: Array, turn: Array, size: Array, source: Array, count: int, across: int
) -> tuple[Array, Array]:
    """Return in-plane forces (k, 2) on rectangles, and torques (k,) about their centres.

    The rectangles of a pair have unit charge, and the factor µ0/4π is omitted, so the units are
    1/m² and 1/m. ``offset`` (k, 2) contains the centres [m] relative to the centre of the other
    rectangle, whose width lies along x. ``turn`` (k,) contains the angles from x to the widths
    [rad]; ``size`` and ``source`` (k, 2) contain the widths and heights [m] of these rectangles and
    of the other ones. All centres lie in one plane. There are ``count`` nodes along the width and
    ``across`` nodes over half of the height; the other half is a mirror image.
    """
    node, weight = np.polynomial.legendre.leggauss(count)
    level, share = np.polynomial.legendre.leggauss(across)
    s, z = np.outer(size[:, 0], node) / 2.0, np.outer(size[:, 1], level + 1.0) / 4.0
    weights = np.outer(weight, share) / 4.0
    x = offset[:, :1] + np.cos(turn)[:, None] * s
    y = offset[:, 1:] + np.sin(turn)[:, None] * s
    width, height = source.T[..., None, None]
    field = rectangle_field(x[..., None], y[..., None], z[:, None], width, height)
    pull = np.einsum("dkmn,mn->dkm", np.stack(field), weights) / np.prod(source, axis=1)[:, None]
    moment = np.cos(turn)[:, None] * pull[1] - np.sin(turn)[:, None] * pull[0]
    return pull.sum(axis=2).T, np.sum(moment * s, axis=1)


def rectangle_field(
    x: Array, y: Array, z: Array, width: Array, height: Array
) -> tuple[Array, Array]:
    """Return the in-plane components of ∫ r/|r|³ dA over a rectangle in the plane y = 0.

    The rectangle is |x| ≤ width/2, |z| ≤ height/2. The integral is 4π times the field of a face
    with unit charge per area. The arguments [m] have shapes that broadcast together.
    """
    along, through = 0.0, 0.0
    for i in (-1.0, 1.0):
        for k in (-1.0, 1.0):
            u, w = x - i * width / 2.0, z - k * height / 2.0
            line = u * u + y * y
            r = np.sqrt(line + w * w)
            along = along - i * k * np.arcsinh(w / np.sqrt(line))
            # In the rectangle's plane, outside the rectangle, the arctangents cancel.
            through = through + i * k * np.arctan2(u * w, np.abs(y) * r)
    return np.asarray(along), np.where(y >= 0.0, 1.0, -1.0) * np.asarray(through)


def cross(a: Array, b: Array) -> Array:
    """Return the z components of the cross products of vectors (k, 2)."""
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
