"""One benchmark's command: the parts that it measures, the files that it writes."""

from typer.testing import CliRunner

from magfold_bench import parts
from magfold_bench.parts import Part
from magfold_env.cli import app
from magfold_env.reporting.tables import Measurement, Table


def example():
    rows = [{"error [rad]": 0.1 / 4**k} for k in range(4)] + [{"error [rad]": float("nan")}]
    return Measurement(rows, [Table("Errors [rad]", rows)], ["it [holds]"])


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
