"""From the values of a scene to the numbers of kernels: rules for one chain and for many.

All functions take numbers or arrays; `magfold_env.browser.settings` compiles them for a page.
"""

from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from magfold_env.scene.base import MU0

N = TypeVar("N", float, npt.NDArray[np.float64])

# c of the friction ellipsoid, as a share of the side: mean distance of a square's points from
# its centre, so that pure spin of an evenly pressed square feels its exact friction torque.
FRICTION_ARM = 0.3826

SLOWEST = 1.0  # [rad/s]


def face_charge(remanence: N, width: N, height: N) -> N:
    """Return the magnetic charge of a uniformly magnetised pole face [A·m]."""
    return remanence * width * height / MU0


def square_inertia(mass: N, side: float) -> N:
    """Return the moment of inertia of a uniform square about its centre [kg m²]."""
    return mass * (side * side) / 6.0


def friction_limit(friction: N, normal: N, mass: N) -> N:
    """Return the largest friction force of a component [N]; ``normal`` is gravity [m/s²]."""
    return friction * normal * mass


def rectangle(
    x: float, y: float, along: float, across: float, cos: float, sin: float, rounding: float
) -> tuple[float, float, float, float, float, float, float]:
    """Return the row of a rectangle in `Model.obstacles`.

    The arguments are its centre, its lengths [m] and the direction of the first. Its edges are
    rounded like the casings', up to its size.
    """
    if across > along:
        along, across, cos, sin = across, along, -sin, cos
    radius = min(rounding, 0.25 * across)
    return x, y, cos, sin, 0.5 * along - radius, 0.5 * across - radius, radius


def typical_rate(charge: N, width: float, outer: float, mass: N, x: N, y: N, length: float) -> N:
    """Return the rate that the strongest force gives a component, the scale of errors [rad/s].

    ``charge`` is the largest charge of a pole face [A·m], ``width`` the largest width [m], and
    ``outer`` the flux density of an external field [T]. ``mass`` [kg] and ``length`` from hinge to
    hinge [m] are those of the component, and x and y the gravity in the plane [m/s²].
    """
    # Two charges one magnet width apart: the order of the force between touching faces.
    density = charge / width
    force = 1e-7 * density * density + charge * outer
    acceleration = np.sqrt(x * x + y * y) + force / mass
    rate: Any = np.maximum(np.sqrt(acceleration / length), SLOWEST)
    return rate
