"""Files of a long run: whole or refused, and only for the run that wrote them."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from magfold_env import checkpoint
from magfold_env.checkpoint import Checkpoint, CheckpointError

KEY = {"seed": 1, "scene": {"friction": 0.35, "sequence": ("NSNS", "SNSN")}}


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


def parts(folder: Path) -> list[Path]:
    return sorted(folder.glob("part-*.json"))
