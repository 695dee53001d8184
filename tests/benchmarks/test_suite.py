"""Tests of the suite: it stores finished parts, rejects those of other runs, and reports all."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path

import pytest

from magfold_bench import suite
from magfold_bench.parts import Part
from magfold_bench.presentation import Description
from magfold_bench.suite import Entry, Result
from magfold_bench.tables import Measurement, Progress, Table
from magfold_bench.timing import Spread
from magfold_env.checkpoint import CheckpointError

pytest.importorskip("matplotlib.figure")

ABOUT = Description("A <title>", "what", "how so", "meaning", "missing things")


class Measured:
    """A benchmark of two parts that counts how often each is measured."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.asked: list[str] = []
        self.broken: BaseException | None = None
        entries = [Entry("fake", name, Part(self._part(name)), ABOUT) for name in ("one", "two")]
        monkeypatch.setattr(suite, "entries", lambda *_: entries)
        monkeypatch.setattr(suite, "measure_pace", lambda: Spread(2e-3, 1e-3, 3e-3))

    def _part(self, name: str) -> Callable[[bool, Progress], Measurement]:
        def run(quick: bool, progress: Progress) -> Measurement:
            progress(0.5, "half")
            self.asked.append(name)
            if name == "two" and self.broken is not None:
                raise self.broken
            rows = [{"z": "x", "error": math.nan, "a": 3}]
            return Measurement(rows, [Table(f"table {name}", rows)], ["it is required: FAILS"])

        return run


@pytest.fixture
def measured(monkeypatch: pytest.MonkeyPatch) -> Measured:
    return Measured(monkeypatch)


@pytest.mark.medium
def test_everything_is_reported_on_one_page(measured: Measured, tmp_path: Path) -> None:
    assert suite.run("quick", tmp_path / "new" / "folder")
    out = tmp_path / "new" / "folder"
    assert measured.asked == ["one", "two"]
    page = (out / "report.html").read_text(encoding="utf-8")
    for said in ("A &lt;title&gt;", ABOUT.how, ABOUT.missing, "table two", "falls short", "never"):
        assert said in page
    for value in suite.identify().values():
        assert value in page
    assert page.index("0 of 2 requirements are met") < page.index("<table")
    assert page.index("<table") < page.index("Missed requirements (2)")
    assert page.index("<h2>") < page.index('class="verdict bad"') < page.index("table one")
    assert "http://" not in page
    assert "https://" not in page
    assert "magfold bench fake --only one --quick" in page
    results = json.loads((out / "bench.json").read_text(encoding="utf-8"))
    assert [part["name"] for part in results["parts"]] == ["fake one", "fake two"]
    assert (out / "fake" / "one.csv").read_text(encoding="utf-8").startswith("z,error,a\n")


@pytest.mark.medium
def test_a_killed_run_goes_on(measured: Measured, tmp_path: Path) -> None:
    measured.broken = KeyboardInterrupt()
    with pytest.raises(KeyboardInterrupt):
        suite.run("full", tmp_path)
    assert not (tmp_path / "report.html").exists()
    measured.broken = None
    assert suite.run("full", tmp_path)
    assert measured.asked == ["one", "two", "two"]
    first = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert suite.run("full", tmp_path)
    assert measured.asked == ["one", "two", "two"]
    # Columns are in their own order, whether kept or fresh.
    assert first.index(">z<") < first.index(">error<") < first.index(">a<")
    assert first.count("<td") == (tmp_path / "report.html").read_text("utf-8").count("<td")


@pytest.mark.medium
def test_another_runs_parts_are_refused(measured, tmp_path, monkeypatch):
    suite.run("full", tmp_path)
    with pytest.raises(CheckpointError, match="effort"):
        suite.run("quick", tmp_path)
    another = suite.identify() | {"sources": "another"}
    monkeypatch.setattr(suite, "identify", lambda: another)
    with pytest.raises(CheckpointError, match=r"sources is .* 'another'"):
        suite.run("full", tmp_path)
    assert {"commit", "sources", "processor", "numba"} <= set(another)


@pytest.mark.medium
def test_a_part_that_breaks_loses_no_other(measured, tmp_path, capsys):
    measured.broken = ArithmeticError("two <contenders> disagree")
    assert not suite.run("full", tmp_path)
    assert "ArithmeticError: two <contenders> disagree" in capsys.readouterr().out
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "two &lt;contenders&gt; disagree" in page
    assert "1 of 2" in page
    measured.broken = None
    assert suite.run("full", tmp_path)
    assert measured.asked == ["one", "two", "two"]


def test_a_part_is_kept_as_it_is() -> None:
    rows = [{"z": "x", "error": math.inf, "a": 3, "b": 2.0}, {"z": "y", "error": 0.5}]
    found = Measurement(rows, [Table("table", rows[:1])], ["found"])
    done = Result("bench name", found, 1.5, (0.1, 0.2))
    text = json.dumps(done.to_json(), allow_nan=False)
    back = Result.from_json(json.loads(text))
    assert math.isnan(float(back.found.rows[0].pop("error")))
    assert back.found.rows == [{"z": "x", "a": 3, "b": 2.0}, {"z": "y", "error": 0.5}]
    assert [list(row) for row in back.found.rows] == [["z", "a", "b"], ["z", "error"]]
    assert isinstance(back.found.rows[0]["a"], int)
    assert back.name == "bench name"
    assert (back.seconds, back.pace) == (done.seconds, done.pace)
    assert back.found.findings == ["found"]
