"""What many episodes are to reach, and how near to it their chains are."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from magfold_env.engine.compile.jit import kernel
from magfold_env.envs.baselines.baseline import Baseline
from magfold_env.envs.tasks.goals import SUCCESS_TOLERANCE, Goal, Match, goal_of, likeness
from magfold_env.shapes import LETTERS, headings, word_to_angles

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class GoalBoard:
    """Goals of chains side by side.

    Parameters
    ----------
    targets : sequence of str
        The words that may be wanted, all of one length.
    match : {"word", "outline"}
        What will do for a word; `magfold_env.envs.tasks.goals.Goal`.
    count : int
        Number of chains.
    baseline_of : callable
        Returns the baseline of a target.

    Attributes
    ----------
    names : array of str, shape (m,)
        The targets.
    one_hot : array, shape (m, 3 (n − 1))
        The same as entries of an observation.
    baseline : array, shape (m,)
        Scores of their baselines.
    flagged : array of bool, shape (m,)
        Which have none.
    """

    def __init__(
        self,
        targets: Sequence[str],
        match: Match,
        count: int,
        baseline_of: Callable[[str], Baseline],
    ) -> None:
        joints = len(targets[0])
        self._targets, self._match, self._baseline_of = targets, match, baseline_of
        self._names = np.array(targets, dtype=object)
        letters = np.array([list(word) for word in targets])
        self._one_hots = (letters[:, :, None] == list(LETTERS)).reshape(len(targets), -1)
        self._all_angles = np.array([word_to_angles(word) for word in targets])
        self._all_folds = np.array([headings(angles) for angles in self._all_angles])
        self._baselines = np.full(len(targets), np.nan)
        self._flags = np.zeros(len(targets), dtype=np.bool_)
        self._counts = np.ones(count, dtype=np.int64)
        self._angles = np.zeros((count, 1, joints))
        self._folds = np.zeros((count, 1, joints + 1))
        self._scratch = np.zeros((5, joints + 1))
        self.names = np.full(count, None, dtype=object)
        self.one_hot = np.zeros((count, 3 * joints), dtype=np.float32)
        self.baseline = np.zeros(count)
        self.flagged = np.zeros(count, dtype=np.bool_)

    @property
    def turns(self) -> Floats:
        """Joint angles of the words themselves [rad], (m, n − 1)."""
        return self._angles[:, 0]

    def goal(self, row: int) -> Goal:
        """Return the goal of one chain."""
        return goal_of(self.names[row], self._match)

    def want(self, rows: Ints, targets: Ints) -> None:
        """Set the goals of some chains, by their numbers among the targets."""
        unknown: list[int] = np.unique(targets[np.isnan(self._baselines[targets])]).tolist()
        for target in unknown:
            baseline = self._baseline_of(self._targets[target])
            self._baselines[target], self._flags[target] = baseline.score, baseline.flagged
        self.names[rows] = self._names[targets]
        self.one_hot[rows] = self._one_hots[targets]
        self.baseline[rows] = self._baselines[targets]
        self.flagged[rows] = self._flags[targets]
        if self._match == "word":
            self._angles[rows, 0] = self._all_angles[targets]
            self._folds[rows, 0] = self._all_folds[targets]
            return
        for row, target in zip(rows.tolist(), targets.tolist(), strict=True):
            words = goal_of(self._targets[target], self._match).words
            if len(words) > self._angles.shape[1]:
                self._make_room(len(words))
            self._counts[row] = len(words)
            for k, word in enumerate(words):
                self._angles[row, k] = word_to_angles(word)
                self._folds[row, k] = headings(self._angles[row, k])

    def judge(self, rows: Ints, angles: Floats) -> tuple[Floats, NDArray[np.bool_]]:
        """Return how near some chains are to their goals.

        Parameters
        ----------
        angles : array, shape (m, n)
            Headings of all chains [rad].

        Returns
        -------
        potentials : array, shape (rows,)
            Half the similarity, as `Goal.potential`.
        near : array of bool, shape (rows,)
            Whether all joints are within `SUCCESS_TOLERANCE`.
        """
        potentials, near = np.empty(len(rows)), np.empty(len(rows), dtype=np.bool_)
        _judge(
            rows, SUCCESS_TOLERANCE, angles, self._counts, self._angles, self._folds,
            self._scratch, potentials, near,
        )  # fmt: skip
        return potentials, near

    def _make_room(self, words: int) -> None:
        """Make room for so many words a goal."""
        more = ((0, 0), (0, words - self._angles.shape[1]), (0, 0))
        self._angles, self._folds = np.pad(self._angles, more), np.pad(self._folds, more)


@kernel
def _judge(  # noqa: PLR0913, PLR0917
    rows: Ints,
    tolerance: float,
    angles: Floats,
    counts: Ints,
    wanted: Floats,
    folds: Floats,
    scratch: Floats,
    potentials: Floats,
    near: NDArray[np.bool_],
) -> None:
    n = angles.shape[1]
    turned = scratch[4]
    for j in range(rows.size):
        k = rows[j]
        turned[0] = 0.0
        for i in range(1, n):
            turned[i] = turned[i - 1] + (angles[k, i] - angles[k, i - 1])
        potentials[j] = 0.5 * likeness(turned, folds[k, : counts[k]], scratch)
        near[j] = False
        for m in range(counts[k]):
            within = True
            for i in range(1, n):
                apart = abs(angles[k, i] - angles[k, i - 1] - wanted[k, m, i - 1])
                within = within and apart <= tolerance
            near[j] = near[j] or within
