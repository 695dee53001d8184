"""Tests of a long run's records: damaged files, other runs' files, and concurrent processes."""

import errno
import os
import shutil
import signal
import sqlite3
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Generator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from magfold_env import checkpoint
from magfold_env.checkpoint import FILE, Checkpoint, CheckpointError
from magfold_env.files import replacing, write_text
from tests.command_line import python
from tests.killed import records_in

KEY = {"seed": 1, "scene": {"friction": 0.35, "sequence": ("NSNS", "SNSN")}}

# No file may grow beyond 1,000 bytes: the system kills the process in the middle of its writing.
KILLED_IN_WRITING = """
import resource, signal, sys
from magfold_env.files import write_text

resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
signal.signal(signal.SIGXFSZ, signal.SIG_DFL)
write_text(sys.argv[1], "new" * 100_000)
"""

# Adds records for ever, and tells the number of each that is written.
ENDLESS = """
import itertools, sys
from magfold_env import checkpoint

checkpoint.EVERY = -1.0
with checkpoint.Checkpoint(sys.argv[1], {"seed": 1}) as kept:
    for k in itertools.count(len(kept.load())):
        kept.add([k] * 1000)
        print(k, flush=True)
"""


def written(folder: Path, *batches: list[object]) -> None:
    with Checkpoint(folder, KEY) as kept:
        for batch in batches:
            for record in batch:
                kept.add(record)
            kept.save()


def loaded(folder: Path) -> list[Any]:
    with Checkpoint(folder, KEY) as kept:
        return kept.load()


@contextmanager
def endless(folder: Path) -> Generator[Callable[[], list[int]]]:
    """Run `ENDLESS` until it writes a record; yield a function that kills it and counts records."""
    with subprocess.Popen(
        [sys.executable, "-c", ENDLESS, folder],
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
    ) as process:
        assert process.stdout is not None
        lines = process.stdout
        first = int(lines.readline())

        def kill() -> list[int]:
            process.kill()
            return [first, *map(int, lines.read().split())]

        try:
            yield kill
        finally:
            process.kill()


def test_records_come_back_in_order_and_bit_for_bit(tmp_path: Path) -> None:
    batches: list[list[object]] = [[[0, 0.1 + 0.2], [1, 1e-300]], [["word", None]]]
    written(tmp_path / "state", *batches)
    assert loaded(tmp_path / "state") == [*batches[0], *batches[1]]


def test_nothing_is_written_before_there_is_something(tmp_path: Path) -> None:
    written(tmp_path, [])
    assert not (tmp_path / FILE).exists()
    # So that it is another run's as well.
    with Checkpoint(tmp_path, {"seed": 2}) as other:
        assert other.load() == []


def test_records_are_written_when_the_last_time_is_long_ago(tmp_path, monkeypatch):
    clock, there = [0.0], list[int]()
    monkeypatch.setattr(checkpoint.time, "monotonic", lambda: clock[0])
    with Checkpoint(tmp_path, KEY) as kept:
        for record in range(8):
            clock[0] = 0.5 * checkpoint.EVERY * record
            kept.add(record)
            there.append(len(kept.load()))
    # Records 3 and 6 came more than EVERY after the time before.
    assert there == [0, 0, 0, 4, 4, 4, 7, 7]
    assert loaded(tmp_path) == list(range(8))


def test_a_run_goes_on_with_the_next_number(tmp_path: Path) -> None:
    written(tmp_path, [1, 2])
    written(tmp_path, [3])
    assert records_in(tmp_path) == {0: 1, 1: 2, 2: 3}


def test_a_record_is_there_once(tmp_path: Path) -> None:
    for value in ("first", "second"):
        with Checkpoint(tmp_path, KEY) as kept:
            kept.add(value, 7)
            kept.add(value, 2)
            kept.add(f"after the {value}")
    assert records_in(tmp_path) == {
        2: "second", 7: "second", 8: "after the first", 9: "after the second"
    }  # fmt: skip


