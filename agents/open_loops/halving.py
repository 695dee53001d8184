"""Successive halving: which of many candidates do best, within a budget of episodes.

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


class Ranked(NamedTuple):
    """One of the candidates."""

    place: int
    """Among them, from 0."""
    successes: int
    """How many of its episodes succeeded: of the best a flattering share, for it was chosen."""
    draws: int
    """How many episodes it had."""


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


def halving(candidates: int, budget: int, trial: Trial) -> list[Ranked]:
    """Return some candidates, the best first, by share of successes, then by mean score.

    Those that went on come before the others; of equally good ones the first is preferred.
    `budget` is the most episodes, as in `rounds`.
    """
    field, ends = np.arange(candidates), np.zeros((candidates, 0, 2))
    out: list[Ranked] = []
    for places, draws in rounds(candidates, budget):
        out = _ranked(field[places:], ends[places:]) + out
        field, ends = field[:places], ends[:places]
        played = ends.shape[1]
        ends = np.concatenate([ends, trial(field, played, played + draws)], axis=1)
        success, score = -ends.mean(axis=1).T
        ranks = np.lexsort((field, score, success))
        field, ends = field[ranks], ends[ranks]
    return _ranked(field, ends) + out


def _ranked(field: Ints, ends: Floats) -> list[Ranked]:
    successes = ends[..., 0].sum(axis=1).astype(int).tolist()
    return [Ranked(*each, ends.shape[1]) for each in zip(field.tolist(), successes, strict=True)]
