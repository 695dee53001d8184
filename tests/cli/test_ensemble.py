"""`magfold ensemble`: what it prints, what it writes, and what it refuses."""

import csv
import os
import sys
from pathlib import Path

import pytest
from PIL import Image

import magfold_env as mf
from magfold_env.checkpoint import alone_in
from magfold_env.cli import ensemble
from magfold_env.ensembles.releases import release
from tests.command_line import fails_in_one_line, rows, run
from tests.killed import records_in

SCENE = "paper/sequence-1"


def test_it_shows_and_writes_what_ensemble_returns(tmp_path: Path) -> None:
    out, png = tmp_path / "out", tmp_path / "bars.png"
    options = ("--mode", "backward", "--speed", 0.1, "--spread", "friction=0.3")
    files = ("--out", out, "--png", png)
    result = run("ensemble", SCENE, "--runs", 6, "--seed", 2, *options, *files)
    assert result.exit_code == 0, result.stderr
    scene = release(mf.load_scene(SCENE), "backward", 0.1).replace(spreads={"friction": 0.3})
    made = mf.ensemble(scene, 6, seed=2)
    table = rows(result.stdout)
    shown = {(word, status): int(runs) for word, status, runs, *_ in table[: len(made.outcomes)]}
    assert shown == {ends: share.successes for ends, share in made.outcomes.items()}
    assert [row[0] for row in table[len(made.outcomes) :]] == list(made.statuses)
    told = " ".join(result.stdout.split())
    assert "Drawn anew for each: start angles ±0.03 rad, friction ±30 %." in told
    read = mf.Ensemble.from_json(out / "ensemble.json")
    assert read.scene == scene
    assert read.angles.tobytes() == made.angles.tobytes()
    with (out / "outcomes.csv").open(newline="") as file:
        lines = list(csv.DictReader(file))
    assert [(line["word"], line["status"]) for line in lines] == list(made.outcomes)
    assert len((out / "runs.csv").read_text().splitlines()) == 7
    for path in (png, out / "ensemble.png"):
        assert f"written: {path}" in result.stdout
        with Image.open(path) as image:
            assert image.format == "PNG"


def test_the_same_command_goes_on_where_it_was(tmp_path: Path) -> None:
    for runs in (2, 4):
        assert run("ensemble", SCENE, "--runs", runs, "--out", tmp_path).exit_code == 0
    assert list(records_in(tmp_path / "state")) == [0, 1, 2, 3]
    result = run("ensemble", SCENE, "--runs", 4, "--seed", 1, "--out", tmp_path)
    fails_in_one_line(result, "records.sqlite: was written by another run, whose seed is 0")


def test_two_commands_do_not_share_a_folder(tmp_path: Path) -> None:
    with alone_in(tmp_path / "state"):
        result = run("ensemble", SCENE, "--runs", 2, "--out", tmp_path)
    fails_in_one_line(result, f"is in use by process {os.getpid()} on ", "give another folder")


def test_searches_are_shown_beside_the_words_they_name(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "100")
    result = run("ensemble", "paper/sequence-3", "--runs", 2, "--mode", "free")
    (row, *_) = rows(result.stdout)
    assert row[0] == "LRLLL"
    assert row[-1] == "full, forward, backward"


def test_a_spread_of_start_angles_takes_the_place_of_given_ones() -> None:
    scene = mf.load_scene(SCENE).replace(start_angles=[0.1] * 5, spreads={"mass": 0.1})
    changed = ensemble.changed_scene(scene, spreads=["start_angles=0.2", "magnet=0.1"])
    assert (changed.start_angles, changed.start_angle_spread) == (None, 0.2)
    assert changed.spreads == mf.Spreads(mass=0.1, magnet=0.1)
    assert ensemble.changed_scene(scene) == scene
    assert ensemble.changed_scene(scene, friction=0.2).friction == 0.2


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--runs", 0), "runs: 0 is not allowed; must be from 1 to 10000000"),
        (("--seed", -1), "seed: -1 is not allowed; must be at least 0"),
        (("--mode", "up"), "mode: 'up' is not allowed; must be one of free, forward, backward"),
        (("--speed", -1), "feed.speed: -1.0 is not allowed; must be greater than 0"),
        (("--workers", 0), "workers: 0 is not allowed; must be from 1 to 4096"),
        (("--backend", "gpu"), "backend: 'gpu' is not allowed; must be one of threads, processes"),
        (("--address", "auto"), "address: 'auto' is not allowed; must be left out unless backend"),
        (("--spread", "speed=0.1"), "--spread: 'speed=0.1' is not allowed; must be NAME=WIDTH"),
        (("--spread", "mass=much"), "--spread: 'mass=much' is not allowed; must be NAME=WIDTH"),
        (("--spread", "mass=2"), "spreads.mass: 2.0 is not allowed; must be less than 1"),
        (("--png", "/nowhere/x.png"), "--png: '/nowhere/x.png' is not allowed; its folder must"),
        pytest.param(
            ("--out", "/proc/x"),
            "--out: '/proc/x' is not allowed; /proc cannot be written to",
            marks=pytest.mark.skipif(sys.platform != "linux", reason="there is no /proc"),
        ),
        (
            ("--out", "pyproject.toml/x"),
            "--out: 'pyproject.toml/x' is not allowed; pyproject",
        ),
        (("--mode", "free", "--speed", 0.1), "--speed: 0.1 is not allowed for mount 'free'"),
    ],
)
def test_wrong_options_are_told_in_one_line(options: tuple[object, ...], message: str) -> None:
    fails_in_one_line(run("ensemble", SCENE, *options), message)


@pytest.mark.parametrize(
    ("module", "options", "message"),
    [
        ("ray", ("--backend", "ray"), "pip install -e '.[ray]'"),
        ("matplotlib.figure", ("--png", "x.png"), "pip install -e '.[render]'"),
    ],
)
def test_a_missing_extra_is_told_before_the_work(
    module: str, options: tuple[str, ...], message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    fails_in_one_line(run("ensemble", SCENE, "--runs", 2, *options), message)
