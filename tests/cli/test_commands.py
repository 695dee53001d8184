"""Tests that every command writes and prints the result of the function of the same name."""

import json
import math
import re
import shlex
import sys
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

import magfold_env as mf
from magfold_env.cli import ensemble, fold
from magfold_env.cli.sweep import grid_of
from magfold_env.ensembles import sweeps
from magfold_env.ensembles.releases import release
from tests.command_line import fails_in_one_line, rows, run
from tests.killed import records_in

FIRST, THIRD = "paper/sequence-1", "paper/sequence-3"
FED = {"mount": "tube", "feed": {"direction": "backward", "speed": 0.4}, "friction": 0.2}
RELEASED = release(mf.load_scene(FIRST), "backward", 0.1).replace(spreads={"friction": 0.3})
RELEASE = "--mode backward --speed 0.1 --spread friction=0.3 --seed 2 --out out"


class Case(NamedTuple):
    """A command, the files that it must write, and the texts that it must print."""

    line: str
    written: list[str]
    """Files, of which the first is JSON."""
    expected: Callable[[], dict[str, Any]]
    """Some or all entries of the JSON."""
    shown: Callable[[dict[str, Any]], list[str]]


def folded() -> dict[str, Any]:
    made = mf.simulate(mf.load_scene(THIRD).replace(**FED), seed=3).to_dict()
    return {key: made[key] for key in ("word", "status", "angles", "energy", "time", "scene")}


def shown_of_a_fold(data: dict[str, Any]) -> list[str]:
    return [data["word"], data["status"], f"{1e3 * data['energy']:.4f} mJ", f"{data['time']:.4f} s"]


def minimised() -> dict[str, Any]:
    scene = mf.load_scene(FIRST)
    assert [each.letter for each in mf.minimise(scene, "backward").decisions] == list("RLLRL")
    return {"scene": scene.model_dump(mode="json")}


def shown_of_states(data: dict[str, Any]) -> list[str]:
    scene = mf.load_scene(FIRST)
    ranked, forward, backward = data["searches"]
    found = mf.minimise(scene, top=3, among="folded").states
    assert [each["word"] for each in ranked["states"]] == [state.word for state in found]
    assert [each["stable"] for each in ranked["states"]] == [state.stable for state in found]
    assert (forward["mode"], backward["mode"]) == ("forward", "backward")
    return [f"{1e3 * state.energy:.4f}" for state in found] + [forward["states"][0]["word"]]


def designed() -> dict[str, Any]:
    made = mf.design("LRR", mode="backward", speeds=(0.3,), runs=8, seed=2)
    assert mf.load_scene("out/scene.yaml") == made.scene
    return made.to_dict()


def held() -> dict[str, Any]:
    fold = mf.simulate(mf.load_scene(THIRD))
    found = mf.holding(fold, directions=np.radians([90.0, 300.0]))
    return {"pull": found.pull.tolist(), "stiffness": found.stiffness.tolist()}


CASES = {
    "fold": Case(
        f"fold {THIRD} --seed 3 --mount tube --direction backward --speed 0.4 --friction 0.2"
        " --json f.json --png f.png --gif f.gif --html f.html",
        ["f.json", "f.png", "f.gif", "f.html"],
        folded,
        shown_of_a_fold,
    ),
    "minimise": Case(
        f"minimise {FIRST} --top 3 --among folded --json s.json --png s.png", ["s.json", "s.png"],
        minimised, shown_of_states,
    ),
    "design": Case(
        "design LRR --mode backward --speed 0.3 --runs 8 --seed 2 --out out --json d.json",
        ["d.json", "out/design.json", "out/scene.yaml"],
        designed,
        lambda data: ["backward, 0.3 m/s", " ".join(data["scene"]["sequence"])],
    ),
    "ensemble": Case(
        f"ensemble {FIRST} --runs 6 {RELEASE} --png bars.png",
        ["out/ensemble.json", "bars.png", "out/ensemble.png"],
        lambda: mf.ensemble(RELEASED, 6, seed=2).to_dict(),
        lambda data: [
            *(
                word
                for outcome in data["outcomes"]
                for word in (outcome["word"], outcome["status"])
            ),
            "Drawn anew for each: start angles ±0.03 rad, friction ±30 %.",
        ],
    ),
    "sweep": Case(
        f"sweep {FIRST} --over friction=0.1:0.5:2 --over magnets.remanence=0.6,1 --runs 3"
        f" --outcome 'RRLLR folded' {RELEASE} --png map.png",
        ["out/sweep.json", "map.png", "out/sweep.png"],
        lambda: mf.sweep(
            RELEASED, {"friction": [0.1, 0.5], "magnets.remanence": [0.6, 1.0]}, 3, seed=2
        ).to_dict(),
        lambda _: ["4 points of 3 releases, seed 2, the same draws at each"],
    ),
    "holding": Case(
        f"holding {THIRD} --angle 90 --angle 300 --json h.json --png h.png", ["h.json", "h.png"],
        held, lambda data: [f"{data['pull'][0]:.4g}"],
    ),
}  # fmt: skip


