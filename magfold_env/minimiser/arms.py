"""Arms: the two parts of a chain that is cut at a joint; both grow away from the cut.

Both arms begin at the same root: the component before the cut, at the origin, heading along +x. The
near arm contains the root and the components before it, the far arm the components after the cut.

A node is a possible pose of one component, and a state consists of a word of each arm. The energy
of a state is the energy within the near arm, plus that within the far arm, plus the energies
``cross`` of all pairs of a near and a far node. A word of the near arm makes a field on the far
nodes: the sum of its nodes' rows of ``cross``. Dynamic programming along the far arm finds the
least energy in that field: a lower bound of the energy between the arms, as it ignores overlaps.
"""

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from magfold_env.engine.compile.jit import allocating_kernel, inlined
from magfold_env.engine.state import Array, IntArray
from magfold_env.minimiser.couplings import FACES, bilinear, couplings
from magfold_env.minimiser.lattice import HEADINGS, ORDER, TURNS, Ints
from magfold_env.scene import Scene

LETTERS = len(ORDER)
NOWHERE = -1  # no node, while the number of nodes is unknown

Entries = NDArray[np.int32]
"""Array of 32-bit integers, because an arm may have tens of millions of entries."""


class Arm(NamedTuple):
    """The possible poses (nodes) of an arm's components, joint by joint from the root.

    Equal poses of two components are different nodes.
    """

    x: IntArray
    """Cell x and y of each node, shape (nodes,), see `Lattice`; node 0 is the root."""
    y: IntArray
    quarter: IntArray
    """Heading in quarter turns, 0 to 3, shape (nodes,)."""
    joints: IntArray
    """Number of joints between the root and each node, ascending, shape (nodes,)."""
    component: IntArray
    """Component of each node, 0-based, shape (nodes,)."""
    following: IntArray
    """Next node for each letter in the order S, L, R, shape (nodes, 3).

    An index equal to the number of nodes means that there is no next node.
    """
    end: int
    """First node of the component at the arm's end."""


class PairTable(NamedTuple):
    """The couplings of pairs of components of a chain, at any relative pose."""

    coupling: Array
    """Matrices K [J] of `Couplings`, by the pose of the second component relative to the first
    (cell x, cell y, quarter turns)."""
    reach: int
    """Index of cell 0 along x and y."""
    strength: Array
    """Pole charges of all faces in units of `Magnets.charge`, shape (n, 4)."""
    clashes_excluded: bool
    """Whether touching equal poles are excluded."""


@lru_cache(maxsize=8)
def grown(root: int, joints: int, direction: int, letters: str) -> Arm:
    """Return the arm with a root (0-based component), a number of joints and the allowed letters.

    The far arm grows to higher components (``direction`` 1), the near arm to lower ones (-1).
    """
    turns = [direction * int(turn) for turn in TURNS]
    allowed = [letter in letters for letter in ORDER]
    heading = [(direction * int(x), direction * int(y)) for x, y in HEADINGS]
    steps = [[(0, 0, 0)]]
    following: list[list[int]] = []
    begin = 0
    for _ in range(joints):
        begin += len(steps[-1])
        reached: dict[tuple[int, int, int], int] = {}
        for x, y, quarter in steps[-1]:
            ends = [NOWHERE] * LETTERS
            for k in range(LETTERS):
                turned = (quarter + turns[k]) % 4
                cell = (
                    x + heading[quarter][0] + heading[turned][0],
                    y + heading[quarter][1] + heading[turned][1],
                )
                if allowed[k] and cell != (0, 0):
                    ends[k] = begin + reached.setdefault((*cell, turned), len(reached))
            following.append(ends)
        steps.append(list(reached))
    following += [[NOWHERE] * LETTERS] * len(steps[-1])
    leads_to = np.array(following)
    leads_to[leads_to == NOWHERE] = len(following)
    poses: Ints = np.array([pose for step in steps for pose in step], dtype=np.int64)
    count = np.repeat(np.arange(joints + 1), [len(step) for step in steps])
    x, y, quarter = np.ascontiguousarray(poses.T)
    return Arm(x, y, quarter, count, root + direction * count, leads_to, begin)


def pair_table(scene: Scene, strength: Array, *, clashes_excluded: bool) -> PairTable:
    """Return the couplings of a scene's magnets at every possible pose of its chain.

    ``strength`` (n, 4) contains the pole charges of all faces in units of `Magnets.charge`.
    """
    reach = 2 * (scene.n - 1)
    width = 2 * reach + 1
    x, y, quarter = (axis.ravel() for axis in np.indices((width, width, 4)))
    x, y = x - reach, y - reach
    # Every turn changes the parity of the cell's x, its y and the heading together.
    odd = quarter % 2
    taken = (
        (np.abs(x) + np.abs(y) <= reach) & (x % 2 == odd) & (y % 2 == odd) & ((x != 0) | (y != 0))
    )
    poses = np.column_stack([x, y, quarter])[taken]
    coupling = np.zeros((width, width, 4, FACES, FACES))
    coupling[poses[:, 0] + reach, poses[:, 1] + reach, poses[:, 2]] = couplings(scene).at(poses)
    return PairTable(coupling, reach, strength, clashes_excluded)


