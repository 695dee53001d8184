"""The magnetic energy of words: a quadratic form in the signs of the faces.

The energy includes only the interaction of the chain's magnets. Scenes with an external field
raise an error, because their energy depends on a fold's position, which a word does not specify.

The paper's Coulomb score also includes the pairs inside each component. Their energy is the same
for all words, and is computed once per scene in plain NumPy. It uses the scene's number of nodes,
or a sufficient number if the scene has none.
"""

import math

import numpy as np

from magfold_env.engine.state import Array
from magfold_env.minimiser.couplings import FACES, couplings
from magfold_env.minimiser.lattice import Lattice
from magfold_env.scene import Magnets, Scene
from magfold_env.scene.base import MU0
from magfold_env.scene.scene import signs
from magfold_env.simulation.quadrature import width_rule

TIE = 1e-9
"""Difference up to which energies count as equal, relative to the energy of two pole charges one
side apart. The energies of symmetric words differ by rounding."""

NODES = 32  # along a pole face if the scene gives no number
POINTS = 3  # the same for `points`, as in the paper

_NORMALS = np.deg2rad([45.0, 135.0, -135.0, -45.0])  # of the faces, from the heading


def strengths(scene: Scene) -> Array:
    """Return the unsigned pole charge of each face in units of `Magnets.charge`, shape (n, 4)."""
    if scene.magnets is None:
        return np.zeros((scene.n, FACES))
    return scene.magnets.charges(scene.n) / scene.magnets.charge


def poles(scene: Scene) -> Array:
    """Return the pole charges in units of `Magnets.charge`, positive for N, shape (n, 4)."""
    return signs(scene.sequence) * strengths(scene)


def refuse_field(scene: Scene) -> None:
    """Raise a ValueError if a scene has an external field."""
    if scene.field is not None and scene.field.any:
        raise ValueError(
            "field: an external field is not allowed; energy minimisation ignores fields, "
            "must be None"
        )


def tie(scene: Scene) -> float:
    """Return the largest difference between equal energies of a scene's words [J]."""
    charge = 0.0 if scene.magnets is None else scene.magnets.charge
    return TIE * (1e-7 * charge**2 / scene.casing.side)


def word_energies(scene: Scene, lattice: Lattice) -> Array:
    """Return the energy of each word with the scene's sequence [J], shape (m,).

    The energies equal those of `mf.energy`: each pair of components counts once, and pairs inside
    a component do not count. An external field raises a ValueError.
    """
    refuse_field(scene)
    table = couplings(scene)
    pole = poles(scene)
    total = np.zeros(len(lattice))
    for i, j, poses in lattice.pairs():
        total += np.einsum("a,mab,b->m", pole[i], table.at(poses), pole[j])
    return total


def quadratic_forms(scene: Scene, lattice: Lattice) -> Array:
    """Return the matrix J [J] of each word, shape (m, 4n, 4n).

    The energy of a word is sᵀ J s for the signs s of all 4n faces. J is symmetric, zero for faces
    of one component, and independent of the sequence. An external field raises a ValueError.
    """
    refuse_field(scene)
    strength = strengths(scene)
    table = couplings(scene)
    n = lattice.n
    form = np.zeros((len(lattice), n, FACES, n, FACES))
    for i, j, poses in lattice.pairs():
        half = 0.5 * strength[i][:, None] * table.at(poses) * strength[j]
        form[:, i, :, j] = half
        form[:, j, :, i] = half.transpose(0, 2, 1)
    return form.reshape(len(lattice), n * FACES, n * FACES)


def internal_energy(scene: Scene) -> float:
    """Return the energy of all pairs of charges inside each component [J].

    It includes the pairs within one pole face. It depends on the sequence but not on the word.
    Its sum with `mf.energy` is the paper's score (equation 6, each pair once).
    """
    magnets = scene.magnets
    if magnets is None:
        return 0.0
    between = _between_faces(magnets, scene.casing.side)
    own = np.tile(_within_faces(magnets), 2)
    poles = np.concatenate([scene.charges, -scene.charges], axis=1)
    pairs = 0.5 * np.einsum("ia,ab,ib->", poles, between, poles) + np.sum(poles**2 * own)
    return float(MU0 / (4.0 * math.pi) * pairs)


def _nodes(magnets: Magnets) -> tuple[Array, Array]:
    """Return the nodes' offsets from a pole face's centre, in widths, and shares of the charge."""
    strips = magnets.model == "strips"
    return width_rule(strips, magnets.nodes or (NODES if strips else POINTS))


def _between_faces(magnets: Magnets, side: float) -> Array:
    """Return the energies of a component's pairs of pole faces, for unit charges, (8, 8) [1/m].

    The factor µ0/4π is omitted. The four outer pole faces are first, then the four inner ones.
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


def _lines(rho: Array, one: float, other: float) -> Array:
    """Return the mean of 1/r [1/m] of two upright lines of given lengths, ``rho`` [m] apart."""

    def antiderivative(u: float) -> Array:
        return u * np.arcsinh(u / rho) - np.sqrt(u * u + rho * rho)

    twice = antiderivative((one + other) / 2.0) - antiderivative((one - other) / 2.0)
    return 2.0 / (one * other) * twice


def _within_faces(magnets: Magnets) -> Array:
    """Return the energy within each face's unit charge, without µ0/4π, shape (4,) [1/m]."""
    width, height = magnets.by_face("width"), magnets.by_face("height")
    if magnets.model == "strips":
        pairs = zip(width.tolist(), height.tolist(), strict=True)
        return np.array([_within_rectangle(a, b) for a, b in pairs])
    offset, share = _nodes(magnets)
    k, m = np.triu_indices(offset.size, 1)
    return np.sum(share[k] * share[m] / np.abs(offset[k] - offset[m])) / width


def _within_rectangle(a: float, b: float) -> float:
    """Return the energy [1/m] of a unit charge spread evenly over a rectangle of sides a, b [m].

    It is half the mean of 1/r over all pairs of points, without µ0/4π.
    """
    integral = (
        2.0 * a * a * b * math.asinh(b / a)
        + 2.0 * a * b * b * math.asinh(a / b)
        + 2.0 / 3.0 * (a**3 + b**3 - math.hypot(a, b) ** 3)
    )
    return 0.5 * integral / (a * b) ** 2
