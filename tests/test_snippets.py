"""Tests that all snippets and commands on the pages run."""

import re
import shlex
import shutil
from collections.abc import Sequence
from contextlib import redirect_stdout
from importlib import import_module
from importlib.util import find_spec
from io import StringIO
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import typer
import yaml
from click.testing import CliRunner

import magfold_env as mf
from agents import record
from agents.evaluation.shipped import shipped_files
from agents.settings import load_settings
from agents.tune import load_search
from magfold_bench.paper.run import PARTS
from magfold_bench.presentation import descriptions
from magfold_bench.stress.kinds import KINDS
from magfold_env.cli import app, options
from magfold_env.envs.tasks.feed_tasks import read_tasks
from magfold_env.shapes import folded_words
from tests import snippets

# Options that let a command do less, so that it takes seconds.
LESS = {
    "magfold ensemble": ["--runs=4"], "magfold sweep": ["--runs=2"],
    "magfold design": ["--budget=50", "--runs=4"], "magfold score": ["--episodes=24"],
    "magfold stress": ["--cases=4", "--workers=1"],
    "magfold paper": ["--quick", "--only=figure-15"], "magfold fold": [], "magfold holding": [],
    "magfold minimise": [], "magfold scenes": [], "agents.ablate": ["--draws=1", "--seeds=1"],
    "agents.admission": ["--tasks=1", "--episodes=2", "--search", "2", "2", "--race", "2", "2"],
    "agents.baselines": ["--budget=1"], "agents.evaluate": ["--draws=1"],
    "agents.train": ["--timesteps=1", "--set=validation_episodes=26", "--set=pretraining=[]"],
}  # fmt: skip
LIBRARIES = snippets.ROOT / "docs" / "libraries.md"
PLACEHOLDERS = {"COMMAND": "fold", "NAME": "design", "SEED": "1"}


def pages_with(language: str, but: Path | None = None) -> list[Any]:
    found = [page for page in snippets.PAGES if page != but and snippets.blocks(page, language)]
    return [pytest.param(page, id=str(page.relative_to(snippets.ROOT))) for page in found]


