"""Magpylib's `getFT` on the same casings: exact fields on magnets cut into dipoles."""

from __future__ import annotations

import importlib
from collections.abc import Generator
from contextlib import contextmanager
from importlib.util import find_spec
from typing import Any

import numpy as np

from magfold_env.benchmarks.magnets.samples import Loads
from magfold_env.engine.state import Array
from magfold_env.laws import exact_magnets
from magfold_env.scene import Scene

MAGPYLIB = "magpylib"
STEP = 1e-7  # [m] of its finite differences: errors of 1e-8, below those of any mesh
DEGREES = 180.0 / np.pi

Mesh = tuple[int, int, int]
"""Cells of a magnet along its thickness, width and height."""


def installed() -> bool:
    """Whether magpylib is there; the extra ``peers`` brings it."""
    return find_spec("magpylib") is not None


class Peer:
    """Casings as collections of cuboid magnets, each evenly magnetised along its thickness.

    Parameters
    ----------
    scene
        Poles, casings and magnets.
    places : (n, 2) array
        Centres [m].
    headings : (n,) array
        Headings [rad].
    """

    def __init__(self, scene: Scene, places: Array, headings: Array) -> None:
        self._magpylib: Any = importlib.import_module("magpylib")
        rotation: Any = importlib.import_module("scipy.spatial.transform").Rotation
        magnets = exact_magnets.magnets_of(scene)
        width, height, thickness, inset = (
            magnets.by_face(name) for name in ("width", "height", "thickness", "inset")
        )
        depth = scene.casing.side / 2.0 - inset - thickness / 2.0
        remanence = exact_magnets.MU0 * scene.charges / (width * height)
        self._places = np.column_stack([places, np.zeros(len(places))])
        self._casings: list[Any] = []
        for place, heading, strength in zip(places, headings, remanence, strict=True):
            angle = heading + exact_magnets.FACE_NORMALS
            middle = place + depth[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
            cuboids = [
                self._magpylib.magnet.Cuboid(
                    dimension=(thickness[f], width[f], height[f]),
                    polarization=(strength[f], 0.0, 0.0),
                    position=(*middle[f], 0.0),
                    orientation=rotation.from_euler("z", angle[f] * DEGREES, degrees=True),
                )
                for f in np.flatnonzero(strength)  # an empty face has no magnet
            ]
            self._casings.append(self._magpylib.Collection(*cuboids))

    def loads(self, mesh: Mesh) -> Loads:
        """Return forces [N] and torques about the centres [N·m], (1, n) each.

        Every pair of casings is computed once, as the engine does; reactions follow.
        """
        n = len(self._casings)
        force, torque = np.zeros((n, 3)), np.zeros((n, 3))
        present = [i for i, casing in enumerate(self._casings) if casing.children]
        for k, i in enumerate(present[1:], start=1):
            sources = present[:k]
            found = self._magpylib.getFT(
                [self._casings[j] for j in sources],
                self._casings[i],
                pivot=self._places[i],
                eps=STEP,
                squeeze=False,
                meshing=mesh,
            )
            pull, moment = (each[:, 0, 0] for each in found)  # of all sources, (k, 3) each
            force[i] += pull.sum(axis=0)
            torque[i] += moment.sum(axis=0)
            force[sources] -= pull
            torque[sources] -= moment + np.cross(self._places[i] - self._places[sources], pull)
        return Loads(force[None, :, 0], force[None, :, 1], torque[None, :, 2])

    @contextmanager
    def one_thread(self) -> Generator[None]:
        """Keep magpylib to one thread, as the engine is for one chain."""
        defaults = self._magpylib.defaults
        threads = defaults.threads
        defaults.threads = 1
        try:
            yield
        finally:
            defaults.threads = threads
