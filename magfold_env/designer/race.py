"""Successive halving: many choices are tried a little, the best of them more."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from magfold_env.designer.choice import Choice

RUNGS: tuple[tuple[int, int | None], ...] = ((1, None), (4, 12), (12, 4))
"""Releases of a choice, and how many of the choices have so many: None stands for all."""

FINAL = 40
"""Releases of the finalists, those of the last rung, one after another until one does."""


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


def race(choices: Sequence[Choice], trials: Oracle, enough: float = 1.0) -> list[Standing]:
    """Try choices on ever more releases, those that do best only, and rank them.

    Parameters
    ----------
    choices
        Of equal ones the first are preferred.
    trials
        Releases them.
    enough
        Share of successes that ends the race; finalists that can no longer have it are left out.

    Returns
    -------
    list of Standing
        By `ranked`.
    """
    field = list(dict.fromkeys(choices))
    known: dict[Choice, Standing] = {}
    for releases, places in RUNGS:
        tried = ranked(_tried(field[:places], trials, releases))
        field = [standing.choice for standing in tried]
        known |= {standing.choice: standing for standing in tried}
    for choice in field:
        failures = known[choice].releases - known[choice].successes
        if (FINAL - failures) / FINAL >= enough:
            (known[choice],) = _tried([choice], trials, FINAL)
            if known[choice].rate >= enough:
                break
    return ranked(known.values())


def ranked(standings: Iterable[Standing]) -> list[Standing]:
    """Return those of most releases first, then of most successes, then of the highest mean."""
    return sorted(standings, key=lambda each: (-each.releases, -each.successes, -each.mean))


def _tried(choices: Sequence[Choice], trials: Oracle, releases: int) -> list[Standing]:
    scores = trials.scores(choices, releases)
    return [
        Standing(choice, float(row.mean()), int(np.sum(row == 1.0)), releases)
        for choice, row in zip(choices, scores, strict=True)
    ]
