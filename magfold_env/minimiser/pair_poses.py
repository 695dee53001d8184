"""The pairs of components in many words, each pose of a pair once."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from magfold_env.engine.compile.jit import allocating_kernel
from magfold_env.engine.state import Array, IntArray
from magfold_env.minimiser.lattice import Ints, Lattice


class PairPoses(NamedTuple):
    """Which poses the pairs of components take.

    Of one pair every pose is listed once, so that words share what has to be found for it.
    """

    first: IntArray
    """The pair's first component for each pose, 0-based, shape (poses,)."""
    second: IntArray
    """Its second component, shape (poses,)."""
    pose: IntArray
    """Second seen from first, shape (poses, 3), see `Lattice.poses`."""
    row: NDArray[np.int32]
    """Which pose each pair has in each word, shape (pairs, words)."""


def pair_poses(lattice: Lattice) -> PairPoses:
    """Return the poses of all pairs of components in some words."""
    first: list[Ints] = []
    second: list[Ints] = []
    found: list[Ints] = [np.zeros((0, 3), dtype=np.int64)]
    index = np.zeros((lattice.n * (lattice.n - 1) // 2, len(lattice)), dtype=np.int32)
    count = 0
    for pair, (i, j, poses) in enumerate(lattice.pairs()):
        span = 2 * lattice.n
        codes = ((poses[:, 0] + span) * 2 * span + poses[:, 1] + span) * 4 + poses[:, 2]
        _, rows, inverse = np.unique(codes, return_index=True, return_inverse=True)
        index[pair] = count + inverse
        count += len(rows)
        first.append(np.full(len(rows), i))
        second.append(np.full(len(rows), j))
        found.append(poses[rows])
    none = np.zeros(0, dtype=np.int64)
    return PairPoses(
        np.concatenate([none, *first]),
        np.concatenate([none, *second]),
        np.concatenate(found),
        index,
    )


@allocating_kernel
def sum_over_pairs(coupling: Array, poses: PairPoses, strength: Array, out: Array) -> None:
    """Fill the sums over pairs of a bilinear quantity for many sequences and words.

    ``coupling`` (poses, 4, 4) is its matrix at every pose, ``strength`` (sequences, n, 4) holds the
    signs of the faces, ``out`` has shape (sequences, words).
    """
    value = np.empty(coupling.shape[0])
    for k in range(out.shape[0]):
        evaluate(coupling, poses.first, poses.second, strength[k], value)
        total = out[k]
        total[:] = 0.0
        for pair in range(poses.row.shape[0]):
            row = poses.row[pair]
            for w in range(total.size):
                total[w] += value[row[w]]


@allocating_kernel
def evaluate(
    coupling: Array, first: IntArray, second: IntArray, strength: Array, value: Array
) -> None:
    """Fill the quantity at every pose (poses,) for the signs (n, 4) of one sequence."""
    for p in range(value.size):
        s, t, matrix = strength[first[p]], strength[second[p]], coupling[p]
        total = 0.0
        for a in range(4):
            field = 0.0
            for b in range(4):
                field += matrix[a, b] * t[b]
            total += s[a] * field
        value[p] = total
