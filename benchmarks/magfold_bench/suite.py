"""Run every benchmark, store finished parts, and report everything on one page.

The speed of a shared machine changes, and times measured an hour apart are comparable only if the
speed stayed the same. The same fixed work is therefore timed before and after every part: a
pendulum's swing (see `bare_pendulum`), which, like the engine's kernels, is compiled arithmetic on
numbers that fit into the cache.
"""

from __future__ import annotations

import json
import math
import re
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
from rich.markup import escape

from magfold_bench import parts, tables, timing
from magfold_bench.bare_pendulum import prepare_swing
from magfold_bench.presentation import Description, descriptions
from magfold_bench.skipping import variants
from magfold_bench.tables import Measurement, Row, Table
from magfold_env.checkpoint import Checkpoint
from magfold_env.cli import options
from magfold_env.files import sources_digest, write_text
from magfold_env.reporting import machine, page, plotting

Effort = Literal["quick", "full"]

PAGE, RESULTS = "report.html", "bench.json"
PACE_ROUNDS = 9
LEFT_OUT = {"dynamics first-use": "it compiles the engine again, which takes most of a minute"}
"""Parts that `--quick` omits, and why."""

LEAD = (
    "One command made this page. It runs every benchmark of magfold_env, a simulator of "
    "chains of square casings with magnets that fold themselves when they leave a tube.",
    "Contenders that are compared take turns, round after round, because a machine's pace "
    "drifts. Ratios are taken within a round, and the two numbers in brackets after a median are "
    "the quartiles over the rounds. Times are processor times of one core, unless stated "
    "otherwise. Times from different sections are comparable only if the machine kept its pace: "
    "fixed work, timed before and after each part, shows whether it did.",
)
SHORT = (
    "A quick run has fewer cases, lengths and rounds, to check that everything works. Do not "
    "quote its numbers."
)
WORDS: dict[page.Tone, str] = {"good": "holds", "bad": "falls short"}

PASSING = ("time", "load before")  # what changes from minute to minute


class Entry(NamedTuple):
    """One part of one benchmark."""

    benchmark: str
    name: str
    part: parts.Part
    description: Description

    @property
    def title(self) -> str:
        """Names of the benchmark and the part."""
        return f"{self.benchmark} {self.name}"

    @property
    def heading(self) -> str:
        """Heading of the part in the report."""
        return f"{self.description.title} ({self.title})"


class Result(NamedTuple):
    """The results of one part of the suite."""

    name: str  # of the benchmark and the part
    found: Measurement
    seconds: float  # wall-clock time of the part
    pace: tuple[float, float]  # time of the fixed work just before and just after the part [s]

    def to_json(self) -> dict[str, Any]:
        """Return the results as JSON values; numbers that are not finite become null."""
        plain, found = tables.plain, self.found
        shown = [{"title": each.title, "rows": plain(each.rows)} for each in found.tables]
        found = {"rows": plain(found.rows), "tables": shown, "findings": found.findings}
        return {"name": self.name, "seconds": self.seconds, "pace": list(self.pace), **found}

    @classmethod
    def from_json(cls, data: dict[str, Any]) -> Result:
        """Return the results that `to_json` turned into JSON; null becomes NaN."""
        shown = [Table(each["title"], _rows(each["rows"])) for each in data["tables"]]
        found = Measurement(_rows(data["rows"]), shown, data["findings"])
        before, after = data["pace"]
        return cls(data["name"], found, data["seconds"], (before, after))


def _rows(rows: list[dict[str, Any]]) -> list[Row]:
    return [{k: math.nan if cell is None else cell for k, cell in row.items()} for row in rows]


def entries(effort: Effort) -> list[Entry]:
    """Return the parts of a run, in order."""
    found = [
        Entry(benchmark, name, part, descriptions()[benchmark].parts[name])
        for benchmark, measured in parts.BENCHMARKS.items()
        for name, part in measured.items()
    ]
    return [each for each in found if effort == "full" or each.title not in LEFT_OUT]


# --- a run --------------------------------------------------------------------------------------


def identify() -> dict[str, str]:
    """Return the key of a run, which includes a hash of the sources of both packages."""
    same = {key: value for key, value in machine.describe().items() if key not in PASSING}
    sources = sources_digest("**/*.py") + sources_digest("**/*.py", folder=Path(__file__).parent)
    return same | {"sources": sources}


def run(effort: Effort, out: Path) -> bool:
    """Measure all parts that are not in the folder yet; return whether all succeeded.

    The folder contains the page, all results as JSON, one folder per benchmark with CSV and PNG
    files, and the finished parts, from which an interrupted run continues. Parts from another
    commit, machine or effort are refused.
    """
    plotting.figure_class()
    console, identity = options.wide_console(), identify()
    plan, missing = entries(effort), dict[str, str]()
    with Checkpoint(out / "state", {"kind": "bench", "effort": effort, **identity}) as kept:
        done = {each.name: each for each in kept.load(Result.from_json)}
        for entry in plan:
            if entry.title in done:
                console.print(f"{entry.title}: kept", highlight=False)
                continue
            try:
                measured = _measure(entry, effort, out / entry.benchmark)
            except Exception as error:  # the other parts must not be lost
                missing[entry.title] = f"{type(error).__name__}: {error}"
                console.print(escape(f"{entry.title}: {missing[entry.title]}"), style="red")
                continue
            done[entry.title] = measured
            kept.add(measured.to_json())
            kept.save()
            console.print(f"{entry.title}: {measured.seconds:.1f} s", highlight=False)
    system = identity | {k: v for k, v in machine.describe().items() if k in PASSING}
    found = [done[entry.title].to_json() for entry in plan if entry.title in done]
    everything = {"machine": system, "effort": effort, "missing": missing, "parts": found}
    write_text(out / RESULTS, json.dumps(everything, indent=1, allow_nan=False) + "\n")
    page.write_page(_page(effort, plan, done, missing, system, out), out / PAGE)
    options.say_written(out / PAGE, out / RESULTS)
    return not missing


