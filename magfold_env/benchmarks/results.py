"""What the suite is to measure, and what it has measured, as JSON holds it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

from magfold_env.benchmarks.descriptions import Description, descriptions
from magfold_env.benchmarks.parts import BENCHMARKS
from magfold_env.benchmarks.runner import Part
from magfold_env.reporting import tables
from magfold_env.reporting.tables import Cell, Measurement, Row, Table

Effort = Literal["quick", "full"]

LEFT_OUT = {
    "dynamics first-use": "it compiles the engine anew, which takes most of a minute",
    "design searches": "it takes most of a minute",
}
"""What `--quick` leaves out, and why."""


@dataclass(frozen=True)
class Entry:
    """One part of one benchmark."""

    benchmark: str
    name: str
    part: Part
    description: Description

    @property
    def title(self) -> str:
        """Both names."""
        return f"{self.benchmark} {self.name}"

    @property
    def command(self) -> str:
        """What repeats it alone."""
        return f"magfold bench {self.benchmark} --only {self.name}"


@dataclass(frozen=True)
class Result:
    """What one part of the suite gave."""

    title: str
    """Of the benchmark and the part."""
    part: str
    found: Measurement
    seconds: float
    """What it took, by the clock."""
    pace: tuple[float, float]
    """Time of the fixed work just before and just after it [s]."""

    def to_json(self) -> dict[str, Any]:
        """Return everything; numbers that JSON cannot hold become null."""
        return {
            "name": self.title,
            "seconds": self.seconds,
            "pace": list(self.pace),
            "part": self.part,
            "rows": _pairs(self.found.rows),
            "tables": [
                {"title": table.title, "rows": _pairs(table.rows)} for table in self.found.tables
            ],
            "findings": self.found.findings,
        }

    @classmethod
    def from_json(cls, data: dict[str, Any]) -> Result:
        """Return what `to_json` was made of; null becomes nan."""
        shown = [Table(str(each["title"]), _rows(each["rows"])) for each in data["tables"]]
        findings = [str(each) for each in data["findings"]]
        found = Measurement(_rows(data["rows"]), shown, findings)
        before, after = data["pace"]
        pace = float(before), float(after)
        return cls(str(data["name"]), str(data["part"]), found, float(data["seconds"]), pace)


def _pairs(rows: list[Row]) -> list[list[tuple[str, Cell | None]]]:
    """Return rows as pairs of column and cell: JSON may sort an object's keys."""
    return [[(name, tables.plain(cell)) for name, cell in row.items()] for row in rows]


def _rows(rows: list[list[tuple[str, Any]]]) -> list[Row]:
    return [{name: math.nan if cell is None else cell for name, cell in row} for row in rows]


def entries(effort: Effort) -> list[Entry]:
    """Return the parts of a run, in order."""
    found = [
        Entry(benchmark, name, part, descriptions()[benchmark].parts[name])
        for benchmark, parts in BENCHMARKS.items()
        for name, part in parts.items()
    ]
    return [each for each in found if effort == "full" or each.title not in LEFT_OUT]
