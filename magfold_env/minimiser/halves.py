"""The search behind `ground_state`: the two halves of a chain, and how they are put together."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Final

import numpy as np

from magfold_env.engine.state import Array
from magfold_env.minimiser.arm_kernels import ArmWords, arm_words, count_entries, cross_energies
from magfold_env.minimiser.arm_search import (
    Found,
    bound_prefixes,
    least_cross_energy,
    search_prefixes,
)
from magfold_env.minimiser.arms import Arm, far_arm, near_arm, pair_table
from magfold_env.minimiser.landscape import poles
from magfold_env.minimiser.lattice import ORDER, Ints
from magfold_env.scene import Scene

MOST_ENTRIES: Final = 40_000_000
"""Most words of half a chain, shorter ones included: 20 bytes each."""

_FIRST = 100  # words of the near arm that are completed where there is no time to order them
_STRETCH = 20_000  # entries bounded, and
_BATCH = 50  # words completed, between two looks at the clock

Progress = Callable[[float], None]


class Limit:
    """When to stop: after some seconds or nodes, None for never."""

    def __init__(self, seconds: float | None, nodes: int | None) -> None:
        self._end = math.inf if seconds is None else time.monotonic() + seconds
        self._nodes = math.inf if nodes is None else nodes

    def reached(self, nodes: int) -> bool:
        """Whether this is the time, so many nodes having been visited."""
        return nodes >= self._nodes or time.monotonic() >= self._end


class Halves:
    """A chain cut in the middle, and the best states found of it.

    Parameters
    ----------
    scene
        A chain of at least two components.
    letters
        Those that words may have.
    stable
        Whether equal poles must not touch.
    top
        How many states to find.
    tolerance
        States are sought that lie by more than this below the worst one found [J].

    Attributes
    ----------
    nodes : int
        Words of half the chain, shorter ones included, that were bounded or completed.
    """

    def __init__(
        self, scene: Scene, letters: str, *, stable: bool, top: int, tolerance: float
    ) -> None:
        root = scene.n // 2 - 1
        self._near, self._far = near_arm(root, letters), far_arm(root, scene.n, letters)
        near_count, far_count = (_counted(scene.n, arm) for arm in (self._near, self._far))
        table = pair_table(scene, poles(scene), clashes_excluded=stable)
        self._near_words = arm_words(table, self._near, 0, near_count)
        self._far_words = arm_words(table, self._far, 1, far_count)
        self._cross = cross_energies(table, self._near, self._far)
        self._tolerance = tolerance
        nothing = np.full(top, -1, dtype=np.int64)
        self._found = Found(np.full(top, np.inf), nothing, nothing.copy())
        self.nodes = 0

    def search(self, limit: Limit, progress: Progress) -> float:
        """Find the best states.

        Returns
        -------
        float
            What all states that were not found have at least [J]; infinite if nothing that is
            better than the worst one found was left out.
        """
        whole = self._near.joints[self._near_words.node] == self._near.joints[-1]
        prefixes: Ints = np.flatnonzero(whole & np.isfinite(self._near_words.least))
        far_least = float(self._far_words.least[0])
        if not prefixes.size or not math.isfinite(far_least):
            return math.inf
        bound = self._bounds(limit, progress)
        if bound is None:
            own = self._near_words.least[prefixes]
            self._complete(prefixes[np.argsort(own, kind="stable")[:_FIRST]])
            crossing = least_cross_energy(self._cross, self._near, self._far)
            return float(own.min()) + far_least + crossing
        bound = bound[prefixes] + far_least
        order = np.argsort(bound, kind="stable")
        return self._best_first(prefixes[order], bound[order], limit, progress)

    def words(self) -> list[str]:
        """Return the words found, lowest energy first."""
        found = self._found
        return [
            _letters(self._near, self._near_words, int(near))[::-1]
            + _letters(self._far, self._far_words, int(far))
            for energy, near, far in zip(*found, strict=True)
            if energy < np.inf
        ]

    def _bounds(self, limit: Limit, progress: Progress) -> Array | None:
        """Bound every word of the near arm [J], the far arm's own energy left out."""
        bound = np.empty(self._near_words.node.size)
        for begin in range(0, bound.size, _STRETCH):
            if limit.reached(self.nodes):
                return None
            end = min(begin + _STRETCH, bound.size)
            bound_prefixes(self._cross, self._near, self._far, self._near_words, begin, end, bound)
            self.nodes += end - begin
            progress(0.5 * end / bound.size)
        return bound

    def _best_first(self, prefixes: Ints, bound: Array, limit: Limit, progress: Progress) -> float:
        """Complete words of the near arm, ordered by their bounds, until none can improve."""
        begin = 0
        while True:
            worst = float(self._found.energy[-1]) - self._tolerance
            needed = int(np.searchsorted(bound, worst))
            if begin >= needed:
                progress(1.0)
                return math.inf
            if begin > 0 and limit.reached(self.nodes):
                return float(bound[begin])
            end = min(begin + _BATCH, needed)
            self._complete(prefixes[begin:end])
            begin = end
            progress(0.5 + 0.5 * begin / needed)

    def _complete(self, prefixes: Ints) -> None:
        self.nodes += search_prefixes(
            self._cross, self._near, self._far, self._near_words, self._far_words,
            prefixes, self._tolerance, self._found,
        )  # fmt: skip


def _letters(arm: Arm, words: ArmWords, entry: int) -> str:
    """Return the letters of an entry, away from the cut."""
    letters: list[str] = []
    while entry > 0:
        above = int(words.parent[entry])
        following = arm.following[words.node[above]]
        letters.append(ORDER[following.tolist().index(int(words.node[entry]))])
        entry = above
    return "".join(reversed(letters))


def _counted(n: int, arm: Arm) -> int:
    count = count_entries(arm, MOST_ENTRIES)
    if count >= MOST_ENTRIES:
        raise ValueError(
            f"sequence: {n} components are not allowed; the halves of a chain may have at most "
            f"{MOST_ENTRIES:,} words, shorter ones included"
        )
    return count
