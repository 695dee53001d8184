"""Tests of the `magfold bench` commands: their help, and their errors without a checkout."""

import runpy
import sys

import pytest
from typer.testing import CliRunner

from magfold_bench.presentation import descriptions
from magfold_env.cli import app, options


def test_help_lists_every_benchmark() -> None:
    result = CliRunner().invoke(app.app, ["bench", "--help"])
    listed = [line.split()[0] for line in result.stdout.split("Commands:")[1].split("\n") if line]
    assert listed == [*descriptions(), "stress", "paper"]


@pytest.mark.parametrize(
    "arguments", [["bench", "--quick"], ["bench", "dynamics", "--only", "folds"], ["stress"]]
)
def test_without_a_checkout_a_command_prints_how_to_get_one(arguments, monkeypatch):
    monkeypatch.setattr(app, "find_spec", lambda _: None)
    installed = options.application()
    app.add_measurement(installed)
    result = CliRunner().invoke(installed, arguments)
    assert (result.exit_code, result.stdout) == (2, "")
    assert result.stderr.startswith(f"error: {arguments[0]}: ")
    assert "pip install -e ." in result.stderr
    assert "python -m magfold_bench" in result.stderr


@pytest.mark.parametrize("module", [
    "lists.baselines", "lists.suites", "lists.tasks", "paper.judge", "stress.agreement",
])  # fmt: skip
def test_modules_that_are_commands_word_errors_as_magfold_does(module, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", [module, "--none"])
    monkeypatch.delitem(sys.modules, f"magfold_bench.{module}", raising=False)
    with pytest.raises(SystemExit) as end:
        runpy.run_module(f"magfold_bench.{module}", run_name="__main__")
    assert end.value.code == 2
    told = capsys.readouterr().err.splitlines()
    assert told[-1].startswith("Error: No such option: --none")
