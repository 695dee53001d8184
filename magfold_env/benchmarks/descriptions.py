"""What is said about the benchmarks and their parts, read before any of them is imported."""

import tomllib
from functools import cache
from pathlib import Path
from typing import NamedTuple


class Description(NamedTuple):
    """One part in plain words: a title, and some sentences to each question."""

    title: str
    measured: str  # what was measured
    how: str  # how, and against what
    meaning: str  # what the result means to someone who uses the package
    missing: str  # what it does not cover


class Summary(NamedTuple):
    """One benchmark: what it measures, and its parts by name."""

    measures: str
    parts: dict[str, Description]


@cache
def descriptions() -> dict[str, Summary]:
    """Return all benchmarks by name."""
    text = Path(__file__).with_suffix(".toml").read_text(encoding="utf-8")
    return {
        name: Summary(table.pop("measures"), {k: Description(**v) for k, v in table.items()})
        for name, table in tomllib.loads(text).items()
    }
