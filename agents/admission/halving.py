"""Successive halving: which of many candidates does best, within a budget of episodes.

All play the same draws; the better half goes on and plays more (Jamieson and Talwalkar,
*Non-stochastic best arm identification*, 2016). Every round has about the same share of the budget.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from magfold_env.envs.chains.arrays import Floats, Ints

Trial = Callable[[Ints, int, int], Floats]
"""From some candidates, the first draw and the draw after the last to success and score of their
episodes, (candidates, draws, 2)."""


class Winner(NamedTuple):
    """The best of the candidates."""

    place: int
    """Among them, from 0."""
    draws: int
    """How many episodes it had."""
    successes: int
    """How many of them succeeded: a flattering share, since it was chosen for it."""


def rounds(candidates: int, budget: int) -> list[tuple[int, int]]:
    """Return how many candidates play in each round, and on how many more draws.

    Raises
    ------
    ValueError
        If the budget is too small for one more draw a round.
    """
    fields = [candidates]
    while fields[-1] > 2:
        fields.append((fields[-1] + 1) // 2)
    if sum(fields) > budget:
        raise ValueError(
            f"budget: {budget} is not allowed for {candidates} candidates; "
            f"must be {sum(fields)} or more"
        )
    found: list[tuple[int, int]] = []
    for number, field in enumerate(fields):
        draws = max(1, budget // (field * (len(fields) - number)))
        found.append((field, draws))
        budget -= field * draws
    return found


def halving(candidates: int, budget: int, trial: Trial) -> Winner:
    """Return the best of some candidates by share of successes, then by mean score.

    Of equally good ones the first is preferred. `budget` is the most episodes, as in `rounds`.
    """
    field = np.arange(candidates)
    ends = np.zeros((candidates, 0, 2))
    for places, draws in rounds(candidates, budget):
        field, ends = field[:places], ends[:places]
        played = ends.shape[1]
        ends = np.concatenate([ends, trial(field, played, played + draws)], axis=1)
        success, score = -ends.mean(axis=1).T
        ranks = np.lexsort((field, score, success))
        field, ends = field[ranks], ends[ranks]
    return Winner(int(field[0]), ends.shape[1], int(ends[0, :, 0].sum()))
