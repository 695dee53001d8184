"""What a reader who has not seen the code is told about a part of a benchmark."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class About:
    """One part in plain words: a title, and some sentences to each question."""

    title: str
    measured: str
    """What was measured."""
    how: str
    """How, and against what."""
    meaning: str
    """What the result means to someone who uses the package."""
    missing: str
    """What it does not cover."""
