"""The `magfold bench` commands: what their help says."""

from importlib import import_module

import pytest
from typer.testing import CliRunner

from magfold_env import cli
from magfold_env.cli_bench import BENCHMARKS, Benchmark


@pytest.mark.parametrize("benchmark", BENCHMARKS, ids=[each.name for each in BENCHMARKS])
def test_help_names_every_part(benchmark: Benchmark) -> None:
    command = import_module(f"magfold_env.benchmarks.{benchmark.name}.command")
    assert benchmark.parts == ", ".join(command.PARTS)
    result = CliRunner().invoke(cli.app, ["bench", benchmark.name, "--help"])
    assert result.exit_code == 0
    said = " ".join(result.stdout.split())
    assert benchmark.measures in said
    assert f"A part: {benchmark.parts}; may repeat." in said


def test_help_lists_every_benchmark() -> None:
    result = CliRunner().invoke(cli.app, ["bench", "--help"])
    listed = [line.split()[0] for line in result.stdout.split("Commands:")[1].split("\n") if line]
    assert listed == [each.name for each in BENCHMARKS]
