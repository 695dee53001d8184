"""The `magfold bench` commands: what their help says."""

from importlib import import_module
from pathlib import Path

import pytest
from typer.testing import CliRunner

from magfold_env.benchmarks.suite import command as suite
from magfold_env.cli import app
from magfold_env.cli.bench import BENCHMARKS, Benchmark


@pytest.mark.parametrize("benchmark", BENCHMARKS, ids=[each.name for each in BENCHMARKS])
def test_help_names_every_part(benchmark: Benchmark) -> None:
    command = import_module(f"magfold_env.benchmarks.{benchmark.name}.command")
    assert benchmark.parts == ", ".join(command.PARTS)
    result = CliRunner().invoke(app.app, ["bench", benchmark.name, "--help"])
    assert result.exit_code == 0
    said = " ".join(result.stdout.split())
    assert benchmark.measures in said
    assert f"A part: {benchmark.parts}; may repeat." in said


def test_help_lists_every_benchmark() -> None:
    result = CliRunner().invoke(app.app, ["bench", "--help"])
    listed = [line.split()[0] for line in result.stdout.split("Commands:")[1].split("\n") if line]
    assert listed == [each.name for each in BENCHMARKS]


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--quick", "--full"], "one of --quick and --full must be given"),
        (["--out", "x"], "one of --quick and --full must be given"),
        (["--quick", "dynamics"], "before 'dynamics' are the suite's"),
    ],
)
def test_the_suite_tells_what_it_needs(arguments: list[str], told: str) -> None:
    result = CliRunner().invoke(app.app, ["bench", *arguments])
    assert result.exit_code == 2
    assert told in result.stderr


def test_the_suite_runs_with_the_effort_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[tuple[str, Path]] = []

    def run(effort: str, out: Path) -> bool:
        asked.append((effort, out))
        return effort == "quick"

    monkeypatch.setattr(suite, "run", run)
    assert CliRunner().invoke(app.app, ["bench", "--quick"]).exit_code == 0
    assert CliRunner().invoke(app.app, ["bench", "--full", "--out", "there"]).exit_code == 1
    assert asked == [("quick", Path("runs/bench-quick")), ("full", Path("there"))]
