"""Tests that the scoreboard shows the contents of the result files."""

from pathlib import Path

import pytest

from agents import scoreboard
from magfold_env.scoring.results import Results, Row, Run, summed
from tests.agents.training import call
from tests.command_line import fails_in_one_line

FLOOR, LUMEN = "MagFold/UnknownFloor-v0", "MagFold/Lumen-v0"
RATES = {"random": 0.2, "always forward": 0.4, "open loop": 0.5, "oracle": 0.9}


def score(
    folder: Path, name: str, successes: int, kind: str = "policy", env_id: str = FLOOR
) -> None:
    """Write a score of ten episodes with a number of successes."""
    ended = [float(k < successes) for k in range(10)]
    run = Run.of(ended, task=(0,) * 10, score=tuple(ended))
    file = {"name": name, "sha256": "ab" * 32}
    Results(
        view="score", id=env_id, draws=2, seed=7, physics="0123456789abcdef", provenance={},
        rows={name: Row(**summed(run), **{"kind": kind, "files": (file,), "runs": (run,)})},
    ).write(folder / f"{name}.json")  # fmt: skip


def admission(
    folder: Path, name: str = "admission-floor.json", rates: dict[str, float] = RATES
) -> None:
    """Write results of an admission as a rehearsal might write them."""
    rows = {
        name: Row(success=(rate, rate - 0.05, rate + 0.06), score=rate)
        for name, rate in rates.items()
    }
    Results(
        view="admission", id=FLOOR, draws=2, physics="fedcba9876543210", provenance={}, rows=rows,
        figures={"episodes": 1000},
    ).write(folder / name)  # fmt: skip


def tables(page: str) -> dict[str, list[list[str]]]:
    """Return the cells of each track's rows, without headings."""
    found: dict[str, list[list[str]]] = {}
    for part in page.split("\n## `")[1:]:
        lines = [line for line in part.splitlines() if line.startswith("| ")][1:]
        cells = [[cell.strip() for cell in line.split("|")[1:-1]] for line in lines]
        assert {len(each) for each in cells} <= {len(scoreboard.COLUMNS)}
        found[part.partition("`")[0]] = cells
    return found


def test_the_page_is_that_of_its_files() -> None:
    made = scoreboard.page(scoreboard.SCORES)
    assert scoreboard.PAGE.read_text(encoding="utf-8") == made


def test_scores_stand_between_random_actions_and_the_oracle(tmp_path: Path) -> None:
    admission(tmp_path)
    score(tmp_path, "good", 9)
    score(tmp_path, "bad", 2)
    score(tmp_path, "chosen", 10, kind="actions")
    out = tmp_path / "page.md"
    call("scoreboard", "--scores", tmp_path, "--output", out, code=0)
    found = tables(out.read_text(encoding="utf-8"))
    names = [row[0] for row in found[FLOOR]]
    assert names == ["random", "always forward", "oracle", "chosen", "good", "bad"]
    rows = {row[0]: dict(zip(scoreboard.COLUMNS, row, strict=True)) for row in found[FLOOR]}
    assert [rows[name]["normalised"] for name in ("random", "oracle")] == ["0.000", "1.000"]
    assert rows["good"]["normalised"] == "1.000"
    assert rows["always forward"]["normalised"] == "0.286"  # (0.4 - 0.2) / (0.9 - 0.2)
    assert {row["failure floor"] for row in rows.values()} == {"10.0 % (4.0–15.0)"}
    # Wilson's, of 9 in 10.
    assert rows["good"]["success"] == "90.0 % (59.6–98.2)"
    privileged = {name for name, row in rows.items() if row["privileged"] != "–"}
    assert privileged == {"oracle", "chosen"}
    assert {name for name, row in rows.items() if row["success"] == "–"} == privileged
    assert (rows["good"]["seed"], rows["good"]["physics"]) == ("7", "`01234567`")


def test_what_no_oracle_has_played_is_said(tmp_path: Path) -> None:
    score(tmp_path, "good", 9, env_id=LUMEN)
    found = tables(scoreboard.page(tmp_path))
    assert [row[0] for row in found[FLOOR]] == ["random", "always forward", "oracle"]
    row = dict(zip(scoreboard.COLUMNS, found[LUMEN][3], strict=True))
    assert row["failure floor"] == row["normalised"] == "no oracle yet"
    assert row["score"] == "0.900"


@pytest.mark.parametrize("folder", ["no-such-folder", "."])
def test_a_page_of_no_scores_is_not_written(folder: str, tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("old")
    told = call("scoreboard", "--scores", tmp_path / folder, "--output", page)
    fails_in_one_line(told, f"scores: '{tmp_path / folder}' is not allowed; must be a folder with")
    assert page.read_text() == "old"


def test_what_is_not_understood_is_named(tmp_path: Path) -> None:
    def refused(name: str, message: str) -> None:
        with pytest.raises(ValueError, match=f"{name}: {message}"):
            scoreboard.page(tmp_path)

    admission(tmp_path)
    admission(tmp_path, "admission-two.json")
    refused("admission-two.json", "id: 'MagFold/UnknownFloor-v0' is not allowed")
    admission(tmp_path, "admission-two.json", {"random": 0.1})
    (tmp_path / "admission-floor.json").unlink()
    refused("admission-two.json", r"rows: \['random'\] is not allowed; must have always forward")
    (tmp_path / "admission-two.json").unlink()
    score(tmp_path, "elsewhere", 1, env_id="MagFold/TubeFeed-v0")
    refused("elsewhere.json", "id: 'MagFold/TubeFeed-v0' is not allowed")
    (tmp_path / "elsewhere.json").write_text("{}", encoding="utf-8")
    refused("elsewhere.json", "is not a file of results")
