"""The suite's report: one page that tells a reader who knows no code what was found, and how."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from magfold_env.benchmarks.results import LEFT_OUT, Effort, Entry, Result
from magfold_env.reporting.page import (
    Block,
    Entries,
    Page,
    Picture,
    Points,
    Section,
    Tone,
    Verdict,
)
from magfold_env.reporting.tables import Row, Table

LEAD = (
    "This page is made by one command, which runs every benchmark of magfold_env: a simulator of "
    "chains of square casings with magnets that fold themselves when they leave a tube. Each "
    "section is one measurement: what was measured, how, what it means and what it does not "
    "cover, then what was found, in sentences, tables and diagrams.",
    "Contenders that are compared take turns, round after round, because a machine's pace "
    "drifts; ratios are taken within a round, and the two numbers in brackets after a median are "
    "the quartiles over the rounds. Times are of one core, and are processor time where not said "
    "otherwise. Times from different sections compare only as far as the machine kept its pace: "
    "fixed work, timed before and after each part, tells how far it did.",
)
SHORT = (
    "A quick run: fewer cases, lengths and rounds, to see that everything works. Its numbers are "
    "not to be quoted."
)
WORDS: dict[Tone, str] = {"good": "holds", "bad": "falls short"}


def page(
    effort: Effort,
    plan: Sequence[Entry],
    done: Mapping[str, Result],
    missing: Mapping[str, str],
    machine: Mapping[str, str],
    folder: Path,
) -> Page:
    """Return the report.

    Parameters
    ----------
    plan
        What was to be measured, in order.
    done, missing
        What was measured, and why the rest was not, by name.
    machine
        On what it was measured.
    folder
        Where the diagrams lie.
    """
    usual = float(np.median([pace for each in done.values() for pace in each.pace] or [1.0]))
    sections = [
        _section(entry, done[entry.title], effort, usual, folder)
        if entry.title in done
        else _absent(entry, missing[entry.title])
        for entry in plan
    ]
    lead: list[Block] = [*LEAD] if effort == "full" else [SHORT, *LEAD]
    lead.append(_overview(plan, done))
    short = [
        f"{entry.title}: {finding}"
        for entry in plan
        if entry.title in done
        for finding in done[entry.title].found.findings
        if tone(finding) == "bad"
    ]
    if short:
        lead += ["What falls short of what was asked for:", Points(short)]
    if effort == "quick":
        left = [f"{name}: {why}" for name, why in LEFT_OUT.items()]
        lead += ["Left out of a quick run:", Points(left)]
    taken = sum(each.seconds for each in done.values())
    provenance = {
        "command": f"magfold bench --{effort}",
        "parts measured": f"{len(done)} of {len(plan)}, in {taken:.0f} s",
        **machine,
    }
    return Page(f"magfold_env: benchmarks, {effort} run", sections, lead, provenance)


def tone(finding: str) -> Tone:
    """Return whether a sentence says that something asked for is met, or missed, or neither."""
    counted = re.search(r"\bholds for (\d+) of (\d+)", finding)
    if re.search(r"\bFAILS\b|\bNOT\b", finding) or (counted and counted[1] != counted[2]):
        return "bad"
    return "good" if re.search(r"\bholds\b|\bwithin \d+ s$", finding) else "plain"


def _overview(plan: Sequence[Entry], done: Mapping[str, Result]) -> Table:
    rows: list[Row] = []
    for entry in plan:
        each = done.get(entry.title)
        tones = [tone(finding) for finding in each.found.findings] if each else []
        rows.append(
            {
                "part": entry.title,
                "what": entry.description.title,
                "took [s]": f"{each.seconds:.1f}" if each else "not measured",
                "holds": tones.count("good"),
                "falls short": tones.count("bad"),
            }
        )
    return Table("The parts, and how many requirements each meets", rows)


def _section(entry: Entry, result: Result, effort: Effort, usual: float, folder: Path) -> Section:
    description, found = entry.description, result.found
    before, after = (pace / usual for pace in result.pace)
    blocks: list[Block] = [
        Entries(
            {
                "Measured": description.measured,
                "How": description.how,
                "What it means": description.meaning,
                "Not covered": description.missing,
                "Again": entry.command + (" --quick" if effort == "quick" else ""),
                "Pace": f"fixed work took {before:.2f} times its usual time before this part and "
                f"{after:.2f} times after it",
            }
        )
    ]
    plain: list[str] = []
    for finding in found.findings:
        kind = tone(finding)
        if kind == "plain":
            plain.append(finding)
        else:
            blocks.append(Verdict(WORDS[kind], finding, kind))
    if plain:
        blocks.append(Points(plain))
    picture = folder / entry.benchmark / f"{entry.name}.png"
    if found.rows and picture.is_file():
        blocks.append(Picture(picture, description.title))
    blocks += found.tables
    return Section(f"{description.title} ({entry.title})", blocks)


def _absent(entry: Entry, reason: str) -> Section:
    return Section(
        f"{entry.description.title} ({entry.title})",
        [entry.description.measured, Verdict("not measured", reason, "bad")],
    )
