"""The Pareto front of run time and error, and how far a setting lies behind it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from magfold_env.benchmarks.whole.settings import Setting
from magfold_env.engine.state import Array


def front(times: Array, errors: Array) -> list[int]:
    """Return the settings that none beats in both, by growing time; of equals the first."""
    found: list[int] = []
    best = np.inf
    for k in np.lexsort((errors, times)):
        if errors[k] < best:
            best = float(errors[k])
            found.append(int(k))
    return found


def fastest(times: Array, errors: Array, error: float) -> int:
    """Return the fastest setting whose error is at most as large; that is one of the front."""
    return int(np.argmin(np.where(errors <= error, times, np.inf)))


def without_luck(settings: Sequence[Setting], errors: Array) -> Array:
    """Return the largest error of each setting and of all that are at least as tight.

    Errors do not fall evenly: a loose setting may hit by chance what tighter ones miss.
    """
    return np.array(
        [
            max(e for other, e in zip(settings, errors, strict=True) if other.as_tight(one))
            for one in settings
        ]
    )
