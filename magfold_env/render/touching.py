"""Where the faces of a chain lie on one another."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from magfold_env.render.canvas import FloatArray
from magfold_env.shapes import centres

_NORMALS = np.deg2rad([45.0, 135.0, -135.0, -45.0])  # of the faces, from the heading
_GAP = 0.02  # sides: faces nearer than this touch
_SLANT = 0.05  # rad: within what a joint counts as folded
_SHARED = 0.1  # sides: shortest stretch that is shown; hinges are points


class Touch(NamedTuple):
    """Two faces on one another."""

    first: tuple[int, int]
    """Component and face of the one, counted from 0."""
    second: tuple[int, int]
    """Component and face of the other."""
    ends: FloatArray
    """Where the stretch begins and ends that they share [m], shape (2, 2)."""


def touches(angles: FloatArray, base: FloatArray, side: float) -> list[Touch]:
    """Return the faces that lie on one another; a corner on a face is none.

    Parameters
    ----------
    angles
        Absolute headings [rad], shape (n,).
    base
        Component 1's outer hinge [m], shape (2,).
    side
        Edge length of a casing [m].
    """
    turns = angles[:, None] + _NORMALS
    normals = np.stack([np.cos(turns), np.sin(turns)], axis=-1)
    middles = centres(angles, side=side, base=base)
    faces = middles[:, None, :] + 0.5 * side * normals
    found: list[Touch] = []
    for i in range(len(angles)):
        for j in range(i + 1, len(angles)):
            if np.hypot(*(middles[j] - middles[i])) > 1.5 * side:
                continue
            opposed = normals[i] @ normals[j].T < -np.cos(_SLANT)
            for a, b in np.argwhere(opposed):
                normal, away = normals[i, a], faces[j, b] - faces[i, a]
                tangent = np.array([-normal[1], normal[0]])
                shift = float(away @ tangent)
                if abs(away @ normal) > _GAP * side or abs(shift) > (1.0 - _SHARED) * side:
                    continue
                reach = np.array([max(shift, 0.0) - side / 2, min(shift, 0.0) + side / 2])
                ends = faces[i, a] + reach[:, None] * tangent
                found.append(Touch((i, int(a)), (j, int(b)), ends))
    return found
