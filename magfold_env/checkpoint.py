"""What a long run has found so far, in a database that a kill cannot break."""

import json
import os
import platform
import sqlite3
import time
from collections.abc import Callable, Generator, Mapping
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path
from typing import Any, Self, TypeVar, cast

from filelock import FileLock, Timeout

from magfold_env.files import a_path, write_text

T = TypeVar("T")

FILE = "records.sqlite"

EVERY = 2.0
"""Longest time between two transactions [s]: what a kill may lose."""

_REMEDY = "remove it, and what it held is computed again"
_UNUSABLE = (ValueError, TypeError, LookupError, AttributeError, OverflowError, RecursionError)


class CheckpointError(ValueError):
    """A file that is damaged, or that another run has written; a folder that another run uses."""


@contextmanager
def alone_in(folder: Path, wait: bool = False) -> Generator[None]:
    """Let no other run use a folder, which is made if need be.

    The system ends that with the process, however it ends. `wait` until another run has ended.

    Raises
    ------
    CheckpointError
        If another run uses it, and that is not waited for.
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
    """Records of a long run by their number, in a database that is written every few seconds.

    No other run may use its folder meanwhile. As a context it ends with what is left written, and
    the folder free again.

    Parameters
    ----------
    folder
        Made if need be; None keeps nothing.
    key
        Everything that a record depends on, as values that JSON can hold.
    wait
        Whether another run that uses the folder is waited for, not an error.
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
        self._stack: ExitStack | None = None

    def __enter__(self) -> Self:
        self._open()
        return self

    def __exit__(self, *_: object) -> None:
        if self._stack is not None:
            stack, self._stack = self._stack, None
            with stack:
                self.save()

    def load(self) -> list[Any]:
        """Return the records as they are; see `read`."""
        return self.read(lambda record: record)

    def read(self, make: Callable[[Any], T]) -> list[T]:
        """Return what ``make`` makes of every record that is written, in order of their numbers.

        Raises
        ------
        CheckpointError
            If the file is damaged or holds another key, if another run uses the folder, or if
            ``make`` raises a ValueError, a TypeError or the like.
        """
        self._open()
        made: list[T] = []
        for number, text in self._rows():
            try:
                made.append(make(json.loads(text)))
            except _UNUSABLE as error:
                message = f"{self._file}: record {number} is not one of this run: {error}"
                raise CheckpointError(f"{message}; {_REMEDY}") from None
        return made

    def add(self, record: object, number: int | None = None) -> None:
        """Add a record, of values that JSON can hold; write if the last time is `EVERY` ago.

        It takes the place of the one that has its number; None gives it the next number.
        """
        if self._folder is None:
            return
        self._open()
        # Before it is written, so that writing it twice makes no second one.
        number = self._next if number is None else number
        self._pending[number] = _text(record)
        self._next = max(self._next, number + 1)
        if time.monotonic() - self._saved > EVERY:
            self.save()

    def save(self) -> None:
        """Write the records that are not yet, all or none.

        Raises
        ------
        OSError
            If the file cannot be written: they are kept until it can.
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

    def _open(self) -> None:
        """Lock the folder and compare the key, the first time."""
        if self._folder is None or self._stack is not None:
            return
        with ExitStack() as stack:
            stack.enter_context(alone_in(self._folder, self._wait))
            rows = self._rows()
            self._next = rows[-1][0] + 1 if rows else 0
            self._saved = time.monotonic()
            self._stack = stack.pop_all()

    def _rows(self) -> list[tuple[int, str]]:
        """Return number and text of every record that is written."""
        if not self._file.is_file():
            return []
        with self._transaction() as database:
            if not _tables(database):  # a kill came before the first records
                return []
            damage = database.execute("PRAGMA quick_check(1)").fetchone()[0]
            if damage != "ok":
                raise sqlite3.DatabaseError(damage.splitlines()[-1])
            ((text,),) = database.execute("SELECT key FROM run")
            key = json.loads(text)
            rows = database.execute("SELECT number, record FROM records ORDER BY number").fetchall()
            # Where the table's own description is damaged, its numbers may be anything.
            if wrong := [number for number, _ in rows if not isinstance(number, int)]:
                raise sqlite3.DatabaseError(f"a record has the number {wrong[0]!r}")
        if where := difference(key, self._key):
            message = (
                f"{self._file}: was written by another run, {where}; "
                "take up that run, or give another folder"
            )
            raise CheckpointError(message)
        return rows

    @contextmanager
    def _transaction(self) -> Generator[sqlite3.Connection]:
        """Offer the database; what is done with it is done as a whole, or not at all."""
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
    # In its own order: the columns of a kept row stay in theirs.
    return json.dumps(content, separators=(",", ":"), allow_nan=False)


def difference(there: object, here: object, key: str = "") -> str:
    """Return in words where two keys first differ; empty if they are equal."""
    if isinstance(there, dict) and isinstance(here, dict):
        old, new = cast("dict[str, Any]", there), cast("dict[str, Any]", here)
        for name in sorted({*old, *new}):
            dotted = f"{key}.{name}" if key else name
            if found := difference(old.get(name), new.get(name), dotted):
                return found
        return ""
    return "" if there == here else f"whose {key} is {there!r} where this one's is {here!r}"
