"""Confidence intervals of shares."""

from __future__ import annotations

import math


def wilson(hits: int, trials: int, quantile: float = 1.96) -> tuple[float, float]:
    """Return Wilson's score interval of a share, (0, 1) without trials.

    Parameters
    ----------
    quantile
        Of the normal distribution; 1.96 gives 95 %.
    """
    if trials == 0:
        return 0.0, 1.0
    share, z2 = hits / trials, quantile**2
    centre = (share + z2 / (2 * trials)) / (1 + z2 / trials)
    spread = share * (1 - share) / trials + z2 / (4 * trials**2)
    half = quantile * math.sqrt(spread) / (1 + z2 / trials)
    return max(0.0, centre - half), min(1.0, centre + half)
