"""Goals of episodes, and how close a fold is to its goal.

A goal is a fold word, or any word with the same outline. The similarity of two folds is
`magfold_env.shapes.similarity`: the mean over ordered pairs of components of exp(−d²/side²), where
d is the distance between the positions of the one component in the two folds, as seen from the
other. This measure distinguishes components, because each has its own magnets. It ignores
translation and rotation, because the target is a shape and not a place. It does not ignore
mirroring, because a mirror image is a different fold. It has no jumps, so that it can shape a
reward. It is 1 only for the target. The mean error of the joint angles has the same properties, but
it gives a wrong joint in the middle, which moves half the chain, the same weight as one at the end.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from magfold_env.engine.compile.jit import kernel
from magfold_env.envs.chains.arrays import FAILED, FOLDED, STATUSES, Floats, Ints
from magfold_env.fold import FoldStatus
from magfold_env.shapes import headings, outline, word_to_angles, words_of_outline

Match = Literal["word", "outline"]

SUCCESS_TOLERANCE = 0.05
"""Largest deviation of a joint from its target angle that counts as a success [rad]."""


class Verdict(NamedTuple):
    """How near a chain is to a goal."""

    potential: float
    """Half the similarity of the chain to the likest of the words: the score if the episode ended
    here without a success."""
    score: float
    """1 for a success, 0 for a failed simulation, else the potential. A miss scores at most one
    half, so no amount of similarity is worth as much as the fold itself."""
    is_reached: bool
    """Whether the chain settled as wanted, every joint within `SUCCESS_TOLERANCE`."""


@dataclass(frozen=True)
class Goal:
    """A target fold.

    Attributes
    ----------
    word : str
        Word over L, S and R, one letter a joint.
    match : {"word", "outline"}
        Whether only `word` counts, or every fully folded word that covers the same cells.
    """

    word: str
    match: Match = "word"

    @cached_property
    def words(self) -> tuple[str, ...]:
        """The words that count as reached; `word` is the first."""
        if self.match == "word":
            return (self.word,)
        others = words_of_outline(outline(self.word))
        return (self.word, *(word for word in others if word != self.word))

    @cached_property
    def angles(self) -> Floats:
        """Joint angles of `words` [rad], shape (words, n - 1)."""
        return np.array([word_to_angles(word) for word in self.words])

    @cached_property
    def headings(self) -> Floats:
        """Headings of `words` [rad], shape (words, n); that of component 1 is 0."""
        return np.array([headings(angles) for angles in self.angles])

    def judged(self, status: FoldStatus | None, joint_angles: Floats) -> Verdict:
        """Return how near a chain is to the goal.

        Parameters
        ----------
        status : FoldStatus or None
            How the fold ended.
        joint_angles : array, shape (n - 1,)
            Relative angles at the end [rad]; joints that are still in the tube count as straight.
        """
        out = np.empty((3, 1))
        scratch = np.empty((5, joint_angles.size + 1))
        row, code = np.zeros(1, dtype=np.int64), np.array([STATUSES.index(status)])
        angles, folds = self.angles[None], self.headings[None]
        count = np.array([len(self.words)])
        judge(row, code, joint_angles[None], count, angles, folds, scratch, out)
        return Verdict(float(out[0, 0]), float(out[1, 0]), bool(out[2, 0]))


@lru_cache(maxsize=4096)
def goal_of(word: str, match: Match) -> Goal:
    """Return the goal; all callers share its cached results."""
    return Goal(word, match)


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
    """See `magfold_env.envs.episodes.Goals.judge`; a chain has ``counts`` words."""
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
    """Similarity of headings ``angles`` (n,) to the most similar of ``folds`` (m, n); 4 n scratch.

    This is the compiled form of `magfold_env.shapes.similarity`.
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
    """Centres of a chain, in sides: hinges lie √2 sides apart, centres halfway between."""
    px, py = 0.0, 0.0
    for i in range(angles.size):
        dx, dy = np.sqrt(2.0) * np.cos(angles[i]), np.sqrt(2.0) * np.sin(angles[i])
        x[i] = px + 0.5 * dx
        y[i] = py + 0.5 * dy
        px += dx
        py += dy
