"""The admission rule: by how much players must differ to show that a track needs its physics.

The first line of the rule is about a set of tasks, the others about a policy. Intervals are 95 %
intervals from the bootstrap over chains or trays and, if there are several, over training seeds.
Differences are paired, because both players play the same draws.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from agents.admission.players import (
    BLIND,
    FORWARD,
    OPEN_LOOP,
    ORACLE,
    RANDOM,
    SCRIPT,
    TRAINED,
)
from agents.evaluation import intervals
from magfold_env.scoring.results import Row

Ends = Mapping[str, intervals.Floats]
"""Every player's mean success and score, (runs, chains or trays, 2), by the player's name."""


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


TASKS = Line(ORACLE, OPEN_LOOP, 0.10)
"""The condition for a set of tasks."""

POLICY = (
    Line(TRAINED, SCRIPT, 0.05, surely=True),
    Line(TRAINED, BLIND, 0.05, surely=True),
    Line(BLIND, FORWARD, 0.0),
)
"""The conditions for a policy."""

DIFFERENCES = ((TRAINED, OPEN_LOOP), (ORACLE, TRAINED))
"""Differences that are reported without a condition."""


@dataclass(frozen=True)
class Verdict:
    """The result of the rule."""

    rows: dict[str, Row]
    """Results of players. The figure ``normalised`` is the mean score, rescaled so that random
    actions score 0 and the oracle 1; it is None if the oracle is no better than random actions."""
    tasks: Line
    policy: list[Line]
    differences: dict[str, intervals.Estimate | None]
    """The differences of `DIFFERENCES`; None if a player has not played."""

    @property
    def decision(self) -> str:
        """The verdict on the tasks and on the policy."""
        held = [line.holds for line in self.policy]
        tasks = "admitted" if self.tasks.holds else "not admitted"
        policy = "counts" if all(held) else "does not count" if False in held else "not measured"
        return f"tasks {tasks}, policy {policy}"


def by_chain(ends: intervals.Floats, chains: Sequence[int]) -> intervals.Floats:
    """Return a player's mean success and score by chain or tray, (runs, chains or trays, 2).

    `ends` contains them by episode, (runs, episodes, 2). Episodes cycle through the tasks, and
    `chains` contains the number of each task's chain or tray, from 0.
    """
    own = np.resize(chains, ends.shape[1])
    return np.stack([ends[:, own == chain].mean(axis=1) for chain in np.unique(own)], axis=1)


def judge(ends: Ends) -> Verdict:
    """Return the verdict on players' results, which must include random actions and the oracle."""
    low, high = (float(ends[name][..., 1].mean()) for name in (RANDOM, ORACLE))
    rows = {
        name: Row(
            success=intervals.estimate(each[..., 0], None),
            score=(score := float(each[..., 1].mean())),
            figures={"normalised": (score - low) / (high - low) if high > low else None},
        )
        for name, each in ends.items()
    }
    tasks, *policy = (
        replace(line, measured=_ahead(ends, line.ahead, line.behind)) for line in (TASKS, *POLICY)
    )
    differences = {f"{one} − {other}": _ahead(ends, one, other) for one, other in DIFFERENCES}
    return Verdict(rows, tasks, policy, differences)


def _ahead(ends: Ends, name: str, other: str) -> intervals.Estimate | None:
    """Return the lead of one player's success over another's, paired by episode."""
    if name not in ends or other not in ends:
        return None
    return intervals.difference(ends[name][..., 0], ends[other][..., 0], None)


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
        for line in (verdict.tasks, *verdict.policy)
    ]
    text += [
        f"| {name} | {found.points() if found else '–'} | |"
        for name, found in verdict.differences.items()
    ]
    return "\n".join([*text, "", f"Verdict: {verdict.decision}."]) + "\n"
