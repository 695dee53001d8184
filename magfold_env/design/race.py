"""Successive halving: many choices are tried a little, the best of them more."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from magfold_env.design.choice import Choice

RUNGS: tuple[tuple[int, int | None], ...] = ((4, None), (12, 4), (40, 1))
"""Releases of a choice, and how many of the choices have so many: None stands for all."""


class Oracle(Protocol):
    """What answers how choices do; `Trials` of the dynamics, or a stand-in."""

    @property
    def count(self) -> int:
        """How many answers were asked for."""
        ...

    def scores(self, choices: Sequence[Choice], draws: int) -> npt.NDArray[np.float64]:
        """Return the scores of the first releases of choices, shape (choices, draws), at most 1."""
        ...


class Standing(NamedTuple):
    """What is known of a choice."""

    choice: Choice
    mean: float
    """Mean score of its releases."""
    successes: int
    releases: int

    @property
    def rate(self) -> float:
        """Share of successes."""
        return self.successes / self.releases


def race(choices: Sequence[Choice], trials: Oracle) -> list[Standing]:
    """Try choices on ever more releases, those with the highest mean score only, and rank them.

    Returns
    -------
    list of Standing
        Those that went furthest first, by mean score; equal ones in the order given.
    """
    field = list(dict.fromkeys(choices))
    ranked: list[Standing] = []
    for releases, places in RUNGS:
        standings = _tried(field[:places], trials, releases)
        ranked[: len(standings)] = standings
        field = [standing.choice for standing in ranked]
    return ranked


def _tried(choices: Sequence[Choice], trials: Oracle, releases: int) -> list[Standing]:
    scores = trials.scores(choices, releases)
    found = [
        Standing(choice, float(row.mean()), int(np.sum(row == 1.0)), releases)
        for choice, row in zip(choices, scores, strict=True)
    ]
    return sorted(found, key=lambda standing: -standing.mean)
