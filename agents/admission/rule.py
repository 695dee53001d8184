"""The admission rule: by how much players must differ to show that a task needs its physics.

Intervals are 95 % intervals over episodes and, if there are several training seeds, over seeds; the
tasks are fixed. Differences are paired, because both players play the same draws.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from agents.admission.players import BLIND, FROZEN, OPEN_LOOP, ORACLE, RANDOM, TRAINED
from agents.evaluation import intervals
from magfold_env.reporting.intervals import share
from magfold_env.scoring.results import Row

Ends = Mapping[str, intervals.Floats]
"""Every player's success and score, (runs, episodes, 2), by the player's name."""

SOLVED = 0.03
"""Headroom (see `Verdict`) below which a task counts as solved."""


@dataclass(frozen=True)
class Line:
    """A condition of the rule: one player must succeed more often than another."""

    ahead: str
    behind: str
    least: float
    """Required difference of the success rates."""
    surely: bool = False
    """Whether the whole interval of the difference must also be above 0."""
    measured: intervals.Estimate | None = None
    """Measured difference; None if either player has not played."""

    @property
    def holds(self) -> bool | None:
        """Whether the condition holds; None if it was not measured."""
        if self.measured is None:
            return None
        sure = not self.surely or bool(self.measured.low > 0.0)
        return sure and bool(self.measured.value >= self.least)

    def __str__(self) -> str:
        """Return the condition as text."""
        by = f" + {100 * self.least:.0f} points" if self.least else ""
        rest = ", its interval above 0" if self.surely else ""
        return f"{self.ahead} ≥ {self.behind}{by}{rest}"


RULE = (
    Line(ORACLE, OPEN_LOOP, 0.10),
    Line(TRAINED, OPEN_LOOP, 0.05, surely=True),
    Line(TRAINED, BLIND, 0.05),
    Line(TRAINED, FROZEN, 0.0),
)


@dataclass(frozen=True)
class Verdict:
    """The result of the rule."""

    rows: dict[str, Row]
    """Results of players. Intervals are Wilson's for a single run, else the bootstrap's. The figure
    ``normalised`` is the mean score, rescaled so that random actions score 0 and the oracle 1; it
    is None if the oracle is no better than random actions."""
    lines: list[Line]
    headroom: intervals.Estimate | None
    """The oracle's success minus the trained policies' success; None without trained policies."""

    @property
    def decision(self) -> str:
        """The verdict: whether the task is admitted and, if so, whether it is solved."""
        held = [line.holds for line in self.lines]
        if False in held:
            return "not admitted"
        if None in held:
            return "not measured as a whole"
        solved = self.headroom is not None and self.headroom.value < SOLVED
        return "admitted, solved" if solved else "admitted"


def judge(ends: Ends) -> Verdict:
    """Return the verdict on players' results, which must include random actions and the oracle."""
    low, high = (float(ends[name][..., 1].mean()) for name in (RANDOM, ORACLE))
    rows = {
        name: Row(
            success=_share(each[..., 0]),
            score=(score := float(each[..., 1].mean())),
            figures={"normalised": (score - low) / (high - low) if high > low else None},
        )
        for name, each in ends.items()
    }
    lines = [replace(line, measured=_ahead(ends, line.ahead, line.behind)) for line in RULE]
    return Verdict(rows, lines, _ahead(ends, ORACLE, TRAINED))


def by_task(ends: intervals.Floats, numbers: Sequence[int]) -> dict[int, float | None]:
    """Return a player's success rate by the task's number; None if the task was not played.

    The episodes cycle through the tasks.
    """
    parts = (ends[:, place :: len(numbers), 0] for place in range(len(numbers)))
    return {
        number: float(part.mean()) if part.size else None
        for number, part in zip(numbers, parts, strict=True)
    }


def _ahead(ends: Ends, name: str, other: str) -> intervals.Estimate | None:
    """Return the lead of one player's success over another's, paired by episode."""
    if name not in ends or other not in ends:
        return None
    better, worse = ends[name][..., 0], ends[other][..., 0]
    if other == FROZEN:  # the same policies, so each run is compared with itself
        return intervals.estimate(better - worse, None)
    return intervals.difference(better, worse, None)


def _share(success: intervals.Floats) -> intervals.Estimate:
    if len(success) > 1:
        return intervals.estimate(success, None)
    found = share(int(success.sum()), success.size)
    return intervals.Estimate(found.rate, found.low, found.high)


def markdown(verdict: Verdict) -> str:
    """Return the players' results and the rule's conditions as tables in Markdown."""
    text = ["| | success | score | normalised |", "|---|---|---|---|"]
    for name, row in verdict.rows.items():
        success = intervals.Estimate(*row.success)
        score = row.figures["normalised"]
        normalised = "–" if score is None else f"{score:.2f}"
        text.append(f"| {name} | {success} | {row.score:.3f} | {normalised} |")
    text += ["", "| rule | measured, points | |", "|---|---|---|"]
    words = {True: "holds", False: "fails", None: "not measured"}
    text += [
        f"| {line} | {line.measured.points() if line.measured else '–'} | {words[line.holds]} |"
        for line in verdict.lines
    ]
    headroom = verdict.headroom.points() if verdict.headroom else "–"
    text += [
        f"| headroom: {ORACLE} − {TRAINED} | {headroom} | |",
        "",
        f"Verdict: {verdict.decision}.",
    ]
    return "\n".join(text) + "\n"
