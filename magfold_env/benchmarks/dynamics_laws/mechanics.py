"""Plain NumPy mechanics of a chain, independent of the engine: energies, momenta, mass matrix."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from magfold_env.scene import Scene

Floats = npt.NDArray[np.float64]


def levers(scene: Scene) -> Floats:
    """How far each link's turning carries each centre [m], shape (n, n).

    Component i's centre is moved by links k < i over their whole lengths, by its own over half.
    """
    n = scene.n
    return scene.casing.diagonal * (np.tril(np.ones((n, n)), -1) + 0.5 * np.eye(n))


def centre_jacobian(scene: Scene, angles: Floats) -> Floats:
    """Velocities of the centres for unit rates and unit velocities of the base.

    The base is the outer hinge of component 1.

    Returns
    -------
    (2, n, n + 2) array
        Axis, component, coordinate.
    """
    n, arm = scene.n, levers(scene)
    jacobian = np.zeros((2, n, n + 2))
    jacobian[0, :, :n] = -arm * np.sin(angles)
    jacobian[1, :, :n] = arm * np.cos(angles)
    jacobian[0, :, n] = jacobian[1, :, n + 1] = 1.0
    return jacobian


def mass_matrix(scene: Scene, angles: Floats) -> Floats:
    """Mass matrix of the headings and the base, shape (n + 2, n + 2)."""
    jacobian = centre_jacobian(scene, angles)
    spin = np.diag(np.append(scene.inertias, [0.0, 0.0]))
    return np.einsum("aik,i,ail->kl", jacobian, scene.masses, jacobian) + spin


def kinetic_energy(scene: Scene, angles: Floats, rates: Floats, base_velocity: Floats) -> float:
    """Kinetic energy [J]."""
    v = np.append(rates, base_velocity)
    return 0.5 * float(v @ mass_matrix(scene, angles) @ v)


def momenta(
    scene: Scene, angles: Floats, rates: Floats, base: Floats, base_velocity: Floats
) -> tuple[Floats, float]:
    """Linear momentum (2,) [kg m/s] and angular momentum about the origin [kg m²/s]."""
    velocity = centre_jacobian(scene, angles) @ np.append(rates, base_velocity)
    x, y = base[:, None] + np.stack([np.cos(angles), np.sin(angles)]) @ levers(scene).T
    orbital = scene.masses @ (x * velocity[1] - y * velocity[0])
    return velocity @ scene.masses, float(scene.inertias @ rates + orbital)
