"""What a bar chart of an ensemble shows."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from magfold_env.ensembles.result import Ensemble


class Bar(NamedTuple):
    """How often a chain ended in one way."""

    word: str
    """Fold word; empty for several together."""
    status: str
    """The text of a `FoldStatus`, or `others`."""
    rate: float
    """Share of the runs."""
    low: float
    """Lower end of its interval."""
    high: float
    """Upper end of its interval."""
    joints: tuple[float, ...]
    """Joint angles of a run that ended so [rad]; none for several together."""


def bars(ensemble: Ensemble) -> list[Bar]:
    """Return a bar for each pair of word and status, most frequent first."""
    found: list[Bar] = []
    for (word, status), share in ensemble.outcomes.items():
        first = int(np.argmax((ensemble.word == word) & (ensemble.status == status.value)))
        joints = tuple(np.diff(ensemble.angles[first]).tolist())
        found.append(Bar(word, status.value, share.rate, share.low, share.high, joints))
    return found
