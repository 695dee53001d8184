"""Formulas that compute the engine's parameters from scenes, for one chain or for many.

The functions above `narrowest` accept numbers or arrays. `magfold_env.browser.settings` compiles
them for the laboratory, a web page.
"""

import math
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from magfold_env.scene.base import MU0

Array = npt.NDArray[np.float64]
N = TypeVar("N", float, Array)

# Length c of the friction ellipsoid in sides: the mean distance of a square's points from its
# centre. An evenly pressed square that only spins then has its exact friction torque.
FRICTION_ARM = 0.3826

SLOWEST = 1.0  # [rad/s]


def face_charge(remanence: N, width: N, height: N) -> N:
    """Return the magnetic charge of a uniformly magnetised pole face [A·m]."""
    return remanence * width * height / MU0


def square_inertia(mass: N, side: float) -> N:
    """Return the moment of inertia of a uniform square about its centre [kg m²]."""
    return mass * (side * side) / 6.0


def friction_limit(friction: N, normal: N, mass: N) -> N:
    """Return a component's largest friction force [N]; ``normal`` is normal gravity [m/s²]."""
    return friction * normal * mass


def rectangle(
    x: float, y: float, along: float, across: float, cos: float, sin: float, rounding: float
) -> tuple[float, float, float, float, float, float, float]:
    """Return the row of a rectangle in `Model.obstacles`.

    ``x`` and ``y`` are its centre [m], ``along`` and ``across`` its lengths [m]; ``cos`` and
    ``sin`` give the direction of ``along``. The radius of its corners is ``rounding`` [m], but at
    most a quarter of the shorter length.
    """
    if across > along:
        along, across, cos, sin = across, along, -sin, cos
    radius = min(rounding, 0.25 * across)
    return x, y, cos, sin, 0.5 * along - radius, 0.5 * across - radius, radius


def typical_rate(charge: N, width: float, outer: float, mass: N, x: N, y: N, length: float) -> N:
    """Return a component's typical angular rate under strong forces [rad/s], a scale for errors.

    ``charge`` is the largest charge of a pole face [A·m], ``width`` the largest width [m], and
    ``outer`` the flux density of an external field [T]. The component has ``mass`` [kg] and
    ``length`` from hinge to hinge [m]; ``x`` and ``y`` are the gravity in the plane [m/s²].
    """
    # Two charges one width apart exert about the force of two touching faces.
    density = charge / width
    force = 1e-7 * density * density + charge * outer
    acceleration = np.sqrt(x * x + y * y) + force / mass
    rate: Any = np.maximum(np.sqrt(acceleration / length), SLOWEST)
    return rate


def narrowest(cos: Array, sin: Array) -> tuple[Array, Array]:
    """Turn a chain so that the narrowest strip around its hinges is parallel to +x.

    ``cos`` and ``sin`` (n,) are those of the headings. The function returns the cosines (n,) of
    the new headings, and the offsets (n + 1,) of the hinges to the left of the strip's middle, in
    hinge-to-hinge lengths. One edge of the hinges' convex hull lies on an edge of the strip [1]_.
    The method uses only sums, products and roots, so that all machines return equal bits.

    References
    ----------
    .. [1] H. Freeman and R. Shapira, "Determining the minimum-area encasing rectangle for an
       arbitrary closed curve", Communications of the ACM 18 (1975).
    """
    x, y = (np.concatenate([[0.0], np.cumsum(each)]) for each in (cos, sin))
    corners = _hull(list(zip(x.tolist(), y.tolist(), strict=True)))
    least, best = math.inf, (1.0, 0.0)
    for (x0, y0), (x1, y1) in zip(corners, corners[1:] + corners[:1], strict=True):
        dx, dy = x1 - x0, y1 - y0
        length = math.sqrt(dx * dx + dy * dy)
        c, s = dx / length, dy / length
        width = float(np.ptp(c * y - s * x))
        if width < least:
            least, best = width, (c, s)
    c, s = best
    if c * x[-1] + s * y[-1] < 0.0:
        c, s = -c, -s
    across = c * y - s * x
    middle = 0.5 * (across.min() + across.max())
    return c * cos + s * sin, across - middle


def _hull(points: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Return the corners of the convex hull of two or more points, counter-clockwise.

    The method is A. M. Andrew's monotone chain (Information Processing Letters 9, 1979).
    """
    points = sorted(points)
    hull: list[tuple[float, float]] = []
    for way in (points, points[::-1]):
        first = len(hull)
        for x, y in way:
            while len(hull) >= first + 2:
                (x0, y0), (x1, y1) = hull[-2:]
                if (x1 - x0) * (y - y0) - (y1 - y0) * (x - x0) > 0.0:
                    break
                hull.pop()
            hull.append((x, y))
        hull.pop()
    return hull