def _measure(entry: Entry, effort: Effort, folder: Path) -> Result:
    """Measure a part, and write its CSV file and its diagram."""
    before, begun = measure_pace().median, time.perf_counter()
    found = parts.measure(entry.title, entry.part, effort == "quick")
    seconds = time.perf_counter() - begun
    folder.mkdir(exist_ok=True)
    parts.write(entry.name, entry.part, found, folder)
    return Result(entry.title, found, seconds, (before, measure_pace().median))


def measure_pace() -> timing.Spread:
    """Return the time of the fixed work [s]."""
    scene = variants()[-1].scene
    return timing.take_turns({"swing": lambda: prepare_swing(scene)}, PACE_ROUNDS)["swing"].spread


# --- its page -----------------------------------------------------------------------------------


def _page(
    effort: Effort,
    plan: Sequence[Entry],
    done: Mapping[str, Result],
    missing: Mapping[str, str],
    system: Mapping[str, str],
    folder: Path,
) -> page.Page:
    """Return the report on the parts in `done`; `missing` states why others are missing, by title.

    Diagrams are read from the folder.
    """
    usual = float(np.median([pace for each in done.values() for pace in each.pace] or [1.0]))
    sections: list[page.Section] = []
    for entry in plan:
        if entry.title in done:
            sections.append(_section(entry, done[entry.title], effort, usual, folder))
        else:
            absent = page.Verdict("not measured", missing[entry.title], "bad")
            sections.append(page.Section(entry.heading, [entry.description.measured, absent]))
    said = [(each.name, finding) for each in done.values() for finding in each.found.findings]
    met = sum(tone(finding) == "good" for _, finding in said)
    short = [f"{title}: {finding}" for title, finding in said if tone(finding) == "bad"]
    lead: list[page.Block] = [
        f"{met} of {met + len(short)} requirements are met, in {len(done)} of {len(plan)} parts "
        "that were measured.",
        Table("Parts, and the requirements that each meets", [_met(e, done) for e in plan]),
    ]
    if effort == "quick":
        lead.insert(1, SHORT)
        left = [f"{name}: {why}" for name, why in LEFT_OUT.items()]
        lead.append(page.Details("Left out of a quick run", [page.Points(left)]))
    if short:
        lead.append(page.Details(f"Missed requirements ({len(short)})", [page.Points(short)]))
    lead.append(page.Details("About this page and its measurements", LEAD))
    taken = sum(each.seconds for each in done.values())
    provenance = {
        "command": f"magfold bench --{effort}",
        "parts measured": f"{len(done)} of {len(plan)}, in {taken:.0f} s",
        **system,
    }
    return page.Page(f"magfold_env: benchmarks, {effort} run", sections, lead, provenance)


def tone(finding: str) -> page.Tone:
    """Return the tone of a sentence: good for a met requirement, bad for a missed one."""
    counted = re.search(r"\bholds for (\d+) of (\d+)", finding)
    if re.search(r"\bFAILS\b|\bNOT\b", finding) or (counted and counted[1] != counted[2]):
        return "bad"
    return "good" if re.search(r"\bholds\b|\bwithin \d+ s$", finding) else "plain"


def _met(entry: Entry, done: Mapping[str, Result]) -> Row:
    """Return the table row with the numbers of requirements that a part meets and misses."""
    each = done.get(entry.title)
    tones = [tone(finding) for finding in each.found.findings] if each else []
    return {
        "what": entry.description.title,
        "part": entry.title,
        "took [s]": f"{each.seconds:.1f}" if each else "not measured",
        "holds": tones.count("good"),
        "falls short": tones.count("bad"),
    }


def _section(
    entry: Entry, result: Result, effort: Effort, usual: float, folder: Path
) -> page.Section:
    description, found = entry.description, result.found
    again = f"magfold bench {entry.benchmark} --only {entry.name}"
    before, after = (pace / usual for pace in result.pace)
    told = {
        "Measured": description.measured,
        "How": description.how,
        "Not covered": description.missing,
        "Again": again + (" --quick" if effort == "quick" else ""),
        "Pace": f"fixed work took {before:.2f} times its usual time before this part and "
        f"{after:.2f} times after it",
    }
    kinds: dict[str, page.Tone] = {each: tone(each) for each in found.findings}
    blocks: list[page.Block] = [
        page.Verdict(WORDS[kind], each, kind) for each, kind in kinds.items() if kind != "plain"
    ]
    if plain := [each for each, kind in kinds.items() if kind == "plain"]:
        blocks.append(page.Points(plain))
    picture = folder / entry.benchmark / f"{entry.name}.png"
    drawn = [page.Picture(picture, description.title)] if picture.is_file() else []
    blocks += [
        description.meaning,
        page.Details("Diagram and numbers", [*drawn, *found.tables]),
        page.Details("How it was measured", [page.Entries(told)]),
    ]
    return page.Section(entry.heading, blocks)
