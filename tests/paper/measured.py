"""Invented measurements of all parts, and the statements that the parts derive from them."""

from collections.abc import Sequence

from magfold_bench.paper.reproduction import Claim, Measured, Outcome
from magfold_bench.tables import Row
from magfold_env.minimiser import Mode

Ends = dict[Mode, dict[str, int]]
"""Number of releases by mode and word; words with S are misfolds."""

FITTING: dict[int, Ends] = {
    1: {
        "free": {"LRLLR": 80, "LRLLL": 10, "LRSLL": 10},
        "forward": {"LRLLR": 60, "LRLLL": 20, "RRLLL": 20},
        "backward": {"LRLLR": 50, "LRLLL": 45, "RRLLL": 5},
    },
    2: {
        "free": {"LRLRL": 100},
        "forward": {"LRLRL": 60, "LRLLL": 40},
        "backward": {"LRLRL": 35, "LRLLL": 33, "LRRLL": 32},
    },
    3: {
        "free": {"LRLLL": 80, "LRLSS": 20},
        "forward": {"LRLLL": 60, "LRLSL": 40},
        "backward": {"LRLLL": 100},
    },
}
"""Outcomes that agree with the paper, by sequence."""


def outcomes(claims: Sequence[Claim]) -> list[Outcome]:
    return [claim.outcome for claim in claims]


def changed(measured: Measured, name: str, where: Row, **change: object) -> Measured:
    """Return the same numbers, with changes in one set's rows that have given values."""
    rows: list[Row] = []
    hits = 0
    for row in measured[name]:
        hit = all(row[key] == value for key, value in where.items())
        hits += hit
        rows.append(row | change if hit else row)  # pyright: ignore[reportArgumentType]
    assert hits, f"no row of {name} has {where}"
    return measured | {name: rows}
