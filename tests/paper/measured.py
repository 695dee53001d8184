"""Numbers as the parts measure them, made up, and what the parts say of them."""

from collections.abc import Sequence

from magfold_bench.paper.reproduction import Claim, Measured, Outcome
from magfold_bench.tables import Row


def outcomes(claims: Sequence[Claim]) -> list[Outcome]:
    return [claim.outcome for claim in claims]


def changed(measured: Measured, name: str, where: Row, **change: object) -> Measured:
    """The same numbers, but for those of one set's rows that have given values."""
    rows: list[Row] = []
    hits = 0
    for row in measured[name]:
        hit = all(row[key] == value for key, value in where.items())
        hits += hit
        rows.append(row | change if hit else row)  # pyright: ignore[reportArgumentType]
    assert hits, f"no row of {name} has {where}"
    return measured | {name: rows}
