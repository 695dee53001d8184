"""Kernels of the branch and bound over words that are cut into a near and a far arm.

A state is a word of the near arm and one of the far arm. Its energy is that within the near arm,
that within the far one, and the sum of ``cross`` over one node of each for every component. A word
of the near arm is a field on the far arm's nodes: the sum of its rows of ``cross``. The far words
of least energy in that field alone, their own energy and overlaps among themselves left out, are
found by dynamic programming along the arm; they bound from below what the far arm can gain.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from magfold_env.engine.compile.jit import allocating_kernel
from magfold_env.engine.state import Array, IntArray
from magfold_env.minimiser.arm_kernels import ArmWords
from magfold_env.minimiser.arms import Arm


class Found(NamedTuple):
    """The best states so far, lowest first."""

    energy: Array
    """Energies [J], shape (top,); infinite where there is none yet."""
    near: IntArray
    """Entries of their words of the near arm, shape (top,)."""
    far: IntArray
    """Entries of their words of the far arm, shape (top,)."""


@allocating_kernel
def lowest_in_field(arm: Arm, field: Array, lowest: Array) -> float:
    """Fill the least sum of the field over every node and those that can follow it [J].

    Nodes follow each other as the joints allow, but the walk may overlap with itself. ``field``
    has shape (nodes,), ``lowest`` one entry more. Returns the root's.
    """
    for node in range(arm.end, arm.x.size):
        lowest[node] = field[node]
    lowest[arm.x.size] = np.inf  # what leads nowhere
    for node in range(arm.end - 1, -1, -1):
        a, b, c = arm.following[node, 0], arm.following[node, 1], arm.following[node, 2]
        lowest[node] = field[node] + min(lowest[a], lowest[b], lowest[c])
    return lowest[0]


@allocating_kernel
def least_cross_energy(cross: Array, near: Arm, far: Arm) -> float:
    """Bound the energy between the arms of any state from below [J]."""
    far_lowest, near_lowest = np.empty(far.x.size + 1), np.empty(near.x.size + 1)
    field = np.empty(near.x.size)
    for u in range(near.x.size):
        field[u] = lowest_in_field(far, cross[u], far_lowest)
    return lowest_in_field(near, field, near_lowest)


@allocating_kernel
def bound_prefixes(
    cross: Array, near: Arm, far: Arm, words: ArmWords, begin: int, end: int, bound: Array
) -> None:
    """Fill ``bound`` with what states with each whole word of the near arm have at least [J].

    The energy within the far arm is left out. Entries ``begin`` to ``end`` are filled, those of
    shorter words with infinity.
    """
    last = near.joints[-1]
    field = np.zeros((last + 1, far.x.size))
    lowest = np.empty(far.x.size + 1)
    # The rows that the first entry of this stretch builds on.
    _add_up(cross, words, begin, near, field)
    for entry in range(begin, end):
        joints = int(near.joints[words.node[entry]])
        if entry > begin:
            _add_row(cross[words.node[entry]], field, joints)
        bound[entry] = np.inf
        if joints == last and words.least[entry] < np.inf:
            bound[entry] = words.least[entry] + lowest_in_field(far, field[joints], lowest)


@allocating_kernel
def _add_row(row: Array, field: Array, joints: int) -> None:
    if joints == 0:
        field[0] = row
        return
    for v in range(row.size):
        field[joints, v] = field[joints - 1, v] + row[v]


@allocating_kernel
def _add_up(cross: Array, words: ArmWords, entry: int, near: Arm, field: Array) -> None:
    """Fill the fields of an entry's word and of all that it begins with."""
    joints = near.joints[words.node[entry]]
    path = np.empty(joints + 1, np.int64)
    for k in range(joints, -1, -1):
        path[k] = entry
        entry = words.parent[entry]
    for k in range(joints + 1):
        _add_row(cross[words.node[path[k]]], field, k)


@allocating_kernel
def search_prefixes(
    cross: Array, near: Arm, far: Arm, near_words: ArmWords, far_words: ArmWords,
    entries: IntArray, tolerance: float, found: Found,
) -> int:  # fmt: skip
    """Complete each of some words of the near arm in all ways that could improve ``found``.

    Only states that lie by more than ``tolerance`` [J] below the worst of ``found`` are sought.
    Returns the number of words of the far arm that were looked at, shorter ones included.
    """
    last, visited = far.joints[-1], 0
    field, lowest = np.empty((near.joints[-1] + 1, far.x.size)), np.empty(far.x.size + 1)
    energy = np.zeros(last + 1)
    worst = found.energy.size - 1
    for prefix in entries:
        _add_up(cross, near_words, prefix, near, field)
        here = field[near.joints[near_words.node[prefix]]]
        lowest_in_field(far, here, lowest)
        energy[0] = near_words.least[prefix]
        entry = 1 if last > 0 else 0
        while entry < far_words.node.size:
            visited += 1
            node = far_words.node[entry]
            joints = far.joints[node]
            bound = energy[joints - 1] + lowest[node] + far_words.least[entry]
            if not bound < found.energy[worst] - tolerance:
                entry = far_words.skip[entry]
                continue
            energy[joints] = energy[joints - 1] + here[node]
            if joints == last:
                _insert(found, energy[joints] + far_words.least[entry], prefix, entry)
            entry += 1
    return visited


@allocating_kernel
def _insert(found: Found, energy: float, near: int, far: int) -> None:
    """Put a state in its place; the worst drops out."""
    k = found.energy.size - 1
    while k > 0 and found.energy[k - 1] > energy:
        found.energy[k] = found.energy[k - 1]
        found.near[k], found.far[k] = found.near[k - 1], found.far[k - 1]
        k -= 1
    found.energy[k], found.near[k], found.far[k] = energy, near, far
