"""Words as arrays: all casings of a word are on a lattice, so their poses are integers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]

ORDER = "SLR"  # ties between words are broken in this order
TURNS = np.array([0, 1, -1])  # quarter turns of S, L, R
HEADINGS = np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])  # unit vectors by quarter turns


@dataclass(frozen=True, eq=False)
class Lattice:
    """Words of equal length and the poses of their components."""

    letters: Ints
    """Indices into ``ORDER``, shape (m, n-1)."""
    cells: Ints
    """Centres in units of side/√2, shape (m, n, 2); component 1's centre is the origin."""
    quarters: Ints
    """Headings in quarter turns, 0 to 3, shape (m, n); component 1's heading is 0."""

    @property
    def n(self) -> int:
        """Number of components of a word."""
        return self.quarters.shape[1]

    def __len__(self) -> int:
        """Return the number of words."""
        return len(self.letters)

    def __getitem__(self, rows: slice | NDArray[np.bool_]) -> Lattice:
        """Return the words at the given rows."""
        return Lattice(self.letters[rows], self.cells[rows], self.quarters[rows])

    def word(self, row: int) -> str:
        """Return one word as a string."""
        return "".join(ORDER[letter] for letter in self.letters[row])

    @property
    def words(self) -> tuple[str, ...]:
        """All words as strings."""
        return tuple(self.word(row) for row in range(len(self)))

    def extended(self) -> Lattice:
        """Return the words that result from appending S, L and R, without words that overlap.

        Two casings overlap only if their centres coincide. For two centres, ``|dx| + |dy|`` is
        even, and casings for which it is 2 touch without overlap.
        """
        m = len(self)
        letter = np.tile(np.arange(3), m)
        last = np.repeat(self.quarters[:, -1], 3)
        quarter = (last + TURNS[letter]) % 4
        cells = np.repeat(self.cells, 3, axis=0)
        cell = cells[:, -1] + HEADINGS[last] + HEADINGS[quarter]
        free = ~(cells == cell[:, None]).all(axis=2).any(axis=1)
        letters = np.column_stack([np.repeat(self.letters, 3, axis=0), letter])
        quarters = np.column_stack([np.repeat(self.quarters, 3, axis=0), quarter])
        return Lattice(letters, np.concatenate([cells, cell[:, None]], axis=1), quarters)[free]

    def fully_folded(self) -> NDArray[np.bool_]:
        """Return whether each word contains only L and R, shape (m,)."""
        return (self.letters != ORDER.index("S")).all(axis=1)

    def poses(self, i: int, j: int) -> Ints:
        """Return component j's pose relative to i, shape (m, 3): cell x, cell y, quarter turns."""
        turn = -self.quarters[:, i] % 4
        cos, sin = HEADINGS[turn].T
        x, y = (self.cells[:, j] - self.cells[:, i]).T
        quarter = (self.quarters[:, j] + turn) % 4
        return np.column_stack([cos * x - sin * y, sin * x + cos * y, quarter])

    def pairs(self) -> Iterator[tuple[int, int, Ints]]:
        """Yield each pair of components i < j with the poses of j relative to i."""
        for i, j in combinations(range(self.n), 2):
            yield i, j, self.poses(i, j)


def from_words(words: Sequence[str]) -> Lattice:
    """Return words of equal length as arrays; the words may overlap."""
    letters = np.array([[ORDER.index(c) for c in word] for word in words], dtype=np.int64)
    quarters = np.zeros((len(words), letters.shape[1] + 1), dtype=np.int64)
    quarters[:, 1:] = np.cumsum(TURNS[letters], axis=1) % 4
    heading = HEADINGS[quarters]
    cells = np.zeros_like(heading)
    cells[:, 1:] = np.cumsum(heading[:, :-1] + heading[:, 1:], axis=1)
    return Lattice(letters, cells, quarters)


def all_words(n: int) -> Lattice:
    """Return all words of n components that do not overlap, sorted in the order S, L, R."""
    found = from_words([""])
    for _ in range(n - 1):
        found = found.extended()
    return found
