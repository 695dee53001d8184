"""Counterparts of the paper's figures and tables: numbers, claims, tables and plots."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Literal, NamedTuple, Self

from magfold_bench.tables import Progress, Row, Table
from magfold_env.reporting.page import Tone, Verdict
from magfold_env.reporting.plotting import save_figure

Measured = dict[str, list[Row]]
"""Rows of plain values by name; rows under one name have equal keys."""


Outcome = Literal["agrees", "agrees by construction", "disagrees", "cannot be compared"]

Subject = Literal["Energy minimisation", "The solver", "Where releases end"]

BUILT_IN = (
    "The sequences, which the text does not give, were reconstructed so that this holds; it is no "
    "evidence."
)
_TONES: dict[Outcome, Tone] = {"agrees": "good", "disagrees": "bad"}


class Claim(NamedTuple):
    """A statement in the paper, and this project's result."""

    stated: str
    """The statement in this project's words."""
    found: str
    """The result with the measured numbers."""
    holds: bool | None
    """Whether the numbers agree; None if they cannot be compared."""
    why: str = ""
    """The reason, if one is known."""
    built_in: bool = False
    """Whether the sequences were reconstructed so that the statement holds."""
    inputs: str = ""
    """Assumed or reconstructed values on which the verdict depends."""

    @classmethod
    def unless(cls, stated: str, found: str, holds: bool, why_not: str) -> Self:
        """Return a claim that gives ``why_not`` as its reason only if it does not hold."""
        return cls(stated, found, holds, "" if holds else why_not)

    @property
    def outcome(self) -> Outcome:
        """The verdict of the comparison."""
        if self.holds is None:
            return "cannot be compared"
        if not self.holds:
            return "disagrees"
        return "agrees by construction" if self.built_in else "agrees"

    def to_verdict(self) -> Verdict:
        """Return the claim as a block of a page."""
        why = BUILT_IN if self.outcome == "agrees by construction" else self.why
        texts = {"Here": self.found, "Why": why, "Depends on": self.inputs}
        more = [f"{name}: {text}" for name, text in texts.items() if text]
        tone = _TONES.get(self.outcome, "plain")
        return Verdict(self.outcome.capitalize(), f"The paper: {self.stated}", tone, more)


class Plot(NamedTuple):
    """A picture that can be drawn."""

    name: str
    """Name of the picture's PNG file."""
    caption: str
    save: Callable[[Path], object]
    """Draws the picture into a file."""

    @classmethod
    def of(cls, name: str, figure: Any, caption: str) -> Self:
        """Return the picture of a matplotlib figure."""
        return cls(name, caption, partial(save_figure, figure))


@dataclass(frozen=True)
class Reproduction:
    """The counterpart of a figure or a table."""

    name: str
    """Name for ``--only`` and for the files."""
    title: str
    subject: Subject
    shows: str
    """What the paper shows."""
    computed: str
    """What is computed here."""
    missing: str
    """What is not covered."""
    measure: Callable[[bool, Progress], Measured]
    """Measures everything, or less if quick; tables, claims and plots use the result."""
    tables: Callable[[Measured], list[Table]]
    claims: Callable[[Measured], list[Claim]]
    plots: Callable[[Measured], list[Plot]]
    inputs: str = ""
    """Assumptions behind those verdicts whose claims name none."""

    def verdicts(self, measured: Measured) -> list[Claim]:
        """Return the claims, each with its assumptions."""
        made = self.claims(measured)
        return [claim._replace(inputs=claim.inputs or self.inputs) for claim in made]
