"""Rows of measurements: their columns, output and assessment."""

import csv
import io
import json
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from string import ascii_uppercase
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt
from rich.console import Console
from rich.markup import escape
from rich.table import Table as RichTable

from magfold_env.files import write_text

Cell = str | int | float
Row = dict[str, Cell]

WHOLE = 1000.0  # larger numbers have no decimals

Progress = Callable[[float, str], None]
"""Called with the finished share of a part, 0 to 1, and a description of the current work."""

Tick = Callable[[float], None]
"""Called with the finished share of one case of a part, 0 to 1."""

Case = TypeVar("Case")


@dataclass(frozen=True)
class Table:
    """Rows for the console or a page, all with the same keys, which are the column headings."""

    title: str
    rows: list[Row]


@dataclass(frozen=True)
class Measurement:
    """The results of one part of a benchmark."""

    rows: list[Row] = field(default_factory=list[Row])
    """Everything measured, for CSV and JSON."""
    tables: list[Table] = field(default_factory=list[Table])
    """Tables for readers."""
    findings: list[str] = field(default_factory=list[str])
    """Requirements and whether they are met, one sentence each."""


def each_case(
    progress: Progress, cases: Sequence[Case], name: Callable[[Case], str] = str
) -> Iterator[tuple[Case, Tick]]:
    """Yield each case with a function for its progress, and report its name."""
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
    """Return the distinct cells of a column, in order."""
    return list(dict.fromkeys(row[name] for row in rows))


def select(rows: Sequence[Row], cells: Mapping[str, Any] | None = None, **more: Any) -> list[Row]:
    """Return the rows with given cells."""
    wanted = {**(cells or {}), **more}
    return [row for row in rows if all(row[name] == cell for name, cell in wanted.items())]


def without_quartiles(rows: Sequence[Row], *hidden: str) -> list[Row]:
    """Return rows without their quartiles and without some other columns."""
    return [
        {name: cell for name, cell in row.items() if "quartile" not in name and name not in hidden}
        for row in rows
    ]


def power(x: npt.ArrayLike, y: npt.ArrayLike) -> float:
    """Return the power of x with which y grows, by least squares; NaN for fewer than two points."""
    if np.size(x) < 2:
        return math.nan
    return float(np.polyfit(np.log(x), np.log(y), 1)[0])


def growth(
    rows: Sequence[Row], since: int, until: float = math.inf, time: str = "time [µs]"
) -> float:
    """Return the power of "n" with which a time grows between two lengths; NaN if too few."""
    mine = [row for row in rows if since <= float(row["n"]) <= until]
    return power(numbers(mine, "n"), numbers(mine, time))


def letters(index: int) -> str:
    """Return A, B, ..., Z, AA, AB, ... for 0, 1, ..."""
    more, last = divmod(index, len(ascii_uppercase))
    return (letters(more - 1) if more else "") + ascii_uppercase[last]


def joined_pairs(pairs: Iterable[tuple[int, int]]) -> str:
    """Return pairs of components as text such as "1-2, 3-6"."""
    return ", ".join(f"{first}-{second}" for first, second in pairs)


def verdict(held: object) -> str:
    """Return the word for whether a requirement is met."""
    return "holds" if held else "FAILS"


# --- the console and files --------------------------------------------------------------------


def cell_text(cell: Cell) -> str:
    """Return a table's cell as text, numbers to three figures."""
    if isinstance(cell, str):
        return cell
    if not math.isfinite(cell):
        return "never"
    return f"{cell:.0f}" if isinstance(cell, int) or abs(cell) >= WHOLE else f"{cell:.3g}"


def show(console: Console, machine: Mapping[str, str], measured: Mapping[str, Measurement]) -> None:
    """Print the tables, then the findings."""
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
        # Headings may break into lines; cells may not.
        shown.add_column(escape(name), justify=justify, min_width=max(len(row[k]) for row in texts))
    for row in texts:
        shown.add_row(*row)
    return shown


def write(
    folder: Path, name: str, machine: Mapping[str, str], measured: Mapping[str, Measurement]
) -> list[Path]:
    """Write a CSV file per part and one JSON file, ``name``, with everything; return the files."""
    written: list[Path] = []
    for part, each in measured.items():
        if each.rows:
            path = folder / f"{part}.csv"
            write_text(path, to_csv(each.rows))
            written.append(path)
    path = folder / f"{name}.json"
    write_text(path, to_json(machine, measured))
    return [*written, path]


def to_csv(rows: Sequence[Row]) -> str:
    """Return rows as CSV text with a line of column names."""
    text = io.StringIO()
    writer = csv.DictWriter(text, fieldnames=list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def to_json(machine: Mapping[str, str], measured: Mapping[str, Measurement]) -> str:
    """Return everything as JSON text; numbers that are not finite become null."""
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
    """Return a cell as a JSON value, null for NaN.

    NumPy's integers are converted, because JSON does not accept them.
    """
    if isinstance(cell, str):
        return cell
    if not isinstance(cell, float):
        return int(cell)
    return float(cell) if math.isfinite(cell) else None
