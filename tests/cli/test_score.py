"""Tests of `magfold score`: what it prints and writes, and which arguments it rejects."""

import json
from pathlib import Path
from typing import Any

import pytest

from magfold_env.scoring.results import Results
from magfold_env.scoring.score import score, track_of
from tests.command_line import fails_in_one_line, rows, run
from tests.scoring.test_score import FLOOR, changed, entered


def test_the_command_writes_what_it_shows(tmp_path: Path) -> None:
    policy = entered(tmp_path / "mine.safetensors", FLOOR, actions={"n": 7})
    arguments = (policy, "--env", FLOOR, "--seed", 3, "--episodes", 3)
    result = run("score", *arguments, "--json", tmp_path / "score.json", code=0)
    found = Results.read(tmp_path / "score.json", "score").rows["mine"]
    assert found == score(policy, FLOOR, seed=3, episodes=3).rows["mine"]
    assert list(found.runs[0].task) == track_of(FLOOR, 0).numbers[:3]
    shown = dict(rows(result.stdout))
    assert f"SHA-256: {found.files[0].sha256}" in result.stdout.splitlines()
    assert shown["mean score"] == f"{found.score:.4f}"
    # Wilson's, of three.
    low, high = {0: (0.0, 56.2), 1: (6.1, 79.2), 2: (20.8, 93.9), 3: (43.8, 100.0)}[
        found.runs[0].success.count("1")
    ]
    assert f"({low:.1f}–{high:.1f})" in shown["success"]


@pytest.mark.parametrize(("options", "message"), [
    ((), "env: None is not allowed; must be one of MagFold/UnknownFloor-v0"),
    (("--env", "MagFold/TubeFeed-v0"), "env: 'MagFold/TubeFeed-v0' is not allowed; must be"),
    (("--env", "MagFold/Reprogram-v0"), "mine.safetensors: policy: its spaces"),
    (("--env", FLOOR, "--minutes", 1e-9), "mine.safetensors: takes longer than the 1e-09 min"),
    (("--env", FLOOR, "--minutes", 0), "minutes: 0.0 is not allowed; must be greater than 0"),
    (("--env", FLOOR, "--minutes", "nan"), "minutes: nan is not allowed; must be greater than"),
    (("--env", FLOOR, "--json", "none/score.json"), "its folder must exist"),
])  # fmt: skip
def test_what_cannot_be_is_refused(options: Any, message: str, tmp_path: Path) -> None:
    policy = entered(tmp_path / "mine.safetensors", FLOOR)
    fails_in_one_line(run("score", policy, *options), message)


def test_a_zip_file_is_not_read_and_a_file_of_actions_says_what_it_is_for(tmp_path: Path) -> None:
    path = tmp_path / "model.safetensors"
    path.write_bytes(b"PK\x03\x04" + bytes(100))
    told = run("score", path, "--env", FLOOR)
    fails_in_one_line(told, "model.safetensors: is a zip file, as Stable-Baselines3 saves models")
    assert "agents.training.policy_files.save" in told.stderr
    path = tmp_path / "mine.json"
    path.write_text(json.dumps(changed()), encoding="utf-8")
    fails_in_one_line(run("score", path, "--seed", 3), "seed: 3 is not allowed; must be left out")
