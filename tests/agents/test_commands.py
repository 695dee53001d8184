"""Tests of all commands: a common form, and errors in one line before any work."""

import os
import sys
from pathlib import Path
from typing import Annotated, Any

import pytest
import typer

from agents.commands import needing, run_command, text_table
from magfold_env.cli import options
from tests.command_line import interrupt_import, python

REMEDY = "install the extra, pip install -e '.[agents]'"


def without(missing: str, folder: Path, *arguments: str) -> Any:
    """Run Python without a package."""
    (folder / "sitecustomize.py").write_text(f"import sys\nsys.modules[{missing!r}] = None\n")
    path = os.pathsep.join([str(folder), *sys.path])
    return python(*arguments, check=False, PYTHONPATH=path)


@pytest.mark.parametrize("missing", ["torch", "stable_baselines3"])
def test_commands_without_their_extra_tell_it_in_one_line(missing: str, tmp_path: Path) -> None:
    done = without(missing, tmp_path, "-m", "agents.train", "ppo-tube-feed")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == f"error: agents need Stable-Baselines3: {REMEDY}\n"


def test_ctrl_c_in_imports_ends_commands_quietly(tmp_path: Path) -> None:
    interrupt_import("agents.commands", tmp_path)
    path = os.pathsep.join([str(tmp_path), *sys.path])
    done = python("-m", "agents.train", "ppo-tube-feed", check=False, PYTHONPATH=path)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "interrupted\n")


@pytest.mark.medium
def test_a_command_names_an_extra_of_its_own(tmp_path: Path) -> None:
    done = without("optuna", tmp_path, "-m", "agents.tune", "ppo-tube-feed")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("error: ")
    assert done.stderr.endswith("; install it, pip install -e '.[tune]'\n")
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize("module", ["agents.settings", "magfold_env.sb3"])
def test_imports_without_the_extra_end_with_it(module: str, tmp_path: Path) -> None:
    done = without("stable_baselines3", tmp_path, "-c", f"import {module}")
    assert done.returncode == 1
    last = done.stderr.splitlines()[-1]
    assert last.startswith("ImportError: ")
    assert last.endswith(REMEDY)


def command(wrong: Annotated[str, typer.Option(help="What is wrong.")] = "") -> None:
    """Do nothing."""
    with needing("minari"):
        if wrong == "module":
            raise ModuleNotFoundError("No module named 'minari'")
    if wrong == "folder":
        raise NotADirectoryError("out: is not a folder")
    if wrong:
        raise ValueError(f"{wrong}: is not allowed\nnor is {wrong!r}")


def call(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> Any:
    """Return the exit code of the command."""
    monkeypatch.setattr(sys, "argv", ["command", *arguments])
    with pytest.raises(SystemExit) as end:
        run_command(command)
    return end.value.code


def test_help_is_told_plainly_and_errors_in_one_line(monkeypatch, capsys):
    assert call(monkeypatch, "--help") == 0
    told = capsys.readouterr().out
    assert "--wrong" in told
    assert "─" not in told
    assert call(monkeypatch, "--none") == 2
    told = capsys.readouterr().err
    assert "No such option: --none" in told
    assert "─" not in told
    monkeypatch.setenv("COLUMNS", "80")
    long = "/".join(["folder"] * 20)
    for given, said in (
        (long, f"{long}: is not allowed; nor is '{long}'"),
        ("folder", "out: is not a folder"),
        ("module", "No module named 'minari'; install it, pip install -e '.[minari]'"),
    ):
        assert call(monkeypatch, "--wrong", given) == 2
        assert capsys.readouterr() == ("", f"error: {said}\n")


def test_names_in_tables_are_whole(monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "80")
    methods = [f"a-method-with-a-long-name-{k}" for k in range(4)]
    target = "LRSLRSLRSLRSLRSLRSLRSLRSLRSLR"
    options.show(text_table("", [{"target": target, **dict.fromkeys(methods, "18/20")}]))
    told = capsys.readouterr().out
    assert all(name in told for name in (*methods, target))
