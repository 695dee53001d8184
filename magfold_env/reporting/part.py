"""What one part of the benchmark hands to the report."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

Cell = str | int | float
Row = dict[str, Cell]

Progress = Callable[[float, str], None]
"""Is told the finished share of a part, 0 to 1, and what is going on."""

Tick = Callable[[float], None]
"""Is told the finished share of one of a part's cases, 0 to 1."""


@dataclass(frozen=True)
class Table:
    """Rows for the console, all with the same keys."""

    title: str
    rows: list[Row]


@dataclass(frozen=True)
class Part:
    """One part's measurements."""

    name: str
    """Also the name of its files."""
    rows: list[Row]
    """Everything measured, for CSV and JSON."""
    tables: list[Table] = field(default_factory=list["Table"])
    """What of it is worth reading."""
    findings: list[str] = field(default_factory=list[str])
    """Requirements and how they are met, a sentence each."""


def begin_case(progress: Progress, k: int, count: int, what: str) -> Tick:
    """Tell that the k-th of ``count`` cases begins, and return what takes its progress."""

    def tick(share: float) -> None:
        progress((k + share) / count, what)

    tick(0.0)
    return tick
