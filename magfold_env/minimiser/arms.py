"""Arms: the two parts of a chain that is cut at a joint, grown away from the cut.

Both begin at the component before the cut, their root, which lies at the origin and heads along
+x. The far arm holds the components after the cut, the near arm the root and those before it.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from magfold_env.engine.state import Array, IntArray
from magfold_env.minimiser.couplings import couplings
from magfold_env.minimiser.face_pairs import FACES
from magfold_env.minimiser.lattice import HEADINGS, ORDER, TURNS, Ints
from magfold_env.scene import Scene

LETTERS = len(ORDER)
NOWHERE = -1  # as long as the number of nodes is not known


class Arm(NamedTuple):
    """The poses that an arm's components can take, joint by joint from the root.

    A pose of one component and the same pose of another are two nodes.
    """

    x: IntArray
    """Cell of each node, shape (nodes,), see `Lattice`; node 0 is the root."""
    y: IntArray
    quarter: IntArray
    """Heading in quarter turns, 0 to 3, shape (nodes,)."""
    joints: IntArray
    """Number of joints between the root and each node, ascending, shape (nodes,)."""
    component: IntArray
    """Component of each node, 0-based, shape (nodes,)."""
    following: IntArray
    """Node that each letter in the order S, L, R leads to, shape (nodes, 3).

    The number of nodes stands for none.
    """
    end: int
    """First of the nodes of the component at the arm's end."""


class PairTable(NamedTuple):
    """What two components of a chain do to each other at any pose."""

    coupling: Array
    """K [J] by cell x, cell y and quarter turns of the second seen from the first, then faces."""
    reach: int
    """Index of cell 0."""
    strength: Array
    """Signs of all faces, shape (n, 4)."""
    clashes_excluded: bool
    """Whether equal poles must not touch."""


def near_arm(root: int, letters: str) -> Arm:
    """Return the arm of components ``root`` down to 0 (0-based) by the letters allowed."""
    arm = _grown(root, -1, letters)
    return arm._replace(component=root - arm.joints)


def far_arm(root: int, n: int, letters: str) -> Arm:
    """Return the arm of components ``root`` + 1 to n - 1, its root included as node 0."""
    arm = _grown(n - 1 - root, 1, letters)
    return arm._replace(component=root + arm.joints)


@lru_cache(maxsize=8)
def _grown(joints: int, direction: int, letters: str) -> Arm:
    """Grow an arm forwards, to higher components, or with ``direction`` -1 backwards."""
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
    return Arm(x, y, quarter, count, np.zeros_like(count), leads_to, begin)


def pair_table(scene: Scene, strength: Array, *, clashes_excluded: bool) -> PairTable:
    """Return the couplings of a scene's magnets at every pose that its chain can take.

    ``strength`` (n, 4) holds the pole charges of all faces in `Magnets.charge`s.
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
