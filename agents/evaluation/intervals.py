"""Statistics of success over seeds and targets: means, interquartile means, intervals.

The aggregates are those of rliable (Agarwal et al., *Deep Reinforcement Learning at the Edge of the
Statistical Precipice*, 2021): the interquartile mean is the mean of the middle half of all runs on
all tasks. Here, a task is a target, and its score is the share of successful draws.

Intervals are from the bootstrap over seeds and targets together: both are drawn with replacement
and crossed (Owen, *The pigeonhole bootstrap*, 2007), because a lucky training run is lucky on all
targets. (rliable draws the runs of each task separately, as if their luck were independent.) A
target and its mirror image are drawn together, because a mirror-symmetric device folds into both
equally well. Episodes of fixed tasks may replace targets; they are drawn one by one. If all seeds
and targets score the same, an interval has no width.

rliable itself is not used. Its last release, 1.2.0, needs arch below 8, which cannot be imported
with pandas 3. With pandas 2, it adds ten packages (159 MB), and it ignores its seed and draws from
NumPy's global random generator.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import trim_mean

from magfold_env.shapes import mirror

Floats = NDArray[np.float64]
Aggregate = Callable[[Floats], Floats]
"""A function that maps scores, shape (..., runs, targets), to values, shape (...)."""

RESAMPLES = 2000
CONFIDENCE = 0.95


class Estimate(NamedTuple):
    """A value with its interval."""

    value: float
    low: float
    high: float

    def __str__(self) -> str:
        """Return a share and its interval in per cent."""
        value, low, high = map(percent, self)
        return f"{value} % ({low}–{high})"

    def points(self, unit: str = "") -> str:
        """Return a difference of shares and its interval, in percentage points, with signs."""
        value, low, high = (percent(each, "+") for each in self)
        return f"{value}{unit} ({low}…{high})"


def percent(share: float, sign: str = "") -> str:
    """Return a share in per cent, to one decimal; `sign` "+" shows the sign of positive values."""
    return f"{100.0 * share:{sign}.1f}".replace("100.0", "100").replace("-", "−")


def mean(scores: Floats) -> Floats:
    """Return the mean over runs and targets, the last two axes."""
    return scores.mean(axis=(-2, -1))


def interquartile_mean(scores: Floats) -> Floats:
    """Return the mean of the middle half of all runs on all targets, the last two axes."""
    flat = scores.reshape(*scores.shape[:-2], -1)
    return np.asarray(trim_mean(flat, proportiontocut=0.25, axis=-1))


def estimate(
    scores: Floats, targets: Sequence[str] | None, aggregate: Aggregate = mean, seed: int = 0
) -> Estimate:
    """Return an aggregate of scores, shape (runs, targets), with its interval.

    A run is one training seed. `targets` are words, or None if episodes replace targets, and `seed`
    is the seed of the resamples.
    """
    rng = np.random.default_rng(seed)
    drawn = _drawn(rng, targets, scores.shape[1])
    return _estimate(aggregate(scores), aggregate(_crossed(rng, scores, drawn)))


def difference(
    scores: Floats, others: Floats, targets: Sequence[str] | None, seed: int = 0
) -> Estimate:
    """Return the difference of the means of two sets of scores on the same targets.

    The difference is paired: in every resample, both sets have the same targets, but their runs are
    drawn separately. The arguments are those of `estimate`.
    """
    rng = np.random.default_rng(seed)
    drawn = _drawn(rng, targets, scores.shape[1])
    resamples = mean(_crossed(rng, scores, drawn)) - mean(_crossed(rng, others, drawn))
    return _estimate(mean(scores) - mean(others), resamples)


def _drawn(
    rng: np.random.Generator, targets: Sequence[str] | None, count: int
) -> NDArray[np.int64]:
    """Return indices of drawn targets, each with its mirror image, shape (resamples, targets)."""
    if targets is None:
        return rng.integers(count, size=(RESAMPLES, count))
    places = {word: k for k, word in enumerate(targets)}
    images = {k: places.get(mirror(word), k) for word, k in places.items()}
    missing = len(targets)
    rows = [[k, missing if k == image else image] for k, image in images.items() if k <= image]
    drawn = np.array(rows)[rng.integers(len(rows), size=(RESAMPLES, len(targets)))]
    flat = rng.permuted(drawn, axis=2).reshape(RESAMPLES, -1)
    first = np.argsort(flat == missing, axis=1, stable=True)[:, : len(targets)]
    return np.take_along_axis(flat, first, axis=1)


def _crossed(rng: np.random.Generator, scores: Floats, targets: NDArray[np.int64]) -> Floats:
    """Return scores of drawn runs on the drawn targets, shape (resamples, runs, targets)."""
    count = scores.shape[0]
    runs = rng.integers(count, size=(RESAMPLES, count))
    return scores[runs[:, :, None], targets[:, None, :]]


def _estimate(value: Floats, resamples: Floats) -> Estimate:
    tail = 50.0 * (1.0 - CONFIDENCE)
    low, high = np.percentile(resamples, [tail, 100.0 - tail], axis=0)
    return Estimate(float(value), float(low), float(high))
