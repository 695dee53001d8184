"""A second, slow simulator: other coordinates of the same physics, and none of the engine's code.

Dense mass matrix; every pole face a fixed row of Gauss nodes; joint stops and squares as stiff
springs with so much damping that nothing bounces; floor friction smoothed below a small speed. One
linearly implicit Euler step a time: of first order, but stiffness costs it nothing. It has no
events, no complementarity problem and no sticking, so it shares no weakness with the engine; its
overlaps (about 1e-3 of the side) and its creep (below ``SLOW``) are its price.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from magfold_env.scene import Scene
from magfold_env.shapes import angles_to_word
from tests.reference.simulation_kernels import run

NODES = 8  # a pole face
NORMALS = np.radians([45.0, 135.0, -135.0, -45.0])


@dataclass(frozen=True)
class Run:
    """How a reference simulation went, in public order."""

    time: np.ndarray
    angles: np.ndarray
    word: str
    speed: float
    """Largest speed of a component at the end [m/s]."""


def casing_nodes(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Nodes of a casing (m, 2) [m] and, for each letter being N, their charges [A m], (4, m)."""
    magnets = scene.magnets
    assert magnets is not None
    assert magnets.even
    strength, width, thickness, inset = (
        float(np.max(value))
        for value in (magnets.charge, magnets.width, magnets.thickness, magnets.inset)
    )
    offsets, shares = np.polynomial.legendre.leggauss(NODES)
    outer = scene.casing.side / 2 - inset
    places, charges = [], []
    for face, angle in enumerate(NORMALS):
        normal = np.array([np.cos(angle), np.sin(angle)])
        along = np.array([-normal[1], normal[0]])
        for distance, sign in ((outer, 1.0), (outer - thickness, -1.0)):
            places.append(distance * normal + np.outer(offsets * width / 2, along))
            charge = np.zeros((4, NODES))
            charge[face] = sign * shares / 2 * strength
            charges.append(charge)
    return np.concatenate(places), np.concatenate(charges, axis=1)


def simulate(scene: Scene, *, step: float = 1e-5, after: float = 0.6, walls: bool = True) -> Run:
    """Simulate a concrete scene with `strips` magnets, to ``after`` seconds beyond the release."""
    forward = scene.mount == "tube" and scene.feed.direction == "forward"
    n = scene.n
    letters = np.array([[1.0 if c == "N" else -1.0 for c in faces] for faces in scene.sequence])
    masses, inertias = scene.masses, scene.inertias
    if forward:  # counted from the held end
        letters = letters[::-1, [2, 3, 0, 1]]
        masses, inertias = masses[::-1].copy(), inertias[::-1].copy()
    tube, tip = scene.mount == "tube", 0.0
    if tube:
        assert scene.start_offsets is not None
        offsets = scene.start_offsets[::-1] if forward else scene.start_offsets
        headings, tip = np.arcsin(np.diff(offsets) / scene.casing.diagonal), offsets[-1]
    else:
        assert scene.start_angles is not None
        headings = np.concatenate([[0.0], np.cumsum(scene.start_angles)])
    if scene.magnets is None:
        nodes, charges, height = np.zeros((1, 2)), np.zeros((n, 1)), 1.0
    else:
        nodes, shares = casing_nodes(scene)
        charges, height = letters @ shares, scene.magnets.height
    speed = scene.speeds[0] if tube else 0.0
    times, angles, left = run(
        np.concatenate([headings, [0.0, tip]]), n if tube else 0, speed, masses, inertias,
        scene.casing.side, nodes, np.ascontiguousarray(charges), height,
        scene.friction * scene.gravity.normal, 0.3826 * scene.casing.side,
        scene.bore / 2 if walls else 1.0, scene.feed.wall, step, after,
    )  # fmt: skip
    if forward:
        angles = angles[:, ::-1] + np.pi
    return Run(times, angles, angles_to_word(np.diff(angles[-1])), left)
