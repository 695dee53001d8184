"""Kernels that evaluate arms: pairs of components, and all words of an arm."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from magfold_env.engine.compile.jit import allocating_kernel, inlined
from magfold_env.engine.state import Array
from magfold_env.minimiser.arms import Arm, PairTable

Entries = NDArray[np.int32]
"""Half of the usual size: there are tens of millions."""


class ArmWords(NamedTuple):
    """All words of an arm as a tree in depth-first order, entry 0 the root."""

    node: Entries
    """Node of the arm that each entry ends at, shape (entries,)."""
    parent: Entries
    """Entry without the last letter, shape (entries,)."""
    skip: Entries
    """First entry after those that begin with this one's word, shape (entries,)."""
    least: Array
    """Least energy within the arm of all whole words that begin so [J]; infinite for none."""


@inlined
def _beside(x: int, y: int) -> int:
    """Return which face of a component the neighbouring cell (±1, ±1) lies at."""
    if x > 0:
        return 0 if y > 0 else 3
    return 1 if y > 0 else 2


@inlined
def pair_energy(table: PairTable, one: Arm, u: int, other: Arm, v: int) -> float:
    """Energy of the components at node u of one arm and node v of an arm [J].

    Infinite where they overlap, and where equal poles touch if that is excluded.
    """
    turn = one.quarter[u]
    dx, dy = other.x[v] - one.x[u], other.y[v] - one.y[u]
    if turn == 0:
        x, y = dx, dy
    elif turn == 1:
        x, y = dy, -dx
    elif turn == 2:
        x, y = -dx, -dy
    else:
        x, y = -dy, dx
    if x == 0 and y == 0:
        return np.inf
    quarter = (other.quarter[v] - turn) % 4
    s, t = table.strength[one.component[u]], table.strength[other.component[v]]
    if table.clashes_excluded and abs(x) == 1 and abs(y) == 1:
        # Face k is face 0 turned by k quarters; the one that it touches faces the other way.
        mine = _beside(x, y)
        if s[mine] * t[(mine + 2 - quarter) % 4] > 0.0:
            return np.inf
    coupling = table.coupling[x + table.reach, y + table.reach, quarter]
    total = 0.0
    for a in range(4):
        field = 0.0
        for b in range(4):
            field += coupling[a, b] * t[b]
        total += s[a] * field
    return total


@allocating_kernel
def cross_energies(table: PairTable, near: Arm, far: Arm) -> Array:
    """Energies [J] of all nodes of the near arm with those of the far one, (near, far).

    The far arm's root is the near arm's: its column is zero.
    """
    out = np.zeros((near.x.size, far.x.size))
    for u in range(near.x.size):
        for v in range(1, far.x.size):
            out[u, v] = pair_energy(table, near, u, far, v)
    return out


@allocating_kernel
def count_entries(arm: Arm, most: int) -> int:
    """Count the words of an arm, shorter ones included, that do not overlap; stop at ``most``."""
    last = arm.joints[-1]
    path, tried = np.zeros(last + 1, np.int64), np.zeros(last + 1, np.int64)
    depth, count = 0, 1
    while depth >= 0 and count < most:
        if depth == last or tried[depth] == arm.following.shape[1]:
            depth -= 1
            continue
        node = arm.following[path[depth], tried[depth]]
        tried[depth] += 1
        free = node < arm.x.size
        for k in range(1, depth + 1):
            free = free and not (arm.x[path[k]] == arm.x[node] and arm.y[path[k]] == arm.y[node])
        if free:
            depth += 1
            path[depth], tried[depth] = node, 0
            count += 1
    return count


@allocating_kernel
def arm_words(table: PairTable, arm: Arm, begin: int, entries: int) -> ArmWords:
    """Visit all words of an arm that do not overlap.

    Components count from joint ``begin`` on: 0 has the root's pairs in, 1 leaves them out.
    ``entries`` is at least the number of words, shorter ones included.
    """
    node, parent, skip = (
        np.zeros(entries, np.int32), np.zeros(entries, np.int32), np.zeros(entries, np.int32)
    )  # fmt: skip
    least = np.full(entries, np.inf)
    last = arm.joints[-1]
    entry, tried = np.zeros(last + 1, np.int64), np.zeros(last + 1, np.int64)
    energy = np.zeros(last + 1)
    depth, count = 0, 1
    while depth >= 0:
        here = entry[depth]
        if depth == last:
            least[here] = energy[depth]
        if depth == last or tried[depth] == arm.following.shape[1]:
            skip[here] = count
            if depth > 0:
                above = entry[depth - 1]
                least[above] = min(least[above], least[here])
            depth -= 1
            continue
        end = arm.following[node[here], tried[depth]]
        tried[depth] += 1
        total = energy[depth] if end < arm.x.size else np.inf
        for k in range(begin, depth + 1):
            if total < np.inf:
                total += pair_energy(table, arm, int(node[entry[k]]), arm, int(end))
        if total < np.inf:
            depth += 1
            entry[depth], tried[depth], energy[depth] = count, 0, total
            node[count], parent[count] = end, here
            count += 1
    return ArmWords(node[:count], parent[:count], skip[:count], least[:count])
