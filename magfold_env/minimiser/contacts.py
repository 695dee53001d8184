"""Which faces of a word touch, and which of them repel."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from magfold_env.minimiser.landscape import signs
from magfold_env.minimiser.lattice import Ints, Lattice

Pairs = tuple[tuple[int, int], ...]

# The cell next to each face, in the frame of the component: front-left, back-left, ...
_BESIDE = ((1, 1), (-1, 1), (-1, -1), (1, -1))


def touching(one: Lattice) -> Pairs:
    """Return the pairs (i, j) of components, 1-based, i < j, that touch in a single word."""
    return tuple((i + 1, j + 1) for i, j, poses in one.pairs() if _face(poses)[0] >= 0)


def touching_faces(one: Lattice) -> Pairs:
    """Return the faces that lie flush in a single word as pairs; face f of component i is 4i + f.

    Components count from 0 here.
    """
    found: list[tuple[int, int]] = []
    for i, j, poses in one.pairs():
        mine, theirs = int(_face(poses)[0]), int(_face(one.poses(j, i))[0])
        if mine >= 0:
            found.append((4 * i + mine, 4 * j + theirs))
    return tuple(found)


def conflicts(one: Lattice, sequence: Sequence[str]) -> Pairs:
    """Return the touching pairs (i, j) of a single word whose touching faces have equal poles."""
    return tuple((i + 1, j + 1) for i, j, clash in _clashes(one, sequence) if clash[0])


def conflict_free(lattice: Lattice, sequence: Sequence[str]) -> NDArray[np.bool_]:
    """Whether no two touching faces of each word have equal poles, shape (m,)."""
    free = np.ones(len(lattice), dtype=np.bool_)
    for _, _, clash in _clashes(lattice, sequence):
        free &= ~clash
    return free


def _clashes(lattice: Lattice, sequence: Sequence[str]) -> list[tuple[int, int, NDArray[np.bool_]]]:
    sign = signs(sequence)
    found: list[tuple[int, int, NDArray[np.bool_]]] = []
    for i, j, poses in lattice.pairs():
        mine, theirs = _face(poses), _face(lattice.poses(j, i))
        # An empty face has sign 0: it is at odds with none.
        found.append((i, j, (mine >= 0) & (sign[i, mine] * sign[j, theirs] > 0.0)))
    return found


def _face(poses: Ints) -> Ints:
    """Return which face of a component lies flush with one at `poses`, -1 for none."""
    face = np.full(len(poses), -1, dtype=np.int64)
    for index, cell in enumerate(_BESIDE):
        face[(poses[:, :2] == cell).all(axis=1)] = index
    return face
