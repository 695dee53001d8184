"""Tests of commands that run again after a kill, an interruption or a full disk."""

import json
import signal
from pathlib import Path
from typing import Any

import pytest

import magfold_env as mf
from tests.command_line import run
from tests.killed import ENDS, records_in, run_until

COMMAND = "import sys; from magfold_env.cli.app import app; app()"
TOLD = {
    "kill": (-signal.SIGKILL, ""),
    "Ctrl-C": (130, "interrupted\n"),
    "full disk": (2, "error: {file}: disk I/O error\n"),
}
"""Exit code and message."""

COMMANDS = {
    "ensemble": (("scene.yaml", "--runs", "30", "--seed", "3", "--workers", "2"), "state"),
    "sweep": (("scene.yaml", "--over", "friction=0.1:0.3:3", "--runs", "10"), "state"),
    "design": (
        ("LRR", "--search", "cross-entropy", "--budget", "300", "--runs", "5", "--seed", "4"),
        "state/search",
    ),
    "stress": (("--cases", "110", "--only", "overlapping"), "state"),
}
"""Arguments, and the folder of the records."""


def result(name: str, out: Path) -> dict[str, Any]:
    """Return the results of a command, without its path and duration."""
    found = json.loads((out / f"{name}.json").read_text(encoding="utf-8"))
    return {key: value for key, value in found.items() if key not in {"seconds", "machine"}}


@pytest.mark.parametrize("end", [
    pytest.param(end, marks=pytest.mark.medium if end == "kill" else pytest.mark.slow)
    for end in ENDS
])  # fmt: skip
@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_that_was_broken_off_finds_the_same_in_the_end(name, end, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    mf.save_scene(mf.Scene(sequence=("NSNS", "SN-N"), mount="free", duration=0.01), "scene.yaml")
    arguments, state = COMMANDS[name]
    run(name, *arguments, "--out", "whole")
    out = Path(end)
    done = run_until(end, 4, COMMAND, name, *arguments, "--out", str(out))
    code, message = TOLD[end]
    message = message.format(file=out / state / "records.sqlite")
    assert (done.returncode, done.stderr) == (code, message)
    assert not (out / f"{name}.json").exists()
    # A worker may have had one ready that was not written yet.
    kept = records_in(out / state)
    assert len(kept) in {4, 5}
    run(name, *arguments, "--out", end)
    assert result(name, out) == result(name, Path("whole"))
    everything = records_in(out / state)
    assert everything.items() >= kept.items()
    assert len(everything) == len(records_in(Path("whole") / state))