@pytest.mark.parametrize(
    "name", [pytest.param("design", marks=pytest.mark.medium), *(n for n in CASES if n != "design")]
)
def test_a_command_writes_and_shows_what_its_function_returns(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "120")
    case = CASES[name]
    result = run(*shlex.split(case.line), code=0)
    data = json.loads(Path(case.written[0]).read_text(encoding="utf-8"))
    expected = json.loads(json.dumps(case.expected()))
    assert {key: data[key] for key in expected} == expected
    text = " ".join(result.stdout.split())
    assert [each for each in case.shown(data) if each not in text] == []
    for path in case.written:
        assert f"written: {path}" in result.stdout
        if path.endswith((".png", ".gif")):
            with Image.open(path) as image:
                assert (image.format or "").lower() == path[-3:]


def test_the_version_is_that_of_the_package() -> None:
    assert run("--version").stdout.split() == ["magfold_env", version("magfold_env")]
    assert mf.__version__ == version("magfold_env")


@pytest.mark.parametrize("line", ["fold", "bend", "fold --bend", "play --seed -1"])
def test_misuse_ends_with_2_and_the_usage(line: str) -> None:
    result = run(*line.split())
    assert (result.exit_code, result.stdout) == (2, "")
    assert result.stderr.startswith("Usage: ")


def test_the_former_name_of_holding_warns() -> None:
    assert "'hold' is deprecated" in run("hold", "nowhere.json").stderr


@pytest.mark.parametrize("command", ["fold", "minimise", "ensemble"])
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


# --- minimise -------------------------------------------------------------------------------------


def test_columns_for_readers_of_the_paper_are_of_its_chains_only(tmp_path: Path) -> None:
    own = tmp_path / "own.yaml"
    mf.save_scene(mf.load_scene(FIRST), own)
    for scene, papers in ((FIRST, True), (own, False)):
        table = run("minimise", scene, "--top", 1, code=0).stdout
        assert [name in table for name in ("energy", "score", "stable")] == [True, papers, papers]


# --- fold -----------------------------------------------------------------------------------------


def test_a_failed_simulation_ends_with_exit_code_1(quick, monkeypatch):
    good = mf.simulate(mf.load_scene(quick))
    broken = {"status": mf.FoldStatus.FAILED, "message": "[numbers] broke down", "energy": math.nan}
    monkeypatch.setattr(fold, "simulate", lambda *_, **__: mf.Fold(**{**vars(good), **broken}))
    result = run("fold", quick, code=1)
    assert "failed ([numbers] broke down)" in result.stdout


