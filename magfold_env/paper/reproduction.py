"""What one figure or table of the paper is here: a measurement, a picture, and what is stated."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, NamedTuple

from magfold_env.reporting.page import Picture, Tone, Verdict
from magfold_env.reporting.tables import Progress, Row, Table

Measured = dict[str, list[Row]]
"""Rows by what they are of, plain values throughout; the rows of one have equal keys."""


Outcome = Literal["agrees", "agrees by construction", "disagrees", "cannot be compared"]

BUILT_IN = (
    "The sequences, which the text does not give, were reconstructed so that this holds: it is no "
    "evidence."
)
_TONES: dict[Outcome, Tone] = {"agrees": "good", "disagrees": "bad"}


class Claim(NamedTuple):
    """Something that the paper states, and what is found here."""

    stated: str
    """In our words."""
    found: str
    """With the numbers that were measured."""
    holds: bool | None
    """Whether they agree, going by those numbers; None where they cannot be compared."""
    why: str = ""
    """The reason, if one is known."""
    built_in: bool = False
    """Whether the sequences were reconstructed so that it holds."""

    @property
    def outcome(self) -> Outcome:
        """What the comparison came to."""
        if self.holds is None:
            return "cannot be compared"
        if not self.holds:
            return "disagrees"
        return "agrees by construction" if self.built_in else "agrees"

    def to_verdict(self) -> Verdict:
        """Return the claim as a block of a page."""
        why = BUILT_IN if self.outcome == "agrees by construction" else self.why
        more = [f"Here: {self.found}", *([f"Why: {why}"] if why else [])]
        tone = _TONES.get(self.outcome, "plain")
        return Verdict(self.outcome.capitalize(), f"The paper: {self.stated}", tone, more)


@dataclass(frozen=True)
class Reproduction:
    """The counterpart of a figure or a table.

    Attributes
    ----------
    name : str
        For ``--only``, and of its files.
    title : str
        Its heading.
    shows, computed, missing : str
        What the paper shows, what is computed here, and what is not covered.
    measure : callable
        Takes whether to do less, and a progress; everything else is made of what it returns.
    tables, claims, draw : callable
        Make tables, comparisons and pictures of it; pictures are written to a folder.
    """

    name: str
    title: str
    shows: str
    computed: str
    missing: str
    measure: Callable[[bool, Progress], Measured]
    tables: Callable[[Measured], list[Table]]
    claims: Callable[[Measured], list[Claim]]
    draw: Callable[[Measured, Path], list[Picture]]


def select(rows: list[Row], **wanted: str | float) -> list[Row]:
    """Return the rows in which columns have given values."""
    return [row for row in rows if all(row[key] == value for key, value in wanted.items())]
