"""Mechanics of a chain in plain NumPy, independent of the engine: energies, momenta, accelerations.

Arrays may have leading axes: headings and rates (..., n), component 1's outer hinge (..., 2).
"""

import numpy as np
import numpy.typing as npt

from magfold_env.scene import Scene
from magfold_env.shapes import centres

Floats = npt.NDArray[np.float64]


def equation_39(
    coupling: Floats, inertia: Floats, angles: Floats, rates: Floats, pull: Floats
) -> Floats:
    """Return a pinned chain's angular accelerations (n,) [rad/s²] by the paper's equation 39.

    ``coupling`` (n, n) contains sums of masses times products of their levers [kg m²]. ``inertia``
    (n, n) has the moments of inertia about the centres on its diagonal [kg m²]. ``pull`` (n,)
    contains generalised forces [N·m].
    """
    apart = angles[:, None] - angles
    forces = pull - (coupling * np.sin(apart)) @ rates**2
    return np.asarray(np.linalg.solve(coupling * np.cos(apart) + inertia, forces), np.float64)


def levers(reach: Floats, length: Floats) -> Floats:
    """Return the levers [m] by which each component's rotation (column) moves each centre (row)."""
    return np.tril(np.broadcast_to(length, (len(reach), len(length))), -1) + np.diag(reach)


def pinned_accelerations(
    scene: Scene,
    angles: Floats,
    rates: Floats,
    force: Floats | float = 0.0,
    torque: Floats | float = 0.0,
) -> Floats:
    """Return a pinned chain's angular accelerations (n,) [rad/s²], solved with a dense matrix.

    ``force`` (n, 2) [N] and ``torque`` (n,) [N·m] act at the centres, in addition to gravity.
    """
    pitch = np.full(scene.n, scene.casing.diagonal)
    arms = levers(pitch / 2.0, pitch)
    coupling = arms.T @ (scene.masses[:, None] * arms)
    pull = arms.T @ (force + scene.masses[:, None] * np.array(scene.gravity.in_plane))
    turning = torque + np.cos(angles) * pull[:, 1] - np.sin(angles) * pull[:, 0]
    return equation_39(coupling, np.diag(scene.inertias), angles, rates, turning)


def centre_velocities(scene: Scene, angles: Floats, rates: Floats, base_velocity: Floats) -> Floats:
    """Return the velocities of the centres [m/s], shape (..., n, 2)."""
    across = np.stack([-np.sin(angles), np.cos(angles)], axis=-1)
    swing = scene.casing.diagonal * rates[..., None] * across
    return base_velocity[..., None, :] + np.cumsum(swing, axis=-2) - 0.5 * swing


def kinetic_energy(scene: Scene, angles: Floats, rates: Floats, base_velocity: Floats) -> Floats:
    """Return the kinetic energy [J], shape (...)."""
    velocity = centre_velocities(scene, angles, rates, base_velocity)
    linear = (velocity**2).sum(axis=-1) @ scene.masses
    return 0.5 * (linear + rates**2 @ scene.inertias)


def weight_energy(scene: Scene, angles: Floats, base: Floats) -> Floats:
    """Return the potential energy of in-plane gravity [J], shape (...); it is 0 at the origin."""
    places = centres(angles, scene.casing.side, base)
    return -(places @ np.array(scene.gravity.in_plane)) @ scene.masses


def momenta(
    scene: Scene, angles: Floats, rates: Floats, base: Floats, base_velocity: Floats
) -> tuple[Floats, Floats]:
    """Return the linear momentum [kg m/s] and the angular momentum about the origin [kg m²/s]."""
    velocity = centre_velocities(scene, angles, rates, base_velocity)
    places = centres(angles, scene.casing.side, base)
    orbital = places[..., 0] * velocity[..., 1] - places[..., 1] * velocity[..., 0]
    linear = np.swapaxes(velocity, -1, -2) @ scene.masses
    return linear, orbital @ scene.masses + rates @ scene.inertias
