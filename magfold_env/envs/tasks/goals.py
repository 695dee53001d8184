"""Goals of episodes, and how close a fold is to its goal.

A goal is a fold word, or any word with the same outline. The similarity of two folds is
`magfold_env.shapes.similarity`: the mean over ordered pairs of components of exp(−d²/side²). Here
d is the distance between the second component's positions in the two folds, as seen from the first.
This measure distinguishes components, because each has its own magnets. It ignores translation and
rotation, because the target is a shape and not a location. It does not ignore mirroring, because a
mirror image is a different fold. It is continuous, so it can shape a reward. It is 1 only for the
target. The mean error of the joint angles has the same properties, but it gives a wrong joint in
the middle, which moves half the chain, the same weight as a wrong joint at the end.
"""

from collections.abc import Sequence
from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from magfold_env.engine.compile.jit import kernel
from magfold_env.envs.chains.arrays import FAILED, FOLDED, STATUSES, Floats, Ints
from magfold_env.fold import Fold
from magfold_env.shapes import LETTERS, headings, outline, word_to_angles, words_of_outline

Match = Literal["word", "outline"]

SUCCESS_TOLERANCE = 0.05
"""Largest deviation of a joint from its target angle that counts as a success [rad]."""


class Goals:
    """The goals of `count` chains. Each goal is one of `words`, which all have the same length.

    Only the word itself counts or, if `match` is ``outline``, every fully folded word that covers
    the same cells.
    """

    def __init__(self, words: Sequence[str], match: Match, count: int) -> None:
        joints = len(words[0])
        self._words, self._match = words, match
        self._all_names = np.array(words, dtype=object)
        letters = np.array([list(word) for word in words]).reshape(len(words), joints)
        self._one_hots = (letters[:, :, None] == list(LETTERS)).reshape(len(words), -1)
        self._counts = np.ones(count, dtype=np.int64)
        self._angles = np.zeros((count, 1, joints))
        self._folds = np.zeros((count, 1, joints + 1))
        self._scratch = np.zeros((5, joints + 1))
        self.names = np.full(count, None, dtype=object)
        """The target words, (m,)."""
        self.one_hot = np.zeros((count, 3 * joints), dtype=np.float32)
        """The same words as entries of an observation, (m, 3 (n − 1))."""

    @property
    def turns(self) -> Floats:
        """Joint angles of the target words [rad], (m, n − 1)."""
        return self._angles[:, 0]

    def want(self, rows: Ints, numbers: Ints) -> None:
        """Set the goals of the given chains by the numbers of their words."""
        self.names[rows] = self._all_names[numbers]
        self.one_hot[rows] = self._one_hots[numbers]
        for row, number in zip(rows.tolist(), numbers.tolist(), strict=True):
            angles, folds = _shapes_of(self._words[number], self._match)
            count = len(angles)
            if count > self._angles.shape[1]:
                more = ((0, 0), (0, count - self._angles.shape[1]), (0, 0))
                self._angles, self._folds = np.pad(self._angles, more), np.pad(self._folds, more)
            self._counts[row] = count
            self._angles[row, :count], self._folds[row, :count] = angles, folds

    def judge(self, rows: Ints, status: Ints, angles: Floats) -> Floats:
        """Return the potential, score and success of the given chains, (3, rows).

        The potential is half the similarity to the most similar word that counts. Success is 1 if
        the chain settled with every joint within `SUCCESS_TOLERANCE`, else 0. The score is 1 for a
        success, 0 for a failed simulation, and otherwise the potential, so that similarity is worth
        at most half as much as the fold itself.

        `status` (m,) contains indices of `STATUSES`, and `angles` (m, n) contains headings [rad].
        Both cover all chains.
        """
        out = np.empty((3, len(rows)))
        headings = angles[rows]
        joints = headings[:, 1:] - headings[:, :-1]
        judge(rows, status, joints, self._counts, self._angles, self._folds, self._scratch, out)
        return out


