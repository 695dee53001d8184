"""Tests of campaigns: their cases, their stored results, and their files after a kill."""

import json
import sqlite3
from contextlib import closing
from itertools import islice
from pathlib import Path

import pytest

from magfold_bench.stress import campaign, laws
from magfold_bench.stress.campaign import BLOCK, Case, ordered, run
from magfold_bench.stress.kinds import KINDS
from magfold_bench.stress.verdict import Tally, Verdict
from magfold_env.checkpoint import FILE, CheckpointError
from magfold_env.scene import SceneError, load_scene
from tests.command_line import fails_in_one_line, rows
from tests.command_line import run as command

CASES = 2 * BLOCK + 5
BROKEN = "overlapping-0-3"


@pytest.fixture
def _checked_quickly(monkeypatch: pytest.MonkeyPatch) -> None:
    """Check a case by its name; one case violates a law."""

    def verdict(case: Case) -> Verdict:
        found = Verdict(status="folded")
        found.bound("law", 2.0 if case.name == BROKEN else 0.01 * case.number, 1.0, "too much")
        return found

    monkeypatch.setattr(Case, "verdict", verdict)


def counts(tally: Tally) -> dict[str, object]:
    return {key: value for key, value in vars(tally).items() if key != "seconds"}


def test_a_case_does_not_depend_on_what_else_is_tried() -> None:
    alone = list(islice(ordered(3, ["stops"]), 5))
    among = [case for case in islice(ordered(3, list(KINDS)), 200) if case.kind == "stops"]
    assert among[:5] == alone == [Case(3, "stops", number) for number in range(5)]


@pytest.mark.usefixtures("_checked_quickly")
def test_a_campaign_counts_and_saves_what_breaks_a_law(tmp_path: Path) -> None:
    tally = run(CASES, 0, ["overlapping"], out=tmp_path)
    assert tally.cases == CASES == tally.held["law"]
    assert tally.worst["law"] == (0.01 * (CASES - 1), f"overlapping-0-{CASES - 1}")
    (failure,) = tally.failures
    assert (failure["case"], failure["kind"]) == (BROKEN, "overlapping")
    assert [law for law, _ in failure["broken"]] == ["law"]
    path = tmp_path / "failures" / f"{BROKEN}.yaml"
    assert list(path.parent.iterdir()) == [path]
    assert load_scene(path) == Case(0, "overlapping", 3).scene()
    assert "# law: too much: 2, allowed 1\n" in path.read_text(encoding="utf-8")


@pytest.mark.usefixtures("_checked_quickly")
def test_it_goes_on_where_it_was(tmp_path: Path) -> None:
    whole = run(CASES, 0, ["overlapping"])
    assert run(BLOCK, 0, ["overlapping"], out=tmp_path).cases == BLOCK
    seen: list[int] = []
    again = run(
        CASES, 0, ["overlapping"], out=tmp_path, progress=lambda tally: seen.append(tally.cases)
    )
    assert seen == [2 * BLOCK, CASES]
    assert counts(again) == counts(whole)
    with pytest.raises(CheckpointError, match="whose seed is 0 where this one's is 1"):
        run(CASES, 1, ["overlapping"], out=tmp_path)


@pytest.mark.usefixtures("_checked_quickly")
def test_a_block_counts_once(tmp_path: Path) -> None:
    run(CASES, 0, ["overlapping"], out=tmp_path)
    with closing(sqlite3.connect(tmp_path / "state" / FILE)) as database, database:
        database.execute("INSERT INTO records SELECT number + 9, record FROM records")
    assert run(CASES, 0, ["overlapping"], out=tmp_path).cases == CASES
    for cases in (CASES - 7, CASES):  # its last block is smaller, and in the other's place
        assert run(cases, 0, ["overlapping"], out=tmp_path).cases == cases


def test_an_error_that_is_raised_breaks_a_law_and_ends_no_campaign(monkeypatch, tmp_path):
    def fails(_: object) -> None:
        raise ZeroDivisionError("by zero")

    monkeypatch.setattr("magfold_bench.stress.campaign.check", fails)
    verdict = Case(0, "stops", 0).verdict()
    assert [str(each) for each in verdict.broken] == ["no exception: ZeroDivisionError: by zero"]

    def refused(_: object) -> None:
        raise SceneError("friction: -1 is not allowed; must be at least 0")

    monkeypatch.setattr(Case, "scene", refused)
    tally = run(3, 0, ["stops"], out=tmp_path)
    assert tally.cases == len(tally.failures) == 3


def test_no_floor_is_drawn_with_an_obstacle_in_line_with_the_bore() -> None:
    assert Case(83, "tilted", 11).scene().obstacles


def test_the_command_shows_and_writes_what_was_found(tmp_path: Path) -> None:
    options = ("--cases", 30, "--only", "overlapping", "--out", tmp_path)
    result = command("stress", *options, code=0)
    table = rows(result.stdout)
    assert table[0] == ["overlapping", "overlapping starts", "30", *"0000", "0", "30", "0"]
    data = json.loads((tmp_path / "stress.json").read_text(encoding="utf-8"))
    assert data["cases"] == 30
    assert data["failures"] == []


@pytest.mark.usefixtures("_checked_quickly")
def test_the_command_fails_where_a_law_is_broken(tmp_path: Path) -> None:
    result = command("stress", "--cases", 20, "--only", "overlapping", "--out", tmp_path, code=1)
    assert BROKEN in result.stdout


def test_a_scene_is_judged_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = Case(0, "overlapping", 0).save(["law: words"], tmp_path)
    result = command("stress", "--rerun", path, code=0)
    assert ["refusal", "0", ""] in rows(result.stdout)
    monkeypatch.setattr(laws, "REFUSAL", "another message")
    result = command("stress", "--rerun", path, code=1)
    assert "no breakdown" in result.stdout


def test_what_a_scene_leaves_to_chance_is_drawn_by_the_seed(quick: str) -> None:
    seen = [command("stress", "--rerun", quick, "--seed", seed) for seed in (1, 2, 1)]
    assert [result.exit_code for result in seen] == [0, 0, 0]
    first, other, again = (result.stdout for result in seen)
    assert first == again != other
    told = "seed: -1 is not allowed"
    fails_in_one_line(command("stress", "--rerun", quick, "--seed", -1), told)


@pytest.mark.usefixtures("_checked_quickly")
def test_time_ends_it(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = iter(range(0, 1000, 50))
    monkeypatch.setattr(campaign.time, "monotonic", lambda: float(next(clock)))
    # Begun at 0 s, then looked at before every block.
    assert run(1000, 0, ["overlapping"], minutes=2.0).cases == 2 * BLOCK
