"""What a long run has found so far, in files that a kill cannot break."""

import hashlib
import json
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar, cast

from magfold_env.files import write_text

T = TypeVar("T")

EVERY = 2.0
"""Longest time between two files [s]: what a kill may lose."""


class CheckpointError(ValueError):
    """A file that is damaged, or that another run has written."""


class Checkpoint:
    """Records of a long run in a folder: a file every few seconds, moved into place when whole.

    Every file holds the key of its run and a checksum.

    Parameters
    ----------
    folder
        Made if need be, with the first file.
    key
        Everything that a record depends on, as values that JSON can hold.
    """

    def __init__(self, folder: str | Path, key: Mapping[str, Any]) -> None:
        self._folder = Path(folder)
        self._key: dict[str, Any] = json.loads(_canonical(key))
        self._pending: list[Any] = []
        self._saved = time.monotonic()

    def load(self) -> list[Any]:
        """Return the records of all files as they are; see `read`."""
        return self.read(lambda record: record)

    def read(self, make: Callable[[Any], T]) -> list[T]:
        """Return what ``make`` makes of every record, in the order they were added.

        Raises
        ------
        CheckpointError
            If a file is damaged or holds another key, or if ``make`` raises a ValueError, a
            TypeError or the like.
        """
        made: list[T] = []
        for path in self._paths():
            try:
                made += map(make, self._read(path))
            except CheckpointError:
                raise
            except (ValueError, TypeError, LookupError, AttributeError, OverflowError) as error:
                message = f"{path}: holds a record that is not one of this run: {error}; remove it"
                raise CheckpointError(message) from None
        return made

    def add(self, record: object) -> None:
        """Add a record, of values that JSON can hold; write if the last file is `EVERY` old."""
        self._pending.append(record)
        if time.monotonic() - self._saved > EVERY:
            self.save()

    def save(self) -> None:
        """Write the records that are in no file yet."""
        self._saved = time.monotonic()
        if not self._pending:
            return
        self._folder.mkdir(parents=True, exist_ok=True)
        paths = self._paths()
        number = int(paths[-1].stem.removeprefix("part-")) + 1 if paths else 0
        content = {"key": self._key, "records": self._pending}
        # Not canonical: the columns of a kept table stay in their order.
        text = json.dumps({"checksum": _checksum(content), **content}, separators=(",", ":"))
        write_text(self._folder / f"part-{number:06d}.json", text + "\n")
        self._pending = []

    def _paths(self) -> list[Path]:
        return sorted(self._folder.glob("part-*.json"))

    def _read(self, path: Path) -> list[Any]:
        content = _whole(path)
        if content is None:
            message = f"{path}: is damaged; remove it, and what it held is computed again"
            raise CheckpointError(message)
        if where := difference(content["key"], self._key):
            message = (
                f"{path}: was written by another run, {where}; "
                "take up that run, or give another folder"
            )
            raise CheckpointError(message)
        return content["records"]


def _whole(path: Path) -> dict[str, Any] | None:
    """Return what a file holds, without its checksum; None if that does not fit."""
    try:
        content: Any = json.loads(path.read_text(encoding="utf-8"))
        checksum = content.pop("checksum")
        fits = checksum == _checksum(content) and {"key", "records"} <= set(content)
    except (ValueError, AttributeError, KeyError, TypeError, RecursionError):
        return None
    return content if fits and isinstance(content["records"], list) else None


def _canonical(content: Mapping[str, Any]) -> str:
    return json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False)


def _checksum(content: Mapping[str, Any]) -> str:
    return hashlib.sha256(_canonical(content).encode()).hexdigest()


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
