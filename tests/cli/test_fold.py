"""The files of `magfold fold`: pages that play, and assembly sheets."""

import json
import re
import sys
from pathlib import Path

import pytest

import magfold_env as mf
from magfold_env.cli import fold
from tests.command_line import fails_in_one_line, run


def _without_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [name for name in sys.modules if name.startswith("magfold_env.render")]:
        monkeypatch.delitem(sys.modules, name)
    for name in ("PIL", "matplotlib", "matplotlib.figure", "pygame", "moviepy"):
        monkeypatch.setitem(sys.modules, name, None)


def test_a_page_needs_no_extra(quick: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    _without_extra(monkeypatch)
    page = tmp_path / "fold.html"
    result = run("fold", quick, "--html", page)
    assert result.exit_code == 0, result.stderr
    assert f"written: {page}" in result.stdout
    found = re.search(r'type="application/json" id="fold">(.*?)</script>', page.read_text("utf-8"))
    assert found is not None
    data = json.loads(found[1])
    fold = mf.simulate(mf.load_scene(quick), frame_rate=240.0)
    assert fold.trajectory is not None
    assert (data["word"], data["status"]) == (fold.word, fold.status.value)
    assert len(data["time"]) == len(fold.trajectory) > 5


@pytest.mark.medium
@pytest.mark.parametrize("suffix", ["pdf", "png"])
def test_a_sheet_is_written(quick: str, tmp_path: Path, suffix: str) -> None:
    pytest.importorskip("matplotlib.figure")
    sheet = tmp_path / f"sheet.{suffix}"
    result = run("fold", quick, "--sheet", sheet)
    assert result.exit_code == 0, result.stderr
    assert f"written: {sheet}" in result.stdout
    assert sheet.read_bytes()[:4] == {"pdf": b"%PDF", "png": b"\x89PNG"}[suffix]


@pytest.mark.parametrize(
    ("option", "value", "message"),
    [
        ("--html", "/nowhere/x.html", "--html: '/nowhere/x.html' is not allowed; its folder must"),
        ("--html", "/", "--html: '/' is not allowed; must not be a folder"),
        ("--sheet", "/nowhere/x.pdf", "--sheet: '/nowhere/x.pdf' is not allowed; its folder must"),
        ("--sheet", "x.svg", "--sheet: 'x.svg' is not allowed; must end in .pdf or .png"),
    ],
)
def test_files_that_cannot_be_written_are_told_before_the_work(
    option: str, value: str, message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fold, "simulate", lambda *_, **__: pytest.fail("simulated all the same"))
    result = run("fold", "paper/sequence-3", option, value)
    fails_in_one_line(result, f"error: {message}")


@pytest.mark.parametrize("missing", ["PIL", "matplotlib.figure"])
def test_a_sheet_without_the_extra_is_refused_before_the_work(
    missing: str, quick: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if missing == "PIL":
        _without_extra(monkeypatch)
    monkeypatch.setitem(sys.modules, missing, None)
    monkeypatch.setattr(fold, "simulate", lambda *_, **__: pytest.fail("simulated all the same"))
    result = run("fold", quick, "--sheet", tmp_path / "sheet.pdf")
    assert result.exit_code == 2
    assert "pip install -e '.[render]'" in result.stderr


def test_a_chain_that_rests_at_once_is_drawn(tmp_path: Path) -> None:
    pytest.importorskip("PIL")
    scene = tmp_path / "rest.yaml"
    scene.write_text(f"sequence: [{', '.join(['----'] * 30)}]\n", encoding="utf-8")
    files = {f"--{suffix}": tmp_path / f"rest.{suffix}" for suffix in ("gif", "png", "html")}
    result = run("fold", scene, *(text for pair in files.items() for text in pair))
    assert result.exit_code == 0, result.stderr
    assert all(path.stat().st_size > 1000 for path in files.values())
