"""`magfold design`: what it prints, what it writes, how it ends, and what it refuses."""

from pathlib import Path

import pytest

import magfold_env as mf
from magfold_env.designer import Design
from tests.command_line import run
from tests.killed import records_in


@pytest.mark.medium
def test_it_shows_and_writes_what_design_returns(tmp_path: Path) -> None:
    out, json = tmp_path / "out", tmp_path / "design.json"
    options = ("--mode", "backward", "--speed", 0.3, "--runs", 8, "--seed", 2)
    result = run("design", "LRR", *options, "--out", out, "--json", json)
    assert result.exit_code == 0, result.output
    expected = mf.design("LRR", mode="backward", speeds=(0.3,), runs=8, seed=2)
    assert Design.from_json(json) == Design.from_json(out / "design.json") == expected
    assert mf.load_scene(out / "scene.yaml") == expected.scene
    for text in (" ".join(expected.sequence), "backward, 0.3 m/s", str(expected.probability)):
        assert text in result.stdout
    for path in (json, out / "design.json", out / "scene.yaml"):
        assert f"written: {path}" in result.stdout
    assert records_in(out / "state" / "search")


def test_it_goes_on_in_its_folder_and_only_there(tmp_path: Path) -> None:
    assert run("design", "LR", "--runs", 2, "--out", tmp_path).exit_code == 0
    releases = records_in(tmp_path / "state" / "search")
    assert run("design", "LR", "--runs", 2, "--out", tmp_path).exit_code == 0
    assert records_in(tmp_path / "state" / "search") == releases
    other = run("design", "RL", "--runs", 2, "--out", tmp_path)
    assert other.exit_code == 2
    assert "was written by another run, whose target is 'LR'" in other.stderr


def test_energies_alone_keep_the_scene(tmp_path: Path) -> None:
    path = tmp_path / "scene.yaml"
    mf.save_scene(mf.load_scene("design").replace(friction=0.2, feed={"speed": 0.07}), path)
    result = run(
        "design",
        "LLR",
        "--scene",
        path,
        "--objective",
        "gap",
        "--runs",
        0,
        "--out",
        tmp_path / "out",
    )
    assert result.exit_code == 0, result.output
    written = mf.load_scene(tmp_path / "out" / "scene.yaml")
    assert written.friction == 0.2
    assert written.feed.speed == 0.07
    assert written.n == 4
    assert "by 0.000 mJ" in result.stdout  # below the proven optimum


def test_what_cannot_be_reached_ends_with_1() -> None:
    result = run("design", "LLLL", "--objective", "gap")
    assert result.exit_code == 1
    assert "cannot be reached; components 1 and 5 would lie in one place" in result.stdout


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("LXR",), "target: 'LXR' is not allowed"),
        (("LR", "--mode", "up"), "mode: 'up' is not allowed; must be one of free, forward"),
        (("LR", "--objective", "x"), "objective: 'x' is not allowed"),
        (("LR", "--backend", "x"), "backend: 'x' is not allowed"),
        (("LR", "--scene", "nowhere"), "nowhere: no such scene"),
        (("LR", "--scene", "pendulum-3"), "magnets: None is not allowed; a scene must"),
        (("LR", "--out", "pyproject.toml/x"), "pyproject.toml is not a folder"),
        (("LR", "--json", "/nowhere/x.json"), "--json: '/nowhere/x.json' is not allowed"),
    ],
)
def test_what_is_wrong_is_told_in_one_line(arguments: tuple[str, ...], message: str) -> None:
    result = run("design", *arguments)
    assert result.exit_code == 2
    assert message in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1
