"""What an external field does to casings, exactly: a fixed magnet is two more pole faces."""

from __future__ import annotations

import numpy as np

from magfold_bench.laws import exact_magnets as exact
from magfold_env.engine.state import Array
from magfold_env.scene import FixedMagnet, Scene


def both(one: exact.Faces, other: exact.Faces) -> exact.Faces:
    """Return some faces, then others."""
    return exact.Faces(*map(np.concatenate, zip(one, other, strict=True)))


def faces_of_fixed(magnet: FixedMagnet) -> exact.Faces:
    """Return the two pole faces of a fixed magnet, the north one first."""
    across = np.array([-np.sin(magnet.heading), np.cos(magnet.heading)])
    return exact.Faces(
        magnet.poles,
        np.tile(across, (2, 1)),
        np.tile([magnet.width, magnet.height], (2, 1)),
        np.array([magnet.charge, -magnet.charge]),
    )


def field_forces(scene: Scene, places: Array, headings: Array) -> tuple[Array, Array]:
    """Return what the external field does to casings: forces (n, 2) [N], torques (n,) [N·m].

    Torques are about the centres. An even field pulls a magnet's two poles equally, and so only
    turns it. Parameters are those of `exact_magnets.forces`; without a field all is zero.
    """
    faces, n = exact.faces_of(scene, places, headings), len(headings)
    force, torque = np.zeros((n, 2)), np.zeros(n)
    if scene.field is None:
        return force, torque
    casing = np.arange(exact.FACES * n) // exact.FACES
    arm = faces.centre - places[casing]
    even = faces.charge[:, None] * np.array(scene.field.uniform)
    torque += np.bincount(casing, exact.cross(arm, even), n)
    if scene.field.magnet is not None:
        everything = both(faces, faces_of_fixed(scene.field.magnet))
        one = np.repeat(np.flatnonzero(faces.charge), 2)
        other = exact.FACES * n + np.arange(one.size) % 2
        for pairs, pull, moment in exact.pulls(everything, one, other):
            a = casing[one[pairs]]
            turning = moment + exact.cross(arm[one[pairs]], pull)
            for axis in range(2):
                force[:, axis] += np.bincount(a, pull[:, axis], n)
            torque += np.bincount(a, turning, n)
    return force, torque
