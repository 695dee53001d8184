"""The `magfold` command."""

import json
import math
import sys
from collections.abc import Callable, Generator
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path

import pytest
from PIL import Image

import magfold_env as mf
from magfold_env import minimiser
from magfold_env.cli import fold, options
from magfold_env.minimiser import minimise
from tests.command_line import fails_in_one_line, rows, run


def test_the_version_is_that_of_the_package() -> None:
    assert run("--version").stdout.split() == ["magfold_env", version("magfold_env")]
    assert mf.__version__ == version("magfold_env")


def test_fold_prints_what_simulate_returns(quick: str) -> None:
    result = run("fold", quick, "--seed", 3)
    assert result.exit_code == 0
    fold = mf.simulate(mf.load_scene(quick), seed=3)
    for text in (fold.word, str(fold.status), f"{1e3 * fold.energy:.4f} mJ", f"{fold.time:.4f} s"):
        assert text in result.stdout


def test_fold_options_change_the_scene_and_files_are_written(quick: str, tmp_path: Path) -> None:
    paths = {kind: tmp_path / f"fold.{kind}" for kind in ("json", "png", "gif")}
    options = [part for kind, path in paths.items() for part in (f"--{kind}", path)]
    changes = ["--mount", "tube", "--direction", "backward", "--speed", 0.4, "--friction", 0.2]
    result = run("fold", quick, *changes, *options)
    assert result.exit_code == 0, result.stderr
    data = json.loads(paths["json"].read_text(encoding="utf-8"))
    scene = mf.Scene(**data["scene"])
    assert (scene.mount, scene.feed.direction, scene.friction) == ("tube", "backward", 0.2)
    assert scene.feed.speed == 0.4
    assert data["word"] in result.stdout
    for kind in ("png", "gif"):
        assert f"written: {paths[kind]}" in result.stdout
        with Image.open(paths[kind]) as image:
            assert (image.format or "").lower() == kind


