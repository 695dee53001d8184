"""Shares of successes with their confidence intervals."""

import importlib
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Share:
    """Successes among trials, with Wilson's 95 % confidence interval."""

    successes: int
    trials: int
    low: float
    """Lower end of the interval of the probability of success."""
    high: float
    """Upper end of the interval."""

    @property
    def rate(self) -> float:
        """Share of successes: the estimate of the probability."""
        return self.successes / self.trials

    def __str__(self) -> str:
        """Return the share and its interval in per cent."""
        return per_cent(self.rate, self.low, self.high)

    def __repr__(self) -> str:
        """Return the counts, the share and its interval; lists and dictionaries show this text."""
        return f"<Share {self.successes} of {self.trials}: {self}>"


def share(successes: int, trials: int) -> Share:
    """Return the share of `successes` among `trials`; there must be at least one trial."""
    stats: Any = importlib.import_module("scipy.stats")  # slow to import
    interval = stats.binomtest(successes, trials).proportion_ci(0.95, method="wilson")
    return Share(successes, trials, float(interval.low), float(interval.high))


def per_cent(rate: float, low: float, high: float) -> str:
    """Return a share and its interval in per cent."""
    return f"{100 * rate:.0f} % ({100 * low:.0f}–{100 * high:.0f})"
