"""Functions that select, show, write and judge rows of measurements."""

import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt
from rich.console import Console
from rich.markup import escape
from rich.table import Table as RichTable

from magfold_env.reporting.tables import Cell, Row, Table, cell_text

Progress = Callable[[float, str], None]
"""A function that receives the finished share of a part, 0 to 1, and the current step's name."""

Tick = Callable[[float], None]
"""A function that receives the finished share of one case of a part, 0 to 1."""

Case = TypeVar("Case")


@dataclass(frozen=True)
class Measurement:
    """The results of one part of a benchmark."""

    rows: list[Row] = field(default_factory=list[Row])
    """Everything measured, for CSV and JSON."""
    tables: list[Table] = field(default_factory=list[Table])
    """The tables that are worth reading."""
    findings: list[str] = field(default_factory=list[str])
    """Findings, one sentence each, such as whether a requirement is met."""


def each_case(
    progress: Progress, cases: Sequence[Case], name: Callable[[Case], str] = str
) -> Iterator[tuple[Case, Tick]]:
    """Yield cases one after another, each with its `Tick`, and report their names and progress."""
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
    """Return the rows that have the given cells."""
    wanted = {**(cells or {}), **more}
    return [row for row in rows if all(row[name] == cell for name, cell in wanted.items())]


def pivot(rows: Sequence[Row], line: str, column: str, value: str, missing: str) -> list[Row]:
    """Return a row for each value of one column, with a cell for each value of another."""
    names = distinct(rows, column)
    shown: list[Row] = []
    for key in distinct(rows, line):
        found = {str(row[column]): row[value] for row in select(rows, **{line: key})}
        head = str(key) if isinstance(key, int) else f"{key:.3g}"
        shown.append({line: head, **{name: found.get(name, missing) for name in names}})
    return shown


def without_quartiles(rows: Sequence[Row], *hidden: str) -> list[Row]:
    """Return rows without quartiles and without the `hidden` columns."""
    return [
        {name: cell for name, cell in row.items() if "quartile" not in name and name not in hidden}
        for row in rows
    ]


def power(x: npt.ArrayLike, y: npt.ArrayLike) -> float:
    """Return the power of x with which y grows, by least squares; nan for fewer than two points."""
    if np.size(x) < 2:
        return math.nan
    return float(np.polyfit(np.log(x), np.log(y), 1)[0])


def growth(
    rows: Sequence[Row], since: int, until: float = math.inf, time: str = "time [µs]"
) -> float:
    """Return the power of "n" with which a time grows between two lengths; nan if unknown."""
    mine = [row for row in rows if since <= float(row["n"]) <= until]
    return power(numbers(mine, "n"), numbers(mine, time))


def verdict(held: object) -> str:
    """Return the word that states whether a requirement is met."""
    return "holds" if held else "FAILS"


# --- the console and files --------------------------------------------------------------------


def chosen(parts: Mapping[str, Case], only: Sequence[str]) -> dict[str, Case]:
    """Return the parts with these names, in the order of `parts`; all if no name is given."""
    for name in only:
        if name not in parts:
            raise ValueError(f"--only: {name!r} is not allowed; must be one of {', '.join(parts)}")
    return {name: part for name, part in parts.items() if not only or name in only}


def show(console: Console, machine: Mapping[str, str], measured: Mapping[str, Measurement]) -> None:
    """Print the tables, then the findings and the machine."""
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
    """Return a table for the console, with numbers to three figures."""
    shown = RichTable(title=escape(table.title))
    texts = [[escape(cell_text(cell)) for cell in row.values()] for row in table.rows]
    for k, (name, cell) in enumerate(table.rows[0].items()):
        justify = "left" if isinstance(cell, str) else "right"
        # Headings may wrap; cells may not.
        shown.add_column(escape(name), justify=justify, min_width=max(len(row[k]) for row in texts))
    for row in texts:
        shown.add_row(*row)
    return shown


def to_json(machine: Mapping[str, str], measured: Mapping[str, Measurement]) -> str:
    """Return everything as JSON text; numbers that JSON cannot hold are null."""
    parts = {
        part: {"findings": each.findings, "rows": plain(each.rows)}
        for part, each in measured.items()
    }
    data = {"machine": dict(machine), "parts": parts}
    return json.dumps(data, indent=1, allow_nan=False, ensure_ascii=False) + "\n"


def plain(rows: Sequence[Row]) -> list[dict[str, Cell | None]]:
    """Return rows as JSON values, with null where a number is not finite."""
    return [{name: _plain(cell) for name, cell in row.items()} for row in rows]


def _plain(cell: Cell) -> Cell | None:
    if isinstance(cell, str):
        return cell
    if not isinstance(cell, float):
        return int(cell)  # JSON does not accept NumPy's integers
    return float(cell) if math.isfinite(cell) else None
