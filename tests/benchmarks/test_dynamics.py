"""One benchmark's command: the parts that it measures, the files that it writes."""

import csv
import json
import sys

import pytest
from typer.testing import CliRunner

from magfold_bench import parts, tables
from magfold_bench.parts import Part
from magfold_bench.tables import Measurement, Table
from magfold_env.cli import app


def example():
    rows = [{"error [rad]": 0.1 / 4**k} for k in range(4)] + [{"error [rad]": float("nan")}]
    return Measurement(rows, [Table("Errors [rad]", rows)], ["it [holds]"])


def test_files_hold_what_was_measured(tmp_path):
    found = example()
    paths = tables.write(tmp_path, "dynamics", {"processor": "µ"}, {"folds": found})
    assert [path.name for path in paths] == ["folds.csv", "dynamics.json"]
    with paths[0].open(encoding="utf-8", newline="") as file:
        read = list(csv.DictReader(file))
    assert [float(row["error [rad]"]) for row in read[:4]] == [0.1 / 4**k for k in range(4)]
    data = json.loads(paths[1].read_text(encoding="utf-8"))
    assert data["machine"] == {"processor": "µ"}
    assert data["parts"]["folds"]["findings"] == ["it [holds]"]
    assert data["parts"]["folds"]["rows"][-1]["error [rad]"] is None
    assert {path.name for path in tmp_path.iterdir()} == {path.name for path in paths}


def test_the_command_measures_the_parts_it_is_asked_for(tmp_path, monkeypatch):
    asked = []

    def part(quick, progress):
        progress(0.5, "half")
        asked.append(quick)
        return example()

    chosen = {"folds": Part(part), "scaling": Part(part)}
    monkeypatch.setitem(parts.BENCHMARKS, "dynamics", chosen)
    out = tmp_path / "new" / "folder"
    arguments = ["bench", "dynamics", "--quick", "--only", "folds", "--out", str(out)]
    result = CliRunner().invoke(app.app, arguments)
    assert result.exit_code == 0, result.stderr
    assert asked == [True]
    assert "it [holds]" in result.stdout
    assert "Errors [rad]" in result.stdout
    assert (out / "folds.csv").is_file()
    wrong = CliRunner().invoke(app.app, ["bench", "dynamics", "--only", "rest"])
    assert wrong.exit_code == 2
    assert "'rest' is not allowed; must be one of folds, scaling" in wrong.stderr


def test_missing_extras_are_told_before_the_work(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    chosen = {"scaling": Part(lambda *_: pytest.fail("measured"))}
    monkeypatch.setitem(parts.BENCHMARKS, "dynamics", chosen)
    result = CliRunner().invoke(app.app, ["bench", "dynamics", "--out", str(tmp_path)])
    assert result.exit_code == 2
    assert "diagrams need matplotlib" in result.stderr
