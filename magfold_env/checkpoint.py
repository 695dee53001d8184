"""A database of a long run's results, which survives an interruption at any time."""

import json
import os
import platform
import sqlite3
import time
from collections.abc import Callable, Generator, Mapping
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path
from typing import Any, Self, cast

from filelock import FileLock, Timeout

from magfold_env.files import a_path, write_text

FILE = "records.sqlite"

EVERY = 2.0
"""Time between two transactions [s]. An interruption loses at most the results of this time."""

_REMEDY = "remove it to compute its contents again"
_UNUSABLE = (ValueError, TypeError, LookupError, AttributeError, OverflowError, RecursionError)


class CheckpointError(ValueError):
    """An error about a damaged file, a file of another run, or a folder that another run uses."""


@contextmanager
def alone_in(folder: Path, wait: bool = False) -> Generator[None]:
    """Lock a folder against other runs; create it first if it does not exist.

    The operating system releases the lock however the process ends. If another run has locked the
    folder, this function waits for it if `wait` is true, and raises a CheckpointError otherwise.
    """
    folder.mkdir(parents=True, exist_ok=True)
    lock, holder = FileLock(folder / ".lock"), folder / ".lock.txt"
    try:
        lock.acquire(blocking=wait)
    except Timeout:
        by = holder.read_text(encoding="utf-8") if holder.is_file() else "another process"
        message = f"{folder}: is in use by {by}; wait until that ends, or give another folder"
        raise CheckpointError(message) from None
    try:
        since = time.strftime("%Y-%m-%d %H:%M:%S")
        write_text(holder, f"process {os.getpid()} on {platform.node()} since {since}")
        yield
    finally:
        lock.release()


class Checkpoint:
    """Numbered records of a long run, in a database that is written every few seconds.

    A checkpoint is a context manager. No other run can use the folder until the context ends. At
    that moment, the remaining records are written.

    Parameters
    ----------
    folder
        Folder, which is created if needed. If None, no records are stored.
    key
        All settings on which the records depend, as JSON values.
    wait
        Whether to wait for another run that uses the folder instead of raising an error.

    Raises
    ------
    CheckpointError
        If the file is damaged or has another key, or if another run uses the folder.
    """

    def __init__(
        self, folder: str | Path | None, key: Mapping[str, Any], wait: bool = False
    ) -> None:
        self._wait = wait
        self._folder = None if folder is None else a_path("state", folder)
        self._file = Path() if self._folder is None else self._folder / FILE
        self._key: dict[str, Any] = json.loads(_text(key))
        self._pending: dict[int, str] = {}
        self._next = 0
        self._saved = 0.0
        self._stack = ExitStack()

    def __enter__(self) -> Self:
        if self._folder is not None:
            with ExitStack() as stack:
                stack.enter_context(alone_in(self._folder, self._wait))
                rows = self._rows()
                self._next = rows[-1][0] + 1 if rows else 0
                self._saved = time.monotonic()
                self._stack = stack.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        with self._stack:
            self.save()

    def load(self, make: Callable[[Any], Any] = lambda record: record) -> list[Any]:
        """Return all written records, converted by ``make``, in the order of their numbers.

        Raises
        ------
        CheckpointError
            If the file is damaged, or ``make`` raises an error such as ValueError or TypeError.
        """
        made: list[Any] = []
        for number, text in self._rows():
            try:
                made.append(make(json.loads(text)))
            except _UNUSABLE as error:
                message = f"{self._file}: record {number} does not belong to this run: {error}"
                raise CheckpointError(f"{message}; {_REMEDY}") from None
        return made

    def add(self, record: object, number: int | None = None) -> None:
        """Add a record of JSON values; write all new records if the last write is over `EVERY` ago.

        The record replaces an earlier one with the same number; None gives it the next number.
        """
        if self._folder is None:
            return
        # Records are numbered before they are written, so that writing one twice is harmless.
        number = self._next if number is None else number
        self._pending[number] = _text(record)
        self._next = max(self._next, number + 1)
        if time.monotonic() - self._saved > EVERY:
            self.save()

    def save(self) -> None:
        """Write all unwritten records in one transaction.

        Raises
        ------
        OSError
            If the file cannot be written; the next call writes the records.
        """
        self._saved = time.monotonic()
        if not self._pending:
            return
        with self._transaction() as database:
            if not _tables(database):
                database.execute("CREATE TABLE run (key TEXT NOT NULL)")
                database.execute("CREATE TABLE records (number INTEGER PRIMARY KEY, record TEXT)")
                database.execute("INSERT INTO run VALUES (?)", [_text(self._key)])
            rows = self._pending.items()
            database.executemany("INSERT OR REPLACE INTO records VALUES (?, ?)", rows)
        self._pending = {}

    def _rows(self) -> list[tuple[int, str]]:
        """Return the number and text of every written record."""
        if not self._file.is_file():
            return []
        with self._transaction() as database:
            if not _tables(database):  # interrupted before the first records
                return []
            damage = database.execute("PRAGMA quick_check(1)").fetchone()[0]
            if damage != "ok":
                raise sqlite3.DatabaseError(damage.splitlines()[-1])
            ((text,),) = database.execute("SELECT key FROM run")
            key = json.loads(text)
            rows = database.execute("SELECT number, record FROM records ORDER BY number").fetchall()
            # If the description of the table is damaged, its numbers may have any type.
            if wrong := [number for number, _ in rows if not isinstance(number, int)]:
                raise sqlite3.DatabaseError(f"a record has the number {wrong[0]!r}")
        if where := difference(key, self._key):
            message = (
                f"{self._file}: was written by another run, {where}; "
                "continue that run, or give another folder"
            )
            raise CheckpointError(message)
        return rows

    @contextmanager
    def _transaction(self) -> Generator[sqlite3.Connection]:
        """Yield the database; all operations on it succeed together or not at all."""
        try:
            with closing(sqlite3.connect(self._file, isolation_level=None)) as database, database:
                database.execute("BEGIN IMMEDIATE")
                yield database
        except (sqlite3.DatabaseError, *_UNUSABLE) as error:
            code = getattr(error, "sqlite_errorcode", sqlite3.SQLITE_ERROR) & 0xFF
            if isinstance(error, sqlite3.OperationalError) and code != sqlite3.SQLITE_ERROR:
                raise OSError(f"{self._file}: {error}") from None
            raise CheckpointError(f"{self._file}: is damaged ({error}); {_REMEDY}") from None


def _tables(database: sqlite3.Connection) -> list[Any]:
    return database.execute("SELECT name FROM sqlite_master").fetchall()


def _text(content: object) -> str:
    # Keys are not sorted, because stored rows keep the order of their columns.
    return json.dumps(content, separators=(",", ":"), allow_nan=False)


def difference(there: object, here: object, key: str = "") -> str:
    """Return a text about the first difference between two runs' keys; empty if they are equal."""
    if isinstance(there, dict) and isinstance(here, dict):
        old, new = cast("dict[str, Any]", there), cast("dict[str, Any]", here)
        for name in sorted({*old, *new}):
            dotted = f"{key}.{name}" if key else name
            if found := difference(old.get(name), new.get(name), dotted):
                return found
        return ""
    return "" if there == here else f"whose {key} is {there!r} where this one's is {here!r}"
