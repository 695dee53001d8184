"""Tables of results, and their conversion to text, CSV and data frames."""

import csv
import importlib
import io
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from string import ascii_uppercase
from typing import Any

import numpy.typing as npt

from magfold_env.files import write_text

Cell = str | int | float
Row = dict[str, Cell]

WHOLE = 1000.0  # larger numbers have no decimals


@dataclass(frozen=True)
class Table:
    """Rows for the console or a page. All rows have the same keys: the column headings."""

    title: str
    rows: list[Row]


class Columns:
    """A result in columns, with one entry per run or frame, for spreadsheets and data frames."""

    def columns(self) -> dict[str, npt.NDArray[Any]]:
        """Return columns of equal length by name."""
        raise NotImplementedError

    def to_csv(self, path: str | Path) -> None:
        """Write `columns` as CSV, through a temporary file."""
        columns, text = self.columns(), io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(zip(*(column.tolist() for column in columns.values()), strict=True))
        write_text(path, text.getvalue())

    def to_dataframe(self) -> Any:
        """Return `columns` as a pandas data frame.

        Raises
        ------
        ImportError
            If pandas is not installed.
        """
        try:
            pandas: Any = importlib.import_module("pandas")
        except ImportError as error:
            raise ImportError("data frames need pandas: pip install pandas") from error
        return pandas.DataFrame(self.columns())


def letters(index: int) -> str:
    """Return A, B, ..., Z, AA, AB, ... for 0, 1, ..."""
    more, last = divmod(index, len(ascii_uppercase))
    return (letters(more - 1) if more else "") + ascii_uppercase[last]


def joined_pairs(pairs: Iterable[tuple[int, int]]) -> str:
    """Return pairs of components as text such as "1-2, 3-6"."""
    return ", ".join(f"{first}-{second}" for first, second in pairs)


def cell_text(cell: Cell) -> str:
    """Return a table's cell as text, with numbers to three significant digits."""
    if isinstance(cell, str):
        return cell
    if not math.isfinite(cell):
        return "never"
    return f"{cell:.0f}" if isinstance(cell, int) or abs(cell) >= WHOLE else f"{cell:.3g}"


def to_csv(rows: Sequence[Row]) -> str:
    """Return rows as CSV text, after a line of column names."""
    text = io.StringIO()
    writer = csv.DictWriter(text, fieldnames=list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()
