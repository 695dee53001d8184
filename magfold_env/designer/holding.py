"""Sequences whose target holds: each joint attracted to its letter and repelled by the other.

Where joint k is to be L, the faces that touch when it is L must have opposite poles, and those that
touch when it is R equal ones: no other fully folded word is then without conflict, whatever the
rest. With the target's other contacts, opposite too, these are equations between the signs of two
faces each. They cut the faces into groups within which one sign gives all others.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from magfold_env.minimiser.lattice import from_words
from magfold_env.minimiser.states import touching_faces

Ints = NDArray[np.int64]

_FRONT_LEFT, _BACK_LEFT, _BACK_RIGHT, _FRONT_RIGHT = range(4)
_EQUAL, _OPPOSITE = 1, -1


def holding_groups(target: str) -> tuple[NDArray[np.float64], list[Ints]]:
    """Return signs under which a fully folded target holds, and the groups that may flip.

    Returns
    -------
    signs : (4n,) array
        +1 or −1 a face.
    groups : list of int arrays
        Faces, each in one group: whichever groups are flipped, the target holds.

    Raises
    ------
    ValueError
        If the equations contradict each other. For no word of up to 16 components do they.
    """
    equations = [(a, b, _OPPOSITE) for a, b in touching_faces(from_words([target]))]
    equations += _repelled(target)
    faces = 4 * (len(target) + 1)
    linked: list[list[tuple[int, int]]] = [[] for _ in range(faces)]
    for a, b, relation in equations:
        linked[a].append((b, relation))
        linked[b].append((a, relation))
    signs = np.zeros(faces)
    groups: list[Ints] = []
    for start in range(faces):
        if signs[start] == 0.0:
            signs[start] = 1.0
            groups.append(_spread(start, linked, signs))
    if any(signs[a] * signs[b] != relation for a, b, relation in equations):
        raise ValueError(f"target: {target!r} is not allowed; its contacts contradict each other")
    return signs, groups


def held_signs(target: str, rng: np.random.Generator) -> tuple[NDArray[np.float64], list[Ints]]:
    """Return signs under which a target holds, drawn evenly from all of them, and the groups."""
    signs, groups = holding_groups(target)
    for group in groups:
        signs[group] *= rng.choice([-1.0, 1.0])
    return signs, groups


def _repelled(target: str) -> list[tuple[int, int, int]]:
    """Return the faces that would touch if a joint took the other letter."""
    found: list[tuple[int, int, int]] = []
    for k, letter in enumerate(target):
        front, back = {"L": (_FRONT_RIGHT, _BACK_RIGHT), "R": (_FRONT_LEFT, _BACK_LEFT)}[letter]
        found.append((4 * k + front, 4 * (k + 1) + back, _EQUAL))
    return found


def _spread(start: int, linked: list[list[tuple[int, int]]], signs: NDArray[np.float64]) -> Ints:
    """Fill the signs that follow from that of ``start``, and return their faces."""
    group = [start]
    for face in group:
        for other, relation in linked[face]:
            if signs[other] == 0.0:
                signs[other] = relation * signs[face]
                group.append(other)
    return np.array(sorted(group), dtype=np.int64)
