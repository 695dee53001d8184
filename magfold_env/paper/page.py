"""The page: every reproduction beside what the paper states, with a verdict for each statement."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, get_args

from magfold_env.paper.reproduction import Claim, Measured, Outcome, Reproduction
from magfold_env.reporting.page import Block, Entries, Page, Picture, Points, Section
from magfold_env.reporting.tables import Row, Table

TITLE = "“On planar self-folding magnetic chains”, reproduced"

_LEAD = (
    "T.H. Fass, G. Hao and P. Cantillon-Murphy compare two ways to predict how a chain of square "
    "casings with magnets folds itself: by energy minimisation and by simulation. This page puts "
    "the counterpart of each of their figures and tables whose content the text gives beside what "
    "the text says about it. Every statement that can be compared has a verdict, computed from "
    "the numbers measured for this page.",
    "What to keep in mind: the drawings of the paper's sequences and casing are not at hand. The "
    "three sequences are reconstructions that satisfy what its text says about their energies; "
    "where that makes an agreement no evidence, the verdict says so. Masses, sizes and how much "
    "releases by hand differ are assumed.",
    "A fold is a word over L (+90°), S (0°) and R (−90°), one letter a joint from component 1 on. "
    "Folded: at rest with every joint at ±90°; misfolded: at rest otherwise.",
)
_LEFT_OUT = (
    "Figures 1, 10 and 17: photographs, the latter two of experiments.",
    "Figures 2 and 3: the dimensions of a component and the poles of the sequences, which the text "
    "does not give. Nothing on this page has the paper's own sequences.",
    "Figures 4, 5 and 9: pseudo-code. Table 1 and Figure 7 run what 4 and 5 say, Figures 11 to 14 "
    "what 9 says.",
    "Figure 8 and Table 2: symbols of equation 39.",
)
_QUICK = (
    "Made with --quick: shorter series, fewer rounds of timing. It shows that everything works; "
    "numbers to quote come from a run without it."
)


class Done(NamedTuple):
    """A reproduction with what was measured, when and where."""

    part: Reproduction
    measured: Measured
    machine: dict[str, str]
    """`reporting.machine.describe` when it was measured."""
    seconds: float
    """How long that took."""
    pictures: list[Picture]

    @property
    def claims(self) -> list[Claim]:
        """What is compared."""
        return self.part.claims(self.measured)


def page(done: Sequence[Done], *, quick: bool) -> Page:
    """Return the page for the reproductions that are done, at least one."""
    lead: list[Block] = list(_LEAD)
    if quick:
        lead.append(_QUICK)
    lead.append(overview(done))
    sections = [*(_section(each) for each in done), Section("Not reproduced", [Points(_LEFT_OUT)])]
    return Page(TITLE, sections, lead, done[-1].machine)


def overview(done: Sequence[Done]) -> Table:
    """Return how many statements agree, figure by figure."""
    rows: list[Row] = []
    for each in done:
        outcomes = [claim.outcome for claim in each.claims]
        counts: Row = {outcome: outcomes.count(outcome) for outcome in get_args(Outcome)}
        rows.append({"": each.part.title, **counts})
    return Table("Statements of the paper: how many of them", rows)


def _section(done: Done) -> Section:
    part = done.part
    texts = {"The paper": part.shows, "Here": part.computed, "Not covered": part.missing}
    made = f"{done.machine['time']}, in {done.seconds:.0f} s, commit {done.machine['commit']}"
    again = {"Measured": made, "Again": f"magfold paper --only {part.name}"}
    blocks: list[Block] = [Entries(texts), *done.pictures]
    blocks += part.tables(done.measured)
    blocks += [claim.to_verdict() for claim in done.claims]
    blocks.append(Entries(again))
    return Section(part.title, blocks)