@pytest.mark.slow
@pytest.mark.parametrize("page", pages_with("python", but=LIBRARIES))
def test_lines_of_python_run_and_print_what_they_say(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    if "import minari" in page.read_text("utf-8"):
        record.main("MagFold/TubeFeed-v0", episodes=2)
    space: dict[str, Any] = {}
    for block in snippets.blocks(page, "python"):
        for code, comment in snippets.statements(block):
            printed = StringIO()
            with redirect_stdout(printed):
                exec(code, space)
            if code.startswith("print("):
                for number in re.findall(r"\d+\.\d+|\d+(?= %)", comment):
                    assert number in printed.getvalue(), f"{code}: {printed.getvalue()}"


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")  # of others
@pytest.mark.parametrize("library", ["torch", "skrl", "torchrl", "tianshou"])
def test_other_libraries_train(
    library: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip(library)
    monkeypatch.chdir(tmp_path)
    first, *others = snippets.blocks(LIBRARIES, "python")
    space: dict[str, Any] = {}
    exec(first, space)
    exec(next(block for block in others if f"{library}." in block), space)
    if library in ("torch", "tianshou"):  # the others' programs leave no score of a learner
        assert space["score"] > 0.9


@pytest.mark.parametrize("page", pages_with("yaml"))
def test_settings_are_ones_that_are_read(page: Path, tmp_path: Path) -> None:
    for block in snippets.blocks(page, "yaml"):
        file = tmp_path / "told.yaml"
        file.write_text(block, "utf-8")
        told = yaml.safe_load(block)
        if isinstance(told, list):
            read_tasks(file)
        elif "learner" in told:
            load_settings(file)
        elif "space" in told:
            load_search(str(file))
        else:
            given = {"sequence": ["SNNS", "NNSN"], **told}
            assert mf.Scene(**given).mount == "tube"


def command_line(words: Sequence[str]) -> tuple[str, Any, list[str]] | None:
    """Return the name of a project's command, the command itself, and its arguments."""
    if words[0] == "magfold":
        return " ".join(words[:2]), typer.main.get_command(app.app), list(words[1:])
    if words[:2] == ["python", "-m"] and words[2].startswith("agents."):
        package = find_spec(words[2])
        assert package is not None, words
        inside = ".__main__" if package.submodule_search_locations else ""
        module = import_module(words[2] + inside)
        application = getattr(module, "app", None)
        if application is None:
            application = options.application_of(module.main)
        return words[2], typer.main.get_command(application), list(words[3:])
    return None


def only_read(command: Any) -> None:
    """Make a command and its subcommands do nothing after reading their options."""
    command.callback = None
    for each in getattr(command, "commands", {}).values():
        only_read(each)


def check_read(words: Sequence[str]) -> None:
    """Fail unless the words are those of an existing command with existing options."""
    found = command_line(words)
    if found is not None:
        _, command, arguments = found
        only_read(command)
        result = CliRunner().invoke(command, arguments)
        assert result.exit_code == 0, f"{shlex.join(words)}: {result.output}"
        check_parts(words)
    elif words[:2] == ["python", "-m"] and words[2].startswith(("magfold_", "tests.")):
        assert find_spec(words[2]) is not None, words
    elif words[0] in ("pytest", "tell") or words[0].startswith(".ci/"):
        for path in words[1:]:
            if path.startswith("tests/"):
                assert (snippets.ROOT / path).exists(), words


def check_parts(words: Sequence[str]) -> None:
    """Fail unless the named parts of benchmarks, campaigns and the paper exist."""
    parts: Sequence[str] = ()
    if words[1] == "paper":
        parts = list(PARTS)
    elif words[1] == "stress":
        parts = list(KINDS)
    elif words[1] == "bench" and words[2] in descriptions():
        parts = list(descriptions()[words[2]].parts)
    asked = [part for option, part in pairwise(words) if option == "--only"]
    assert set(asked) <= set(parts), words


@pytest.mark.parametrize("page", pages_with("bash"))
def test_commands_in_blocks_are_read(page: Path) -> None:
    for block in snippets.blocks(page, "bash"):
        found = snippets.commands(block)
        assert found
        for words in found:
            check_read(words)


def test_commands_in_sentences_are_read() -> None:
    found = {each for page in snippets.PAGES for each in snippets.commands_in_sentences(page)}
    assert len(found) > 60
    for told in sorted(found):
        words = shlex.split(told.partition("…")[0])
        only_named = len(words) == (3 if words[0] == "python" else 2)
        check_read([*(PLACEHOLDERS.get(word, word) for word in words), *["--help"] * only_named])


def files_that_pages_take_for_granted() -> None:
    """Write the files that commands on the pages read into this folder."""
    start = snippets.ROOT / "docs" / "start.md"
    Path("mine.yaml").write_text(snippets.blocks(start, "yaml")[0], "utf-8")
    scene = mf.load_scene("paper/sequence-3").draw(np.random.default_rng(0))
    mf.simulate(scene).to_json("fold.json")
    for name, shipped, seed in (
        ("a", "ppo-tube-feed", 0),
        ("b", "ppo-tube-feed", 1),
        ("c", "ppo-unknown-floor", 0),
        ("mine", "ppo-tube-feed", 2),
    ):
        Path("runs", name).mkdir(parents=True)
        shutil.copy(shipped_files(shipped)[seed], Path("runs", name, "policy.safetensors"))
    shutil.copy("runs/c/policy.safetensors", "policy.safetensors")
    shutil.copy("runs/mine/policy.safetensors", "runs/mine/best.safetensors")
    for folder in ("agents/scores", "runs/stress/failures"):
        Path(folder).mkdir(parents=True)
    mf.save_scene(scene, "runs/stress/failures/ordinary-0-20.yaml")


def fewer_targets(words: Sequence[str]) -> list[str]:
    """Return options that reduce the hundreds of words of longer chains to two."""
    lengths = re.findall(r"components=(\d+)", " ".join(words))
    return ["--env", f"targets={folded_words(int(lengths[0]))[:2]}"] if lengths else []


@pytest.mark.slow
@pytest.mark.parametrize("page", pages_with("bash"))
def test_commands_in_blocks_run(page, tmp_path, monkeypatch):
    """Commands without an entry in LESS have their own tests or install something."""
    monkeypatch.chdir(tmp_path)
    files_that_pages_take_for_granted()
    for block in snippets.blocks(page, "bash"):
        for words in snippets.commands(block):
            found = command_line(words)
            if found is None or "marathon" in words:
                continue
            name, command, arguments = found
            less = () if "--rerun" in arguments else LESS.get(name)
            if less is not None:
                result = CliRunner().invoke(command, [*arguments, *less, *fewer_targets(words)])
                assert result.exit_code == 0, f"{shlex.join(words)}: {result.output}"
