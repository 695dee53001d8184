"""Tests of `magfold bench design` on a few targets."""

import json

import pytest
from typer.testing import CliRunner

import magfold_env as mf
from magfold_bench import design
from magfold_env.cli import app
from magfold_env.ensembles.releases import release
from magfold_env.shapes import folded_words


@pytest.mark.medium
def test_targets_are_judged_beside_the_minimiser(tmp_path, monkeypatch):
    monkeypatch.setattr(design, "folded_words", lambda n: folded_words(n)[:1])
    monkeypatch.setattr(design, "SELECTION", 2)
    command = ["bench", "design", "--quick", "--only", "targets", "--out", str(tmp_path)]
    result = CliRunner().invoke(app.app, command)
    assert result.exit_code == 0, result.output
    rows = json.loads((tmp_path / "design.json").read_text())["parts"]["targets"]["rows"]
    assert {row["mode"] for row in rows} == {"free", "forward", "backward"}
    row = next(row for row in rows if row["mode"] == "forward")
    scene = release(mf.load_scene("design"), "forward", row["speed [m/s]"])
    assert len(row["target"]) == 3
    found = mf.design(row["target"], runs=10)
    assert found.scene == scene.replace(sequence=row["sequence"].split())
    assert found.probability is not None
    assert row["successes"] == found.probability.successes
    assert "mean" in result.output
