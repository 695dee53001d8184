"""Results of a campaign as tables and JSON."""

import json
from pathlib import Path

from rich.markup import escape
from rich.table import Table

from magfold_bench.stress.kinds import KINDS
from magfold_bench.stress.verdict import Tally, Verdict
from magfold_env.cli import options
from magfold_env.files import write_text
from magfold_env.reporting import machine

STATUSES = ("folded", "misfolded", "held", "jammed", "unsettled", "failed")
SHOWN = 5  # number of failing cases listed per law


def kinds_table(tally: Tally) -> Table:
    """Return how the cases of each kind end, and the number of cases that break a law."""
    notes = [f"{count} {note}" for note, count in tally.notes.items()]
    table = options.table(
        f"{tally.cases} cases, {tally.seconds:.0f} s of processor time",
        {"kind": False, "what is drawn": False}
        | dict.fromkeys(("cases", *STATUSES, "break a law"), True),
        f"Set aside, because some laws do not apply: {'; '.join(notes) or 'none'}.",
    )
    failing = [failure["kind"] for failure in tally.failures]
    for kind, counts in tally.statuses.items():
        count = failing.count(kind)
        ends = [str(counts[status]) for status in STATUSES]
        cells = (kind, KINDS[kind].draws, str(counts.total()), *ends, str(count))
        table.add_row(*cells, style="red" if count else "")
    table.add_section()
    sums = [str(sum(c[status] for c in tally.statuses.values())) for status in STATUSES]
    table.add_row("all", "", str(tally.cases), *sums, str(len(tally.failures)))
    return table


def laws_table(tally: Tally) -> Table:
    """Return, for each law, the numbers of cases in which it was checked and was broken."""
    numbers = dict.fromkeys(("judged", "broken", "nearest to breaking"), True)
    table = options.table("Laws", {"law": False, **numbers, f"cases (up to {SHOWN})": False})
    for law, count in tally.held.items():
        names = [f["case"] for f in tally.failures if law in {each for each, _ in f["broken"]}]
        share, _ = tally.worst.get(law, (0.0, ""))
        near = f"{share:.1g} of the allowed value" if share else ""
        listed = ", ".join(names[:SHOWN])
        style = "red" if names else ""
        table.add_row(law, str(count), str(len(names)), near, listed, style=style)
    return table


def verdict_table(name: str, verdict: Verdict) -> Table:
    """Return the laws that one scene keeps and breaks."""
    title = escape(f"{name}: {verdict.status}, {verdict.message}")
    columns = ("law", "share of the allowed value", "broken by")
    table = options.table(title, dict.fromkeys(columns, False), "; ".join(verdict.notes) or None)
    for law, share in verdict.worst.items():
        words = "; ".join(str(each) for each in verdict.broken if each.law == law)
        table.add_row(law, f"{share:.2g}", escape(words), style="red" if words else "")
    return table


def write(tally: Tally, folder: Path) -> Path:
    """Write everything as JSON, and return the file."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "stress.json"
    data = {"machine": dict(machine.describe()), "cases": tally.cases, **vars(tally)}
    write_text(path, json.dumps(data, indent=1, allow_nan=False) + "\n")
    return path
