"""Where random scenes get their numbers from: a generator, or whatever else can draw."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Protocol, TypeVar

import numpy as np

T = TypeVar("T")


class Source(Protocol):
    """Draws numbers and choices, evenly as far as it draws at random."""

    def integer(self, low: int, high: int) -> int:
        """Return an integer from ``low`` to ``high``, both included."""
        ...

    def number(self, low: float, high: float) -> float:
        """Return a number from ``low`` to ``high``."""
        ...

    def pick(self, options: Sequence[T]) -> T:
        """Return one of the options."""
        ...


class RandomSource:
    """Draws from a generator.

    Parameters
    ----------
    key
        Seeds it: one key, one stream of draws.
    """

    def __init__(self, *key: int) -> None:
        self._rng = np.random.default_rng(key)

    def integer(self, low: int, high: int) -> int:
        """Return an integer from ``low`` to ``high``, both included."""
        return int(self._rng.integers(low, high + 1))

    def number(self, low: float, high: float) -> float:
        """Return a number from ``low`` to ``high``."""
        return float(self._rng.uniform(low, high))

    def pick(self, options: Sequence[T]) -> T:
        """Return one of the options."""
        return options[self.integer(0, len(options) - 1)]


def logarithmic(source: Source, low: float, high: float) -> float:
    """Draw a positive number evenly in its logarithm."""
    drawn = math.exp(source.number(math.log(low), math.log(high)))
    return min(max(drawn, low), high)


def numbers(source: Source, low: float, high: float, count: int) -> tuple[float, ...]:
    """Draw so many numbers."""
    return tuple(source.number(low, high) for _ in range(count))
