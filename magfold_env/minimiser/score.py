"""The paper's Coulomb score: the energy with the pairs inside each component.

A component's own energy is computed once a scene and does not change with its shape, so this is
plain NumPy, with as many nodes as the scene gives, or as are worth it.
"""

from __future__ import annotations

import math

import numpy as np

from magfold_env.minimiser.landscape import Floats
from magfold_env.scene import Magnets, Scene
from magfold_env.scene.parts import MU0

NODES = 32  # along a pole face where the scene gives no number
POINTS = 3  # the paper's, likewise

_NORMALS = np.deg2rad([45.0, 135.0, -135.0, -45.0])  # of the faces, from the heading


def internal_energy(scene: Scene) -> float:
    """Return the energy of all pairs of charges inside each component [J].

    It includes the pairs within one pole face and depends on the sequence, not on the shape:
    added to `mf.energy` it gives the paper's score (equation 6, each pair once).
    """
    magnets = scene.magnets
    if magnets is None:
        return 0.0
    between = _between_faces(magnets, scene.casing.side)
    own = np.tile(_within_faces(magnets), 2)
    poles = np.concatenate([scene.charges, -scene.charges], axis=1)
    pairs = 0.5 * np.einsum("ia,ab,ib->", poles, between, poles) + np.sum(poles**2 * own)
    return float(MU0 / (4.0 * math.pi) * pairs)


def _nodes(magnets: Magnets) -> tuple[Floats, Floats]:
    """Return offsets from a pole face's centre, in widths, and the shares of its charge."""
    if magnets.model == "points":
        count = magnets.nodes or POINTS
        return np.linspace(-0.5, 0.5, count) if count > 1 else np.zeros(1), np.full(
            count, 1.0 / count
        )
    node, weight = np.polynomial.legendre.leggauss(magnets.nodes or NODES)
    return node / 2.0, weight / 2.0


def _between_faces(magnets: Magnets, side: float) -> Floats:
    """Energies of two pole faces of one component for unit charges, without µ0/4π, (8, 8) [1/m].

    The four outer ones come first, then their inner counterparts.
    """
    offset, share = _nodes(magnets)
    outer = side / 2.0 - magnets.by_face("inset")
    depth = np.concatenate([outer, outer - magnets.by_face("thickness")])
    width, height = (np.tile(magnets.by_face(name), 2) for name in ("width", "height"))
    normal = np.exp(1j * np.tile(_NORMALS, 2))  # the plane as complex numbers
    place = depth[:, None] * normal[:, None] + 1j * normal[:, None] * np.outer(width, offset)
    found = np.zeros((depth.size, depth.size))
    for a in range(depth.size):
        for b in range(a):
            rho = np.abs(place[a, :, None] - place[b])
            law = 1.0 / rho if magnets.model == "points" else _lines(rho, height[a], height[b])
            found[a, b] = found[b, a] = share @ law @ share
    return found


def _lines(rho: Floats, one: float, other: float) -> Floats:
    """Return the mean of 1/r between two upright lines [1/m], centred on the plane.

    Parameters
    ----------
    rho
        Their distance [m].
    one, other
        Their heights [m].
    """

    def antiderivative(u: float) -> Floats:
        return u * np.arcsinh(u / rho) - np.sqrt(u * u + rho * rho)

    twice = antiderivative((one + other) / 2.0) - antiderivative((one - other) / 2.0)
    return 2.0 / (one * other) * twice


def _within_faces(magnets: Magnets) -> Floats:
    """Energy of a unit charge on each face's magnet, every pair of its charges once (4,) [1/m]."""
    width, height = magnets.by_face("width"), magnets.by_face("height")
    if magnets.model == "strips":
        pairs = zip(width.tolist(), height.tolist(), strict=True)
        return np.array([_within_rectangle(a, b) for a, b in pairs])
    offset, share = _nodes(magnets)
    k, m = np.triu_indices(offset.size, 1)
    return np.sum(share[k] * share[m] / np.abs(offset[k] - offset[m])) / width


def _within_rectangle(a: float, b: float) -> float:
    """Energy of a unit charge spread evenly over a rectangle of sides a and b [m], in 1/m.

    Half the mean of 1/r over all pairs of points of a rectangle, which is closed.
    """
    integral = (
        2.0 * a * a * b * math.asinh(b / a)
        + 2.0 * a * b * b * math.asinh(a / b)
        + 2.0 / 3.0 * (a**3 + b**3 - math.hypot(a, b) ** 3)
    )
    return 0.5 * integral / (a * b) ** 2
