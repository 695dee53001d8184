"""Files of a long run: whole or refused, and only for the run that wrote them."""

import errno
import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from magfold_env import checkpoint
from magfold_env.checkpoint import Checkpoint, CheckpointError
from magfold_env.files import write_text

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


def written(folder: Path, *batches: list[object]) -> Checkpoint:
    kept = Checkpoint(folder, KEY)
    for batch in batches:
        for record in batch:
            kept.add(record)
        kept.save()
    return kept


def test_records_come_back_in_order_and_bit_for_bit(tmp_path: Path) -> None:
    batches: list[list[object]] = [[[0, 0.1 + 0.2], [1, 1e-300]], [["word", None]]]
    written(tmp_path / "state", *batches)
    assert Checkpoint(tmp_path / "state", KEY).load() == [*batches[0], *batches[1]]
    assert len(list((tmp_path / "state").iterdir())) == 2


def test_the_columns_of_a_kept_row_stay_in_their_order(tmp_path: Path) -> None:
    written(tmp_path / "state", [{"word": "LR", "energy": 1.0}])
    (row,) = Checkpoint(tmp_path / "state", KEY).load()
    assert list(row) == ["word", "energy"]


def test_nothing_is_written_before_there_is_something(tmp_path: Path) -> None:
    kept = written(tmp_path / "state", [])
    assert kept.load() == []
    assert not (tmp_path / "state").exists()


def test_a_file_is_written_when_the_last_one_is_old(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    clock = [0.0]
    monkeypatch.setattr(checkpoint.time, "monotonic", lambda: clock[0])
    kept = Checkpoint(tmp_path, KEY)
    for record in range(8):
        clock[0] = 0.5 * checkpoint.EVERY * record
        kept.add(record)
    # Records 3 and 6 came more than EVERY after the file before.
    assert [len(json.loads(path.read_text())["records"]) for path in parts(tmp_path)] == [4, 3]


def test_a_run_goes_on_in_new_files(tmp_path: Path) -> None:
    written(tmp_path, [1, 2])
    written(tmp_path, [3])
    assert Checkpoint(tmp_path, KEY).load() == [1, 2, 3]


@pytest.mark.parametrize(
    "damage",
    [
        lambda text: text[: len(text) // 2],
        lambda text: "",
        lambda text: "[1, 2]",
        lambda text: "{}",
        lambda text: text.replace("11", "12"),
        lambda text: text.replace('"records"', '"record"'),
    ],
    ids=["cut", "empty", "list", "no entries", "another number", "another name"],
)
def test_a_damaged_file_is_refused(damage: Callable[[str], str], tmp_path: Path) -> None:
    written(tmp_path, [11], [22])
    (first, _) = parts(tmp_path)
    first.write_text(damage(first.read_text()))
    with pytest.raises(CheckpointError, match=r"part-000000.json: is damaged; remove it"):
        Checkpoint(tmp_path, KEY).load()
    first.unlink()
    assert Checkpoint(tmp_path, KEY).load() == [22]


def test_records_that_cannot_be_used_are_refused_with_their_file(tmp_path: Path) -> None:
    kept = written(tmp_path, ["1", "2"], ["three"])
    with pytest.raises(CheckpointError, match=r"part-000001.json: holds a record .*'three'"):
        kept.read(int)
    parts(tmp_path)[1].unlink()
    assert kept.read(int) == [1, 2]


@pytest.mark.parametrize(
    ("key", "difference"),
    [
        ({**KEY, "seed": 2}, "whose seed is 1 where this one's is 2"),
        (
            {**KEY, "scene": {"friction": 0.3, "sequence": ["NSNS", "SNSN"]}},
            "whose scene.friction is 0.35 where this one's is 0.3",
        ),
        ({"seed": 1}, "whose scene is .* where this one's is None"),
    ],
)
def test_another_runs_file_is_refused(
    key: dict[str, object], difference: str, tmp_path: Path
) -> None:
    written(tmp_path, [1])
    with pytest.raises(CheckpointError, match=f"was written by another run, {difference}"):
        Checkpoint(tmp_path, key).load()


def test_what_a_kill_leaves_of_a_file_is_no_file(tmp_path: Path) -> None:
    written(tmp_path, [1])
    (tmp_path / ".abc.json").write_text("{")  # a temporary name
    assert Checkpoint(tmp_path, KEY).load() == [1]


def test_a_kill_while_a_file_is_written_leaves_the_file_that_was_there(tmp_path: Path) -> None:
    path = tmp_path / "state.json"
    write_text(path, "old" * 100_000)
    run = subprocess.run(
        [sys.executable, "-c", KILLED_IN_WRITING, path],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
        check=False,
    )
    assert run.returncode == -signal.SIGXFSZ
    assert path.read_text() == "old" * 100_000


def test_no_file_has_its_name_before_it_is_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept = written(tmp_path, [1])
    before = {path: path.read_bytes() for path in parts(tmp_path)}
    write = Path.write_text

    def full_disk(path: Path, text: str, **options: Any) -> int:
        write(path, text[: len(text) // 2], **options)
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    kept.add(2)
    with monkeypatch.context() as broken:
        broken.setattr(Path, "write_text", full_disk)
        with pytest.raises(OSError, match=os.strerror(errno.ENOSPC)):
            kept.save()
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before
    kept.save()
    assert Checkpoint(tmp_path, KEY).load() == [1, 2]


def parts(folder: Path) -> list[Path]:
    return sorted(folder.glob("part-*.json"))
