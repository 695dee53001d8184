"""A part that has been measured, as values that JSON can hold, and back."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from magfold_env.reporting.tables import Cell, Measurement, Row, Table


@dataclass(frozen=True)
class Done:
    """What one part of the suite gave."""

    name: str
    """Of the benchmark and the part."""
    part: Measurement
    seconds: float
    """What it took, by the clock."""
    pace: tuple[float, float]
    """Time of the fixed work just before and just after it [s]."""

    def to_json(self) -> dict[str, Any]:
        """Return everything; numbers that JSON cannot hold become null."""
        return {
            "name": self.name,
            "seconds": self.seconds,
            "pace": list(self.pace),
            "part": self.part.name,
            "rows": _plain(self.part.rows),
            "tables": [
                {"title": table.title, "rows": _plain(table.rows)} for table in self.part.tables
            ],
            "findings": self.part.findings,
        }

    @classmethod
    def from_json(cls, data: dict[str, Any]) -> Done:
        """Return what `to_json` was made of; null becomes nan."""
        tables = [Table(str(each["title"]), _rows(each["rows"])) for each in data["tables"]]
        findings = [str(each) for each in data["findings"]]
        part = Measurement(str(data["part"]), _rows(data["rows"]), tables, findings)
        before, after = data["pace"]
        pace = float(before), float(after)
        return cls(str(data["name"]), part, float(data["seconds"]), pace)


def _plain(rows: list[Row]) -> list[list[tuple[str, Cell | None]]]:
    """Return rows as pairs of column and cell: JSON may sort an object's keys."""
    return [[(name, _json_cell(cell)) for name, cell in row.items()] for row in rows]


def _json_cell(cell: Cell) -> Cell | None:
    if isinstance(cell, str):
        return cell
    # NumPy's integers are numbers too, but none that JSON knows.
    if float(cell).is_integer() and not isinstance(cell, float):
        return int(cell)
    return float(cell) if math.isfinite(cell) else None


def _rows(rows: list[list[tuple[str, Any]]]) -> list[Row]:
    return [{name: math.nan if cell is None else cell for name, cell in row} for row in rows]