class ArmWords(NamedTuple):
    """All words of an arm as a tree in depth-first order; entry 0 is the root."""

    node: Entries
    """Last node of each entry, shape (entries,)."""
    parent: Entries
    """Entry of the word without its last letter, shape (entries,)."""
    skip: Entries
    """First later entry whose word does not begin with this entry's word, shape (entries,)."""
    least: Array
    """Least energy within the arm of the complete words that begin with this entry's word [J];
    infinite if there are none."""


@inlined
def _beside(x: int, y: int) -> int:
    """Return the face of a component that points to the neighbouring cell (±1, ±1)."""
    if x > 0:
        return 0 if y > 0 else 3
    return 1 if y > 0 else 2


@inlined
def pair_energy(table: PairTable, one: Any, u: int, other: Any, v: int) -> float:
    """Return the energy of the components at node u of ``one`` arm and node v of the ``other`` [J].

    The energy is infinite if they overlap, or if equal poles touch and the table excludes that.
    ``one`` and ``other`` may be the same, and need only an arm's cells, headings and components.
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
        # Face k is face 0 turned by k quarters; the face that it touches points the other way.
        mine = _beside(x, y)
        if s[mine] * t[(mine + 2 - quarter) % 4] > 0.0:
            return np.inf
    coupling = table.coupling[x + table.reach, y + table.reach, quarter]
    return bilinear(coupling, s, t)


@allocating_kernel
def cross_energies(table: PairTable, near: Arm, far: Arm) -> Array:
    """Return the energies of all pairs of a near and a far node [J], shape (near, far).

    The root is in both arms, so its column is zero.
    """
    out = np.zeros((near.x.size, far.x.size))
    for u in range(near.x.size):
        for v in range(1, far.x.size):
            out[u, v] = pair_energy(table, near, u, far, v)
    return out


@allocating_kernel
def count_entries(arm: Arm, most: int) -> int:
    """Count the words of an arm without overlap, including shorter words; stop at ``most``."""
    last = arm.joints[arm.joints.size - 1]
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
    """Return all words of an arm that do not overlap.

    With ``begin`` 0, energies include the pairs with the root; with 1, they do not. ``entries`` is
    at least the number of words, including shorter words.
    """
    node, parent, skip = (
        np.zeros(entries, np.int32), np.zeros(entries, np.int32), np.zeros(entries, np.int32)
    )  # fmt: skip
    least = np.full(entries, np.inf)
    last = arm.joints[arm.joints.size - 1]
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


class BestStates(NamedTuple):
    """The best states so far, lowest energy first."""

    energy: Array
    """Energies [J], shape (top,); infinite for missing states."""
    near: IntArray
    """Entries of the states' words of the near arm, shape (top,)."""
    far: IntArray
    """Entries of the states' words of the far arm, shape (top,)."""


@allocating_kernel
def lowest_in_field(arm: Arm, field: Array, lowest: Array) -> float:
    """Fill in, for each node, the least sum of the field along a path to the arm's end [J].

    A path follows the joints but may overlap itself. ``field`` has shape (nodes,), and ``lowest``
    has one more entry. The function returns the root's value.
    """
    for node in range(arm.end, arm.x.size):
        lowest[node] = field[node]
    lowest[arm.x.size] = np.inf  # no next node
    for node in range(arm.end - 1, -1, -1):
        a, b, c = arm.following[node, 0], arm.following[node, 1], arm.following[node, 2]
        lowest[node] = field[node] + min(lowest[a], lowest[b], lowest[c])
    return lowest[0]


@allocating_kernel
def bound_prefixes(
    cross: Array, near: Arm, far: Arm, words: ArmWords, begin: int, end: int, bound: Array
) -> None:
    """Fill in, for each word of the near arm, a lower ``bound`` of its states' energies [J].

    The bound omits the energy within the far arm. The function fills the entries from ``begin`` to
    ``end``, excluding ``end``; shorter words have an infinite bound.
    """
    last = near.joints[near.joints.size - 1]
    field = np.zeros((last + 1, far.x.size))
    lowest = np.empty(far.x.size + 1)
    # Fill the rows to which the rows of later entries are added.
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
    """Fill in the fields of an entry's word and of all shorter words with which it begins."""
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
    entries: IntArray, tolerance: float, found: BestStates,
) -> int:  # fmt: skip
    """Complete words of the near arm in all ways that could improve ``found``.

    A state must be more than ``tolerance`` [J] below the worst state of ``found``. The function
    returns the number of words of the far arm that it visited, including shorter words.
    """
    last, visited = far.joints[far.joints.size - 1], 0
    depth = near.joints[near.joints.size - 1] + 1
    field, lowest = np.empty((depth, far.x.size)), np.empty(far.x.size + 1)
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
def _insert(found: BestStates, energy: float, near: int, far: int) -> None:
    """Insert a state in order of energy, and remove the worst state."""
    k = found.energy.size - 1
    while k > 0 and found.energy[k - 1] > energy:
        found.energy[k] = found.energy[k - 1]
        found.near[k], found.far[k] = found.near[k - 1], found.far[k - 1]
        k -= 1
    found.energy[k], found.near[k], found.far[k] = energy, near, far
