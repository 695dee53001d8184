"""Measure the selected parts; write numbers, pictures and the page that shows them.

The page shows every reproduction with the paper's statements and a verdict on each.
"""

import json
import time
from collections import Counter
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple, get_args

from magfold_bench import tables
from magfold_bench.paper import energies, figure_18, figures_11_12, figures_13_14, pendulum
from magfold_bench.paper.reproduction import Claim, Measured, Outcome, Reproduction, Subject
from magfold_bench.tables import Progress, Row, Table
from magfold_env.checkpoint import Checkpoint
from magfold_env.files import physics_digest, write_text
from magfold_env.reporting import machine
from magfold_env.reporting.page import (
    Block,
    Details,
    Entries,
    Page,
    Picture,
    Points,
    Section,
    write_page,
)
from magfold_env.reporting.tables import to_csv

PAGE, NUMBERS = "paper.html", "paper.json"

PARTS = {
    part.name: part
    for part in (
        energies.TABLE_1, energies.FIGURE_7, figures_11_12.FIGURE_11, figures_11_12.FIGURE_12,
        figures_13_14.FIGURES_13_14, pendulum.FIGURE_15, pendulum.FIGURE_16, figure_18.FIGURE_18,
        energies.FIGURE_19,
    )
}  # fmt: skip
"""All figures and tables that are reproduced, in the paper's order."""


class Done(NamedTuple):
    """A reproduction with its measurements, time and machine."""

    part: Reproduction
    measured: Measured
    machine: dict[str, str]
    """Result of `reporting.machine.describe` at the time of the measurement."""
    seconds: float
    """Duration of the measurement."""
    pictures: list[Picture]

    @property
    def claims(self) -> list[Claim]:
        """The claims that are compared, with their assumptions."""
        return self.part.verdicts(self.measured)


def run(only: Sequence[str], quick: bool, out: Path, progress: Progress) -> list[Done]:
    """Measure the named parts, or all; write the files, and return the content of the page.

    Finished parts in the folder are not measured again but are shown on the page. Parts that
    another version measured are refused.
    """
    chosen = tables.chosen(PARTS, only)
    out.mkdir(parents=True, exist_ok=True)
    state = out / "state" / ("quick" if quick else "full")
    key = {"quick": quick, "physics": physics_digest(), "magfold_env": version("magfold_env")}
    with Checkpoint(state, key) as kept:
        done = {name: _done(PARTS[name], record, out) for name, record in kept.load()}
        todo = [part for name, part in chosen.items() if name not in done]
        written = _write(done, quick, out) if done else []
        for k, part in enumerate(todo):

            def tell(share: float, what: str, k: int = k, name: str = part.name) -> None:
                progress((k + min(share, 1.0)) / len(todo), f"{name}: {what}")

            tell(0.0, "begins")
            system, begun = machine.describe(), time.perf_counter()
            measured = part.measure(quick, tell)
            seconds = time.perf_counter() - begun
            record = {"machine": system, "seconds": seconds, "measured": measured}
            kept.add([part.name, record])
            kept.save()
            done[part.name] = _done(part, record, out)
            written = _write(done, quick, out)
        return written


def _done(part: Reproduction, record: dict[str, Any], out: Path) -> Done:
    """Write a part's pictures and tables of numbers, and return its results."""
    measured: Measured = record["measured"]
    for name, rows in measured.items():
        if rows:
            write_text(out / f"{part.name}-{name}.csv", to_csv(rows))
    pictures: list[Picture] = []
    for plot in part.plots(measured):
        pictures.append(Picture(out / f"{plot.name}.png", plot.caption))
        plot.save(pictures[-1].path)
    return Done(part, measured, record["machine"], record["seconds"], pictures)


def _write(done: dict[str, Done], quick: bool, out: Path) -> list[Done]:
    """Write the page and all numbers; return the content of the page, in the paper's order."""
    shown = [done[name] for name in PARTS if name in done]
    content = {
        each.part.name: {
            "machine": each.machine,
            "seconds": each.seconds,
            "claims": [claim._asdict() for claim in each.claims],
            "measured": each.measured,
        }
        for each in shown
    }
    data = {"quick": quick, "parts": content}
    write_text(
        out / NUMBERS, json.dumps(data, indent=1, allow_nan=False, ensure_ascii=False) + "\n"
    )
    write_page(page(shown, quick=quick), out / PAGE)
    return shown


