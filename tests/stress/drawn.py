"""Random scenes whose numbers hypothesis draws, so that it can shrink failing examples."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

from hypothesis import strategies as st

from magfold_bench.stress.kinds import KINDS, Source
from magfold_env.scene import Scene

T = TypeVar("T")


class DrawnSource(Source):
    """A source of numbers that hypothesis chooses."""

    def __init__(self, draw: st.DrawFn) -> None:
        self._draw = draw

    def integer(self, low: int, high: int) -> int:
        return self._draw(st.integers(low, high))

    def number(self, low: float, high: float) -> float:
        return self._draw(st.floats(low, high))

    def pick(self, options: Sequence[T]) -> T:
        return self._draw(st.sampled_from(options))


@st.composite
def scenes(draw: st.DrawFn, kind: str) -> Scene:
    """Draw a scene of a kind."""
    return KINDS[kind].make(DrawnSource(draw))
