"""The energy benchmark: its parts, its report, and the time its searches may take."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from magfold_bench import predictors
from magfold_bench.parts import BENCHMARKS
from magfold_env.cli import app


@pytest.mark.parametrize("name", [*BENCHMARKS["energy"]])
@pytest.mark.parametrize(
    "little",
    [pytest.param(True, id="little"), pytest.param(False, id="quick", marks=pytest.mark.slow)],
)
def test_every_part_runs_and_is_written(
    little: bool, name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if little:
        monkeypatch.setattr(predictors, "SCANNED", 5)
        monkeypatch.setattr(predictors, "COMPARED", (4, 6))
    arguments = ["bench", "energy", "--quick", "--only", name, "--out", str(tmp_path)]
    result = CliRunner().invoke(app.app, arguments)
    assert result.exit_code == 0, result.stderr
    data = json.loads((tmp_path / "energy.json").read_text(encoding="utf-8"))
    assert data["parts"][name]["rows"]
    assert {path.name for path in tmp_path.iterdir()} == {"energy.json", f"{name}.csv"}


def test_an_unknown_part_is_named() -> None:
    wrong = CliRunner().invoke(app.app, ["bench", "energy", "--only", "rest"])
    assert wrong.exit_code == 2
    assert "must be one of scan, ground-states, predictors" in wrong.stderr


def silent(_share: float, _what: str) -> None:
    pass


@pytest.mark.bench
def test_scans_and_proofs_keep_within_their_time() -> None:
    findings = [
        *predictors.scan(False, silent).findings,
        *predictors.ground_states(False, silent).findings,
    ]
    assert findings
    assert not [finding for finding in findings if "NOT within" in finding]
