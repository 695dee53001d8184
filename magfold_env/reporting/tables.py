"""Rows of what was measured: on the console, in CSV and JSON files, and columns of them."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.table import Table as RichTable

from magfold_env.files import write_text

Cell = str | int | float
Row = dict[str, Cell]

Progress = Callable[[float, str], None]
"""Is told the finished share of a part, 0 to 1, and what is going on."""

Tick = Callable[[float], None]
"""Is told the finished share of one of a part's cases, 0 to 1."""


@dataclass(frozen=True)
class Table:
    """Rows for the console, all with the same keys."""

    title: str
    rows: list[Row]


@dataclass(frozen=True)
class Measurement:
    """One part's measurements."""

    name: str
    """Also the name of its files."""
    rows: list[Row]
    """Everything measured, for CSV and JSON."""
    tables: list[Table] = field(default_factory=list["Table"])
    """What of it is worth reading."""
    findings: list[str] = field(default_factory=list[str])
    """Requirements and how they are met, a sentence each."""


def begin_case(progress: Progress, k: int, count: int, what: str) -> Tick:
    """Tell that the k-th of ``count`` cases begins, and return what takes its progress."""

    def tick(share: float) -> None:
        progress((k + share) / count, what)

    tick(0.0)
    return tick


WHOLE = 1000.0  # larger numbers are shown without decimals


def show(console: Console, machine: Mapping[str, str], parts: Sequence[Measurement]) -> None:
    """Print the tables, then what follows from them."""
    for part in parts:
        for table in part.tables:
            console.print(rich_table(table))
    for part in parts:
        for finding in part.findings:
            console.print(f"• {escape(finding)}", highlight=False)
    console.print(
        escape(", ".join(f"{key} {value}" for key, value in machine.items())), style="dim"
    )


def rich_table(table: Table) -> RichTable:
    """Return a table for the console, numbers to three figures."""
    shown = RichTable(title=escape(table.title))
    texts = [[escape(_text(cell)) for cell in row.values()] for row in table.rows]
    for k, (name, cell) in enumerate(table.rows[0].items()):
        justify = "left" if isinstance(cell, str) else "right"
        # Headings may be broken, cells not.
        shown.add_column(escape(name), justify=justify, min_width=max(len(row[k]) for row in texts))
    for row in texts:
        shown.add_row(*row)
    return shown


def write(
    folder: Path, name: str, machine: Mapping[str, str], parts: Sequence[Measurement]
) -> list[Path]:
    """Write a CSV file a part and one JSON file, ``name``, with everything; return the files."""
    written: list[Path] = []
    for part in parts:
        if part.rows:
            path = folder / f"{part.name}.csv"
            write_text(path, to_csv(part.rows))
            written.append(path)
    path = folder / f"{name}.json"
    write_text(path, to_json(machine, parts))
    return [*written, path]


def to_csv(rows: Sequence[Row]) -> str:
    """Return rows as CSV text with a line of column names."""
    text = io.StringIO()
    writer = csv.DictWriter(text, fieldnames=list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def to_json(machine: Mapping[str, str], parts: Sequence[Measurement]) -> str:
    """Return everything as JSON text; numbers that JSON cannot hold are null."""
    data = {
        "machine": dict(machine),
        "parts": {
            part.name: {
                "findings": part.findings,
                "rows": [{k: _plain(cell) for k, cell in row.items()} for row in part.rows],
            }
            for part in parts
        },
    }
    return json.dumps(data, indent=1, allow_nan=False, ensure_ascii=False) + "\n"


def _plain(cell: Cell) -> Cell | None:
    return None if isinstance(cell, float) and not math.isfinite(cell) else cell


def _text(cell: Cell) -> str:
    if isinstance(cell, str):
        return cell
    if not math.isfinite(cell):
        return "never"
    return f"{cell:.0f}" if isinstance(cell, int) or abs(cell) >= WHOLE else f"{cell:.3g}"