def test_a_page_needs_no_extra(quick: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [name for name in sys.modules if name.startswith("magfold_env.render")]:
        monkeypatch.delitem(sys.modules, name)
    for name in ("PIL", "matplotlib", "matplotlib.figure", "pygame", "moviepy"):
        monkeypatch.setitem(sys.modules, name, None)
    page = tmp_path / "fold.html"
    run("fold", quick, "--html", page, code=0)
    found: Any = re.search(
        r'type="application/json" id="fold">(.*?)</script>', page.read_text("utf-8")
    )
    fold: Any = mf.simulate(mf.load_scene(quick), frame_rate=240.0)
    assert len(json.loads(found[1])["time"]) == len(fold.trajectory) > 5


@pytest.mark.medium
@pytest.mark.parametrize(
    ("suffix", "begins"), [("pdf", b"%PDF"), ("png", b"\x89PNG"), ("svg", b"<svg")]
)
def test_a_sheet_is_written(quick: str, tmp_path: Path, suffix: str, begins: bytes) -> None:
    pytest.importorskip("matplotlib.figure")
    sheet = tmp_path / f"sheet.{suffix}"
    run("fold", quick, "--sheet", sheet, code=0)
    assert sheet.read_bytes()[:4] == begins


def test_a_fold_from_a_file_is_held_like_one_that_is_simulated(tmp_path: Path) -> None:
    path, mounted = tmp_path / "fold.json", ("--mount", "pinned", "--seed", 1)
    run("fold", THIRD, *mounted, "--json", path, code=0)
    assert run("holding", path).stdout == run("holding", THIRD, *mounted).stdout
    fails_in_one_line(run("holding", path, "--friction", 0.1), "a fold from a file is what it is")


# --- runs that go on in their folder --------------------------------------------------------------


@pytest.mark.parametrize(("line", "more", "records", "other", "difference"), [
    (f"ensemble {FIRST} --runs 2", "--runs 4", 4, "--runs 4 --seed 1", "whose seed is 0"),
    (f"sweep {FIRST} --runs 1 --over friction=0.1:0.2:2", "--runs 3", 6,
     "--over duration=1:2:2", "whose over is [['fr"),
])  # fmt: skip
def test_the_same_command_goes_on_where_it_was(line, more, records, other, difference, tmp_path):
    for given_ in (line, f"{line} {more}"):
        run(*shlex.split(given_), "--out", tmp_path, code=0)
    assert list(records_in(tmp_path / "state")) == list(range(records))
    refused = run(*shlex.split(f"{line} {other}"), "--out", tmp_path)
    fails_in_one_line(refused, "records.sqlite: was written by another run", difference)


def test_a_design_goes_on_in_its_folder_and_only_there(tmp_path: Path) -> None:
    for _ in range(2):
        run("design", "LR", "--runs", 2, "--out", tmp_path, code=0)
    other = run("design", "RL", "--runs", 2, "--out", tmp_path)
    fails_in_one_line(other, "was written by another run, whose target is 'LR'")


# --- ensembles, designs, sweeps -------------------------------------------------------------------


def test_searches_are_shown_beside_the_words_they_name(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "100")
    (row, *_) = rows(run("ensemble", THIRD, "--runs", 2, "--mode", "free").stdout)
    assert (row[0], row[-1]) == ("LRLLL", "full, forward, backward")


def test_a_spread_of_start_angles_takes_the_place_of_given_ones() -> None:
    scene = mf.load_scene(FIRST).replace(start_angles=[0.1] * 5, spreads={"mass": 0.1})
    changed = ensemble.changed_scene(scene, spreads=["start_angles=0.2", "magnet=0.1"])
    assert (changed.start_angles, changed.start_angle_spread) == (None, 0.2)
    assert changed.spreads == mf.Spreads(mass=0.1, magnet=0.1)


def test_a_design_by_energies_alone_keeps_the_scene(tmp_path: Path) -> None:
    path, out = tmp_path / "scene.yaml", tmp_path / "out"
    mf.save_scene(mf.load_scene("design").replace(friction=0.2, feed={"speed": 0.07}), path)
    options = ("--objective", "gap", "--runs", 0, "--out", out)
    run("design", "LLR", "--scene", path, *options, code=0)
    written = mf.load_scene(out / "scene.yaml")
    assert (written.friction, written.feed.speed, written.n) == (0.2, 0.07, 4)


def test_a_target_that_cannot_be_reached_ends_with_1() -> None:
    result = run("design", "LLLL", "--objective", "gap", code=1)
    assert "cannot be reached; components 1 and 5 would lie in one place" in result.stdout


@given(st.floats(-1e6, 1e6), st.floats(1e-2, 1e6), st.integers(2, sweeps.MOST))
def test_a_range_is_even_from_end_to_end(low: float, width: float, count: int) -> None:
    high = low + width
    (values,) = grid_of([f"a.b={low!r}:{high!r}:{count}"]).values()
    assert (len(values), values[0], values[-1]) == (count, low, high)
    np.testing.assert_allclose(values, np.linspace(low, high, count), rtol=1e-9, atol=1e-3)


@given(st.text(max_size=8) | st.text("=:,.0123456789-elogni", max_size=12))
def test_any_text_is_a_grid_or_refused(text: str) -> None:
    try:
        grid = grid_of([text])
    except mf.SceneError as error:
        assert [(each.key, each.value) for each in error.problems] == [("--over", text)]  # noqa: PT017
    else:
        assert len(grid) == 1
