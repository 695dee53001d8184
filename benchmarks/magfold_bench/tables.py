"""Rows of what was measured: columns of them, and how they are shown, written and judged."""

import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt
from rich.console import Console
from rich.markup import escape
from rich.table import Table as RichTable

from magfold_env.files import write_text
from magfold_env.reporting.tables import Cell, Row, Table, cell_text, to_csv

Progress = Callable[[float, str], None]
"""Receives the finished share of a part, 0 to 1, and the present step."""

Tick = Callable[[float], None]
"""Receives the finished share of one case of a part, 0 to 1."""

Case = TypeVar("Case")


@dataclass(frozen=True)
class Measurement:
    """What one part of a benchmark found."""

    rows: list[Row] = field(default_factory=list[Row])
    """Everything measured, for CSV and JSON."""
    tables: list[Table] = field(default_factory=list[Table])
    """What of it is worth reading."""
    findings: list[str] = field(default_factory=list[str])
    """Requirements and how they are met, a sentence each."""


def each_case(
    progress: Progress, cases: Sequence[Case], name: Callable[[Case], str] = str
) -> Iterator[tuple[Case, Tick]]:
    """Yield cases one after another, each with what takes its progress, and tell its name."""
    for k, case in enumerate(cases):

        def tick(share: float, k: int = k, what: str = name(case)) -> None:
            progress((k + share) / len(cases), what)

        tick(0.0)
        yield case, tick


# --- rows and columns -------------------------------------------------------------------------


def numbers(rows: Sequence[Row], name: str) -> Any:
    """Return a column of numbers."""
    return np.array([float(row[name]) for row in rows])


def distinct(rows: Sequence[Row], name: str) -> list[Any]:
    """Return the cells of a column, each once, in order."""
    return list(dict.fromkeys(row[name] for row in rows))


def select(rows: Sequence[Row], cells: Mapping[str, Any] | None = None, **more: Any) -> list[Row]:
    """Return the rows that have certain cells."""
    wanted = {**(cells or {}), **more}
    return [row for row in rows if all(row[name] == cell for name, cell in wanted.items())]


def without_quartiles(rows: Sequence[Row], *hidden: str) -> list[Row]:
    """Return rows without their quartiles, and without some more columns."""
    return [
        {name: cell for name, cell in row.items() if "quartile" not in name and name not in hidden}
        for row in rows
    ]


def power(x: npt.ArrayLike, y: npt.ArrayLike) -> float:
    """Return with which power of x y grows, by least squares; nan of fewer than two points."""
    if np.size(x) < 2:
        return math.nan
    return float(np.polyfit(np.log(x), np.log(y), 1)[0])


def growth(
    rows: Sequence[Row], since: int, until: float = math.inf, time: str = "time [µs]"
) -> float:
    """Return with which power of "n" a time grows between two lengths; nan if too few."""
    mine = [row for row in rows if since <= float(row["n"]) <= until]
    return power(numbers(mine, "n"), numbers(mine, time))


def verdict(held: object) -> str:
    """Return the word for whether something that was asked for is met."""
    return "holds" if held else "FAILS"


# --- the console and files --------------------------------------------------------------------


def show(console: Console, machine: Mapping[str, str], measured: Mapping[str, Measurement]) -> None:
    """Print the tables, then what follows from them."""
    for each in measured.values():
        for table in each.tables:
            console.print(rich_table(table))
    for each in measured.values():
        for finding in each.findings:
            console.print(f"• {escape(finding)}", highlight=False)
    console.print(
        escape(", ".join(f"{key} {value}" for key, value in machine.items())), style="dim"
    )


def rich_table(table: Table) -> RichTable:
    """Return a table for the console, numbers to three figures."""
    shown = RichTable(title=escape(table.title))
    texts = [[escape(cell_text(cell)) for cell in row.values()] for row in table.rows]
    for k, (name, cell) in enumerate(table.rows[0].items()):
        justify = "left" if isinstance(cell, str) else "right"
        # Headings may be broken, cells not.
        shown.add_column(escape(name), justify=justify, min_width=max(len(row[k]) for row in texts))
    for row in texts:
        shown.add_row(*row)
    return shown


def write(
    folder: Path, name: str, machine: Mapping[str, str], measured: Mapping[str, Measurement]
) -> list[Path]:
    """Write a CSV file a part and one JSON file, ``name``, with everything; return the files."""
    written: list[Path] = []
    for part, each in measured.items():
        if each.rows:
            path = folder / f"{part}.csv"
            write_text(path, to_csv(each.rows))
            written.append(path)
    path = folder / f"{name}.json"
    write_text(path, to_json(machine, measured))
    return [*written, path]


def to_json(machine: Mapping[str, str], measured: Mapping[str, Measurement]) -> str:
    """Return everything as JSON text; numbers that JSON cannot hold are null."""
    data = {
        "machine": dict(machine),
        "parts": {
            part: {
                "findings": each.findings,
                "rows": [{name: plain(cell) for name, cell in row.items()} for row in each.rows],
            }
            for part, each in measured.items()
        },
    }
    return json.dumps(data, indent=1, allow_nan=False, ensure_ascii=False) + "\n"


def plain(cell: Cell) -> Cell | None:
    """Return a cell as JSON has it, null where it is no number.

    NumPy's integers are numbers too, but none that JSON knows.
    """
    if isinstance(cell, str):
        return cell
    if not isinstance(cell, float):
        return int(cell)
    return float(cell) if math.isfinite(cell) else None