@pytest.mark.parametrize("damage", [
    pytest.param(lambda content: content[: len(content) // 2], id="cut"),
    pytest.param(lambda content: b"no database at all" + content, id="shifted"),
    pytest.param(lambda content: b"[1, 2]", id="list"),
    pytest.param(lambda content: content.replace(b"records", b"recards"), id="another name"),
    pytest.param(lambda content: content.replace(b'{"seed"', b'("seed"'), id="no key"),
    pytest.param(lambda content: content.replace(b"R PRIMARY", b"R_PRIMARY"), id="no numbers"),
    pytest.param(lambda content: content[:4096] + bytes(4096) + content[8192:], id="a page"),
])  # fmt: skip
def test_a_damaged_file_is_refused(damage: Callable[[bytes], bytes], tmp_path: Path) -> None:
    written(tmp_path, ["long" * 1000] * 20)
    file = tmp_path / FILE
    file.write_bytes(damage(file.read_bytes()))
    with pytest.raises(CheckpointError, match=rf"{FILE}: is damaged \(.*\); remove it to compute"):
        loaded(tmp_path)
    file.unlink()
    assert loaded(tmp_path) == []


def test_records_that_cannot_be_used_are_refused_with_their_number(tmp_path: Path) -> None:
    written(tmp_path, ["1", "2"], ["three"])
    with (
        Checkpoint(tmp_path, KEY) as kept,
        pytest.raises(CheckpointError, match=rf"{FILE}: record 2 does not .*'three'; remove"),
    ):
        kept.load(int)


@pytest.mark.parametrize(("key", "difference"), [
    ({**KEY, "seed": 2}, "whose seed is 1 where this one's is 2"),
    ({**KEY, "scene": {"friction": 0.3, "sequence": ["NSNS", "SNSN"]}},
     "whose scene.friction is 0.35 where this one's is 0.3"),
    ({"seed": 1}, "whose scene is .* where this one's is None"),
])  # fmt: skip
def test_another_runs_file_is_refused(key, difference, tmp_path):
    written(tmp_path, [1])
    with (
        pytest.raises(CheckpointError, match=f"was written by another run, {difference}"),
        Checkpoint(tmp_path, key),
    ):
        pass
    assert loaded(tmp_path) == [1]  # it was given back


# --- several processes, kills, full disks ---------------------------------------------------------


def test_a_folder_is_used_by_one_run_at_a_time(tmp_path: Path) -> None:
    with endless(tmp_path):
        held = rf"{tmp_path.name}: is in use by process \d+ on \S+ since .*; wait until that ends"
        # Without the lock, the database is in use, which is another error.
        with pytest.raises((CheckpointError, OSError), match=held):
            loaded(tmp_path)
    mine = f"is in use by process {os.getpid()} on"
    with Checkpoint(tmp_path, {"seed": 1}), pytest.raises(CheckpointError, match=mine):
        loaded(tmp_path)
    with Checkpoint(tmp_path, {"seed": 1}):
        pass  # it was given back


def test_a_run_may_wait_for_the_one_before_it(tmp_path: Path) -> None:
    found: list[list[int]] = []

    def later() -> None:
        with Checkpoint(tmp_path, KEY, wait=True) as kept:
            found.append(kept.load())

    waits = threading.Thread(target=later)
    with Checkpoint(tmp_path, KEY) as kept:
        waits.start()
        waits.join(0.2)
        assert waits.is_alive()
        kept.add(5)
    waits.join(10.0)
    assert found == [[5]]


def test_a_kill_at_any_moment_loses_and_doubles_nothing(tmp_path: Path) -> None:
    for wait in np.random.default_rng().uniform(0.0, 0.1, 5):
        with endless(tmp_path) as kill:
            time.sleep(wait)
            numbers = kill()
        with Checkpoint(tmp_path, {"seed": 1}) as kept:
            found = kept.load()
        assert found == [[k] * 1000 for k in range(len(found))]
        # It may have been killed before it could tell of the last one.
        assert len(found) in (numbers[-1] + 1, numbers[-1] + 2)


def test_records_are_written_all_or_none(tmp_path: Path) -> None:
    written(tmp_path, [1])
    with closing(sqlite3.connect(tmp_path / FILE)) as database:
        refuses = "BEFORE INSERT ON records WHEN NEW.number = 2"
        database.execute(f"CREATE TRIGGER no {refuses} BEGIN SELECT RAISE(ABORT, 'no'); END")
    with Checkpoint(tmp_path, KEY) as kept:
        for record in (2, 3):
            kept.add(record)
        with pytest.raises(CheckpointError, match="no"):
            kept.save()
        found = kept.load()
        with closing(sqlite3.connect(tmp_path / FILE)) as database:
            database.execute("DROP TRIGGER no")
    assert found == [1]
    assert loaded(tmp_path) == [1, 2, 3]


def test_a_full_disk_loses_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    connect = sqlite3.connect

    def full(*arguments: Any, **options: Any) -> sqlite3.Connection:
        database = connect(*arguments, **options)
        database.execute("PRAGMA max_page_count = 1")  # it stays at what there is
        return database

    written(tmp_path, [1])
    with Checkpoint(tmp_path, KEY) as kept:
        kept.add("long" * 10_000)
        with monkeypatch.context() as patch:
            patch.setattr(sqlite3, "connect", full)
            with pytest.raises(OSError, match=rf"^\S*{FILE}: database or disk is full$"):
                kept.save()
            assert kept.load() == [1]
    assert loaded(tmp_path) == [1, "long" * 10_000]


def test_a_kill_while_a_file_is_written_leaves_the_file_that_was_there(tmp_path: Path) -> None:
    path = tmp_path / "state.json"
    write_text(path, "old" * 100_000)
    run = python("-c", KILLED_IN_WRITING, path, check=False)
    assert run.returncode == -signal.SIGXFSZ
    assert path.read_text() == "old" * 100_000


def test_no_file_has_its_name_before_it_is_whole(tmp_path, monkeypatch):
    path = tmp_path / "state.json"
    write_text(path, "old")
    write = Path.write_text

    def full_disk(path: Path, text: str, **options: Any) -> int:
        write(path, text[: len(text) // 2], **options)
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(Path, "write_text", full_disk)
    with pytest.raises(OSError, match=rf"{os.strerror(errno.ENOSPC)}: '.*state\.json'"):
        write_text(path, "new")
    assert [each.read_text() for each in tmp_path.iterdir()] == ["old"]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs Linux")
def test_a_write_that_fails_names_the_file_that_was_asked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(path: Path) -> None:
        with pytest.raises(OSError, match=f"'{path}'$"), replacing(path) as temporary:
            shutil.copyfile(source, temporary)

    source, device = tmp_path / "source", tmp_path / "state.json"
    source.write_text("new" * 10_000)
    fails(Path("/proc/state.json"))
    device.symlink_to("/dev/full")
    fails(device)
    assert device.is_char_device()
    device.unlink()
    full = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    monkeypatch.setattr(os, "fsync", Mock(side_effect=full))
    fails(tmp_path / "state.json")
    assert list(tmp_path.iterdir()) == [source]


def test_an_empty_path_is_refused() -> None:
    with pytest.raises(ValueError, match="state: '' is not allowed; must be a path"):
        Checkpoint("", KEY)
