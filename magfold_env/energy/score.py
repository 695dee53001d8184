"""The paper's Coulomb score: the energy with the pairs inside each component."""

from __future__ import annotations

import math

import numpy as np

from magfold_env.energy.landscape import signs
from magfold_env.engine.magnet_laws import COULOMB
from magfold_env.engine.near_faces import level_pair
from magfold_env.engine.pack import pack_magnets
from magfold_env.engine.state import Array, Magnets
from magfold_env.engine.workspace import new_nodes
from magfold_env.scene import Scene
from magfold_env.scene_parts import Magnets as MagnetsPart


def internal_energy(scene: Scene) -> float:
    """Return the energy of all pairs of charges inside each component [J].

    It includes the pairs within one pole face and depends on the sequence, not on the shape:
    added to `mf.energy` it gives the paper's score (equation 6, each pair once).
    """
    part = scene.magnets
    if part is None:
        return 0.0
    magnets = pack_magnets(scene)
    between = _between_faces(magnets)
    own = _within_line(magnets) if part.model == "points" else _within_rectangle(part)
    outward = signs(scene.sequence)
    poles = np.concatenate([outward, -outward], axis=1)
    pairs = 0.5 * np.einsum("ia,ab,ib->", poles, between, poles) + poles.size * own
    return float(COULOMB * part.charge**2 * pairs)


def _between_faces(magnets: Magnets) -> Array:
    """Energies of the pole faces of one casing for unit charges, without µ0/4π, shape (8, 8)."""
    finest = magnets.level_radius.size - 1
    faces = [
        (float(x), float(y), float(tx), float(ty))
        for x, y, tx, ty in zip(
            magnets.face_x, magnets.face_y, magnets.face_tx, magnets.face_ty, strict=True
        )
    ]
    found = np.zeros((len(faces), len(faces)))
    nodes = new_nodes(magnets, 1)
    for a, one in enumerate(faces):
        for b, other in enumerate(faces[:a]):
            energy = level_pair(magnets, finest, *one, *other, True, nodes)[0]
            found[a, b] = found[b, a] = energy
    return found


def _within_line(magnets: Magnets) -> float:
    """Energy of the unit charge of one row of points, each pair of points once [1/m]."""
    count = magnets.level_count[0]
    x, y, share = (
        nodes[0, :count] for nodes in (magnets.node_x, magnets.node_y, magnets.node_weight)
    )
    k, m = np.triu_indices(count, 1)
    return float(np.sum(share[k] * share[m] / np.hypot(x[k] - x[m], y[k] - y[m])))


def _within_rectangle(magnets: MagnetsPart) -> float:
    """Energy of a unit charge spread evenly over the pole face [1/m].

    Half the mean of 1/r over all pairs of points of a rectangle, which is closed.
    """
    a, b = magnets.width, magnets.height
    integral = (
        2.0 * a * a * b * math.asinh(b / a)
        + 2.0 * a * b * b * math.asinh(a / b)
        + 2.0 / 3.0 * (a**3 + b**3 - math.hypot(a, b) ** 3)
    )
    return 0.5 * integral / (a * b) ** 2
