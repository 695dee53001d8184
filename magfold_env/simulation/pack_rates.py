"""Typical angular rates of a chain, which set the scale for errors of rates and for times."""

from __future__ import annotations

import math

import numpy as np

from magfold_env.engine.state import Array
from magfold_env.scene import Scene
from magfold_env.simulation.quadrature import widest

SLOWEST = 1.0  # [rad/s]


def typical_rate(scene: Scene, charge: Array, mass: Array) -> Array:
    """Return what the strongest force makes of one component [rad/s].

    Parameters
    ----------
    scene
        Its sizes, gravity and field.
    charge
        Largest of a pole face [A·m], of any shape.
    mass
        Of the component [kg], of the same shape.
    """
    acceleration = np.full(mass.shape, math.hypot(*scene.gravity.in_plane))
    if scene.magnets is not None:
        # Two charges a magnet's width apart: the order of the force between touching faces.
        density = charge / widest(scene.magnets)
        # Beyond the largest number: infinite, not an error.
        with np.errstate(over="ignore"):
            force = 1e-7 * density * density
            if scene.field is not None:
                force = force + charge * _outer_flux_density(scene)
            acceleration += force / mass
    return np.maximum(np.sqrt(acceleration / scene.casing.diagonal), SLOWEST)


def _outer_flux_density(scene: Scene) -> float:
    """Return the order of what acts from outside [T]."""
    assert scene.field is not None
    found = math.hypot(*scene.field.uniform)
    if (magnet := scene.field.magnet) is not None:
        found += 1e-7 * magnet.charge / magnet.width**2
    return found