def judged(target: str, match: Match, folds: Sequence[Fold]) -> Floats:
    """Return the results of `Goals.judge` for folds with one target, (3, folds)."""
    goals, rows = Goals((target,), match, len(folds)), np.arange(len(folds))
    goals.want(rows, np.zeros_like(rows))
    status = np.array([STATUSES.index(fold.status) for fold in folds])
    return goals.judge(rows, status, np.array([fold.angles for fold in folds]))


@lru_cache(maxsize=4096)
def goal_words(word: str, match: Match) -> tuple[str, ...]:
    """Return the words that count as `word`, which comes first."""
    if match == "word":
        return (word,)
    return (word, *(other for other in words_of_outline(outline(word)) if other != word))


@lru_cache(maxsize=4096)
def _shapes_of(word: str, match: Match) -> tuple[Floats, Floats]:
    """Return the joint angles and headings [rad] of `goal_words`; component 1 has heading 0."""
    angles = np.array([word_to_angles(each) for each in goal_words(word, match)])
    return angles, np.array([headings(each) for each in angles])


@kernel
def judge(
    rows: Ints,
    status: Ints,
    joints: Floats,
    counts: Ints,
    wanted: Floats,
    folds: Floats,
    scratch: Floats,
    out: Floats,
) -> None:
    """Judge chains as in `Goals.judge`; ``counts[k]`` words count for chain k."""
    n = joints.shape[1] + 1
    turned = scratch[4]
    for j in range(rows.size):
        k: int = rows[j]
        turned[0] = 0.0
        for i in range(1, n):
            turned[i] = turned[i - 1] + joints[j, i - 1]
        out[0, j] = 0.5 * _similarity(turned, folds[k, : counts[k]], scratch)
        out[2, j] = 0.0
        for m in range(counts[k] if status[k] == FOLDED else 0):
            within = True
            for i in range(1, n):
                apart = abs(joints[j, i - 1] - wanted[k, m, i - 1])
                within = within and apart <= SUCCESS_TOLERANCE
            if within:
                out[2, j] = 1.0
        out[1, j] = out[0, j]
        if status[k] == FAILED:
            out[1, j] = 0.0
        elif out[2, j] == 1.0:
            out[1, j] = 1.0


@kernel
def _similarity(
    angles: NDArray[np.float64], folds: NDArray[np.float64], scratch: NDArray[np.float64]
) -> float:
    """Return the similarity of headings ``angles`` (n,) to the most similar of ``folds`` (m, n).

    This is the compiled form of `magfold_env.shapes.similarity`; it overwrites ``scratch``.
    """
    n = angles.size
    if n == 1:
        return 1.0
    x, y, u, v = scratch[0], scratch[1], scratch[2], scratch[3]
    _place(angles, x, y)
    best = 0.0
    for m in range(folds.shape[0]):
        fold = folds[m]
        _place(fold, u, v)
        total = 0.0
        for i in range(n):
            c, s = np.cos(angles[i]), np.sin(angles[i])
            a, b = np.cos(fold[i]), np.sin(fold[i])
            for j in range(n):
                if j != i:
                    dx, dy = x[j] - x[i], y[j] - y[i]
                    du, dv = u[j] - u[i], v[j] - v[i]
                    p = c * dx + s * dy - (a * du + b * dv)
                    q = c * dy - s * dx - (a * dv - b * du)
                    total += np.exp(-(p * p + q * q))
        best = max(best, total / (n * (n - 1)))
    return best


@kernel
def _place(angles: NDArray[np.float64], x: NDArray[np.float64], y: NDArray[np.float64]) -> None:
    """Write the components' centres to ``x`` and ``y``, in sides; hinges are √2 sides apart."""
    px, py = 0.0, 0.0
    for i in range(angles.size):
        dx, dy = np.sqrt(2.0) * np.cos(angles[i]), np.sqrt(2.0) * np.sin(angles[i])
        x[i] = px + 0.5 * dx
        y[i] = py + 0.5 * dy
        px += dx
        py += dy
