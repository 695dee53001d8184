"""Plain NumPy mechanics of a chain: energies, momenta and equation 39, from positions alone."""

from __future__ import annotations

import numpy as np

from magfold_env.scene import Scene


def motion(scene, angles, rates, base_velocity=(0.0, 0.0)):
    """Centres relative to the outer hinge of component 1, and their velocities, each (n, 2)."""
    angles, rates = np.asarray(angles), np.asarray(rates)
    along = scene.casing.diagonal * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    turning = rates[:, None] * np.stack([-along[:, 1], along[:, 0]], axis=1)
    centres = np.cumsum(along, axis=0) - along / 2
    return centres, np.asarray(base_velocity) + np.cumsum(turning, axis=0) - turning / 2


def kinetic(scene, angles, rates, base_velocity=(0.0, 0.0)):
    """Kinetic energy [J]."""
    _, velocity = motion(scene, angles, rates, base_velocity)
    linear = scene.masses @ (velocity**2).sum(axis=1)
    return 0.5 * float(linear + scene.inertias @ np.asarray(rates) ** 2)


def momentum(scene, angles, rates, base, base_velocity):
    """Linear momentum (2,) and angular momentum about the origin."""
    centres, velocity = motion(scene, angles, rates, base_velocity)
    centres = centres + np.asarray(base)
    spin = scene.inertias @ np.asarray(rates)
    lever = centres[:, 0] * velocity[:, 1] - centres[:, 1] * velocity[:, 0]
    return scene.masses @ velocity, float(spin + scene.masses @ lever)


def potential(scene, angles):
    """Potential energy of in-plane gravity [J], outer hinge of component 1 at the origin."""
    centres, _ = motion(scene, angles, np.zeros(scene.n))
    return -float(scene.masses @ (centres @ np.array(scene.gravity.in_plane)))


def pinned_accelerations(scene: Scene, angles, rates):
    """Equation 39 for a pinned chain under in-plane gravity, solved with a dense matrix."""
    angles, rates = np.asarray(angles), np.asarray(rates)
    n, pitch = scene.n, scene.casing.diagonal
    # Component i's centre is moved by link k < i over its whole length, by its own over half.
    levers = pitch * (np.tril(np.ones((n, n)), -1) + 0.5 * np.eye(n))
    coupling = levers.T @ (scene.masses[:, None] * levers)
    apart = angles[:, None] - angles[None, :]
    mass = coupling * np.cos(apart) + np.diag(scene.inertias)
    gx, gy = scene.gravity.in_plane
    weight = levers.T @ scene.masses
    force = weight * (gy * np.cos(angles) - gx * np.sin(angles))
    return np.linalg.solve(mass, force - (coupling * np.sin(apart)) @ rates**2)


def squares_overlap(centres, angles, side):
    """Largest overlap of any two squares [m], by separating axes; 0 if none do."""
    half = side / np.sqrt(2)
    corners = centres[:, None] + half * np.stack(
        [
            np.stack([np.cos(angles + k * np.pi / 2), np.sin(angles + k * np.pi / 2)], axis=1)
            for k in range(4)
        ],
        axis=1,
    )
    worst = 0.0
    for i in range(len(angles)):
        for j in range(i + 1, len(angles)):
            depth = np.inf
            for turn in (angles[i], angles[j]):
                for axis in (turn + np.pi / 4, turn - np.pi / 4):
                    direction = np.array([np.cos(axis), np.sin(axis)])
                    a, b = corners[i] @ direction, corners[j] @ direction
                    depth = min(depth, a.max() - b.min(), b.max() - a.min())
            worst = max(worst, depth)
    return max(worst, 0.0)
