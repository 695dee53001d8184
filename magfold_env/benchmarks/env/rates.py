"""How often a second something is done, from the time that it takes."""

from __future__ import annotations

from magfold_env.reporting.tables import Row
from magfold_env.reporting.timing import Timing


def rate_cells(what: str, taken: Timing, count: float) -> Row:
    """Return the cells of a table's row that tell how often a second ``what`` is done.

    Parameters
    ----------
    taken
        Time of ``count`` of them.
    """
    spread = taken.spread
    return {
        f"{what}/s": count / spread.median,
        "lower quartile": count / spread.high,
        "upper quartile": count / spread.low,
    }


def verdict(rate: float, wanted: float) -> str:
    """Say whether a rate [1/s] is as high as wanted."""
    return f"at least {wanted:,.0f} are asked for: {'holds' if rate >= wanted else 'FAILS'}"