# --- the page --------------------------------------------------------------------------------

TITLE = "“On planar self-folding magnetic chains”, reproduced"

_LEAD = (
    "T.H. Fass, G. Hao and P. Cantillon-Murphy compare two ways to predict how a chain of square "
    "casings with magnets folds itself: by energy minimisation and by simulation. This page puts "
    "the counterpart of each figure and table whose content the text gives next to what "
    "the text says about it. Every statement that can be compared has a verdict, computed from "
    "the numbers measured for this page.",
    "Keep in mind that the drawings of the paper's sequences and casing are not available. The "
    "three sequences are reconstructions that satisfy what its text says about their energies; "
    "where agreement is therefore no evidence, the verdict says so. Masses, sizes and how much "
    "releases by hand differ are assumed.",
    "A fold is a word over L (+90°), S (0°) and R (−90°), one letter per joint from component 1. "
    "Folded means at rest with every joint at ±90°; misfolded means at rest otherwise.",
)
_LEFT_OUT = (
    "Figures 1, 10 and 17: photographs, the latter two of experiments.",
    "Figures 2 and 3: the dimensions of a component and the poles of the sequences, which the text "
    "does not give. Nothing on this page uses the paper's own sequences.",
    "Figures 4, 5 and 9: pseudo-code. Table 1 and Figure 7 run Figures 4 and 5, and Figures 11 to "
    "14 run Figure 9.",
    "Figure 8 and Table 2: symbols of equation 39.",
)
_QUICK = (
    "Made with --quick: shorter series and fewer rounds of timing. It shows that everything works; "
    "quote only numbers from a run without it."
)


def page(done: Sequence[Done], *, quick: bool) -> Page:
    """Return the page for the finished reproductions, at least one."""
    lead: list[Block] = [Points(_answers(done)), overview(done)]
    if quick:
        lead.append(_QUICK)
    against = [
        f"{_name(each)}: {claim.stated} Here: {claim.found}"
        for each in done
        for claim in each.claims
        if claim.outcome == "disagrees"
    ]
    if against:
        lead.append(Details(f"Disagreements ({len(against)})", [Points(against)]))
    lead.append(Details("What is compared, and what to keep in mind", _LEAD))
    sections = [*(_section(each) for each in done), Section("Not reproduced", [Points(_LEFT_OUT)])]
    return Page(TITLE, sections, lead, done[-1].machine)


def _answers(done: Sequence[Done]) -> list[str]:
    """Return a summary of the verdicts on each subject."""
    said: list[str] = []
    for subject in get_args(Subject):
        mine = [each for each in done if each.part.subject == subject]
        counts = Counter(claim.outcome for each in mine for claim in each.claims)
        told = [f"{counts[word]} × {word}" for word in get_args(Outcome) if counts[word]]
        if told:
            said.append(f"{subject} ({', '.join(map(_name, mine))}): {', '.join(told)}.")
    return said


def _name(done: Done) -> str:
    """Return the paper's name for the part."""
    return done.part.title.partition(":")[0]


def overview(done: Sequence[Done]) -> Table:
    """Return the number of statements with each verdict, by figure."""
    rows: list[Row] = []
    for each in done:
        outcomes = [claim.outcome for claim in each.claims]
        counts: Row = {outcome: outcomes.count(outcome) for outcome in get_args(Outcome)}
        rows.append({"": each.part.title, **counts})
    return Table("Number of the paper's statements by verdict", rows)


def _section(done: Done) -> Section:
    part = done.part
    texts = {"The paper": part.shows, "Here": part.computed, "Not covered": part.missing}
    made = f"{done.machine['time']}, in {done.seconds:.0f} s, commit {done.machine['commit']}"
    again = {"Measured": made, "Again": f"magfold paper --only {part.name}"}
    return Section(
        part.title,
        [
            *(claim.to_verdict() for claim in done.claims),
            *done.pictures[:1],
            Details(
                "Further pictures, and numbers",
                [*done.pictures[1:], *part.tables(done.measured)],
            ),
            Details("What the paper shows, and what was done here", [Entries(texts | again)]),
        ],
    )
