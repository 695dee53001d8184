"""The `magfold bench` commands: what their help says."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from magfold_bench import suite
from magfold_bench.parts import BENCHMARKS
from magfold_bench.presentation import Summary, descriptions
from magfold_env.cli import app, measurement, options


@pytest.mark.parametrize(("name", "summary"), descriptions().items(), ids=list(descriptions()))
def test_help_names_every_part(name: str, summary: Summary) -> None:
    result = CliRunner().invoke(app.app, ["bench", name, "--help"])
    assert result.exit_code == 0
    said = " ".join(result.stdout.split())
    assert summary.measures in said
    # A line may end at a hyphen.
    parts = f"A part: {', '.join(BENCHMARKS[name])}; may repeat."
    assert parts.replace(" ", "") in said.replace(" ", "")


def test_help_lists_every_benchmark() -> None:
    result = CliRunner().invoke(app.app, ["bench", "--help"])
    listed = [line.split()[0] for line in result.stdout.split("Commands:")[1].split("\n") if line]
    assert listed == [*descriptions(), "stress", "paper"]


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


@pytest.mark.parametrize(
    "arguments", [["bench", "--quick"], ["bench", "dynamics", "--only", "folds"], ["stress"]]
)
def test_without_a_checkout_a_command_says_how_to_get_one(
    arguments: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(measurement, "find_spec", lambda _: None)
    installed = options.Application()
    measurement.add_to(installed)
    result = CliRunner().invoke(installed, arguments)
    assert (result.exit_code, result.stdout) == (2, "")
    assert result.stderr.startswith(f"error: {arguments[0]}: ")
    assert "pip install -e ." in result.stderr
    assert "python -m magfold_bench" in result.stderr