def test_a_failed_simulation_ends_with_exit_code_1(
    quick: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    good = mf.simulate(mf.load_scene(quick))
    broken = {"status": mf.FoldStatus.FAILED, "message": "[numbers] broke down", "energy": math.nan}
    monkeypatch.setattr(fold, "simulate", lambda *_, **__: mf.Fold(**{**vars(good), **broken}))
    result = run("fold", quick)
    assert result.exit_code == 1
    assert "failed ([numbers] broke down)" in result.stdout


@pytest.mark.parametrize("command", ["fold", "minimise"])
def test_wrong_scenes_are_told_one_problem_a_line(command: str, tmp_path: Path) -> None:
    fails_in_one_line(run(command, "paper/sequence-9"), "no such scene", "paper/sequence-3")
    fails_in_one_line(run(command, "nowhere.yaml"), "nowhere.yaml: no such file")
    path = tmp_path / "wrong.yaml"
    path.write_text("sequence: [NSNSN]\ncasing: {mass: -1}\n", encoding="utf-8")
    result = run(command, path)
    assert (result.exit_code, result.stdout) == (2, "")
    sequence, mass = result.stderr.splitlines()
    assert sequence.startswith(f"error: {path}: sequence[0]: 'NSNSN' is not allowed; must be four")
    assert mass == f"error: {path}: casing.mass: -1 is not allowed; must be greater than 0"


def test_minimise_refuses_a_scene_in_a_field_in_one_line() -> None:
    fails_in_one_line(run("minimise", "anchor"), "field: an external field is not allowed")


@pytest.mark.parametrize(
    ("option", "value", "message"),
    [
        ("--mount", "glued", "mount: 'glued' is not allowed; must be 'pinned', 'free' or 'tube'"),
        ("--direction", "up", "feed.direction: 'up' is not allowed; must be 'forward' or 'backwa"),
        ("--speed", "-1", "feed.speed: -1.0 is not allowed; must be greater than 0"),
        ("--speed", "50", "feed.speed: 50.0 is not allowed; must be at most 20 m/s; 50 mm/s are"),
        ("--friction", "nan", "friction: nan is not allowed; must be a finite number"),
        ("--gif", "/nowhere/fold.gif", "--gif: '/nowhere/fold.gif' is not allowed; its folder mu"),
        ("--json", "/", "--json: '/' is not allowed; must not be a folder"),
        ("--gif", "x.mp4", "--gif: 'x.mp4' is not allowed; must end in .gif"),
        ("--speed", "0.1", "--speed: 0.1 is not allowed for mount 'free'; must be left out"),
    ],
)
def test_wrong_options_of_fold_are_told_in_one_line(option: str, value: str, message: str) -> None:
    fails_in_one_line(run("fold", "paper/sequence-3", option, value), message)


@pytest.mark.parametrize(
    ("option", "value", "message"),
    [
        ("--mode", "sideways", "mode: 'sideways' is not allowed; must be one of free, forward"),
        ("--top", "0", "top: 0 is not allowed; must be from 1 to 10000000"),
        ("--among", "none", "among: 'none' is not allowed; must be one of all, folded, stable"),
        ("--png", "/nowhere/x.png", "--png: '/nowhere/x.png' is not allowed; its folder must"),
    ],
)
def test_wrong_options_of_minimise_are_told_in_one_line(
    option: str, value: str, message: str
) -> None:
    fails_in_one_line(run("minimise", "paper/sequence-3", option, value), message)


def test_what_is_not_an_option_is_no_traceback_either() -> None:
    for arguments in (["fold"], ["fold", "x", "--speed", "fast"], ["bend"], ["fold", "--bend"]):
        result = run(*arguments)
        assert result.exit_code == 2
        assert result.stderr.startswith("error: ")
        assert result.stderr.count("\n") == 1
        assert "Traceback" not in result.stderr


@pytest.mark.parametrize(
    ("number", "forward", "backward"), [(1, "S1A", "S1C"), (2, "S2B", "S2B"), (3, "S3A", "S3A")]
)
@pytest.mark.parametrize(
    "name", ["sequence-{}", "sequence-{}-literal", "sequence-{}-strong", "alternative-{}"]
)
def test_minimise_shows_table_1(number: int, forward: str, backward: str, name: str) -> None:
    result = run("minimise", f"paper/{name.format(number)}")
    assert result.exit_code == 0
    found = {row[0]: row for row in rows(result.stdout)}
    assert found["forward"][-2:] == [forward, forward]
    assert found["backward"][-2:] == [backward, backward]


def test_minimise_ranks_what_the_minimiser_finds(tmp_path: Path) -> None:
    scene = mf.load_scene("paper/sequence-3")
    states = minimise(scene, top=3, among="folded").states
    png, path = tmp_path / "states.png", tmp_path / "states.json"
    options = ("--top", 3, "--among", "folded", "--png", png, "--json", path)
    result = run("minimise", "paper/sequence-3", *options)
    assert result.exit_code == 0
    for rank, row in enumerate(rows(result.stdout)[:3]):
        assert row[:2] == [str(rank + 1), states[rank].word]
        assert row[2] == f"{1e3 * states[rank].energy:.4f}"
    with Image.open(png) as image:
        assert image.size == (3 * 260, 260)
    data = json.loads(path.read_text(encoding="utf-8"))
    ranked, forward, backward = data["searches"]
    assert [entry["word"] for entry in ranked["states"]] == [state.word for state in states]
    assert [entry["stable"] for entry in ranked["states"]] == [state.stable for state in states]
    assert (forward["mode"], backward["mode"]) == ("forward", "backward")
    assert mf.Scene(**data["scene"]) == scene


def test_minimise_shows_the_decisions_of_a_feed() -> None:
    result = run("minimise", "paper/sequence-1", "--mode", "backward")
    decisions = minimise(mf.load_scene("paper/sequence-1"), "backward").decisions
    shown = result.stdout.split("Decisions")[1].split("Component-by-component")[0]
    found = rows(shown)
    assert [int(row[0]) for row in found] == [decision.joint for decision in decisions]
    assert [row[4] for row in found] == [decision.letter for decision in decisions]
    assert "--" in shown  # joint 2 turned left would overlap


@pytest.mark.medium
def test_words_of_long_chains_are_whole(tmp_path: Path) -> None:
    scene = mf.load_scene("paper/sequence-3").replace(sequence=("NSNS", "SN-N", "SSNN", "NNSS") * 5)
    mf.save_scene(scene, tmp_path / "long.yaml")
    lines = run("minimise", tmp_path / "long.yaml", "--among", "folded").stdout
    shown = [row[1] for row in rows(lines) if row[0]]
    assert shown[:5] == [state.word for state in minimise(scene, among="folded").states]
    assert {len(word) for word in shown} == {19}


def test_a_search_tells_how_far_it_is_and_ends_in_one_line(
    quick: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    told: list[tuple[float, str]] = []

    @contextmanager
    def progress_of(total: float) -> Generator[Callable[..., None]]:
        yield lambda done, what: told.append((done / total, what))

    def interrupted(*_: object, progress: Callable[[float], None]) -> None:
        progress(0.5)
        raise KeyboardInterrupt

    monkeypatch.setattr(options, "progress_of", progress_of)
    monkeypatch.setattr(minimiser, "minimise", interrupted)
    result = run("minimise", quick)
    assert told == [(0.0, "searching"), (0.5, "searching")]
    assert result.exit_code == 130
    assert (result.stdout, result.stderr.strip()) == ("", "interrupted")


def test_a_feed_that_shuts_itself_in_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    def trapped(scene: mf.Scene, mode: str = "free", *rest: object, **named: object) -> object:
        if mode == "backward":
            raise ValueError("mode: 'backward' runs into a dead end")
        return minimise(scene, mode, *rest, **named)  # pyright: ignore[reportArgumentType]

    monkeypatch.setattr(minimiser, "minimise", trapped)
    result = run("minimise", "paper/sequence-1")
    assert result.exit_code == 0
    assert "forward" in result.stdout
    assert "shuts itself in" in result.stdout
    fails_in_one_line(run("minimise", "paper/sequence-1", "--mode", "backward"), "dead end")


def test_pictures_without_the_extra_are_refused_before_the_work(
    quick: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in [name for name in sys.modules if name.startswith("magfold_env.render")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "PIL", None)
    monkeypatch.setattr(fold, "simulate", lambda *_, **__: pytest.fail("simulated all the same"))
    fails_in_one_line(run("fold", quick, "--png", tmp_path / "x.png"), "pictures need Pillow")
