"""Tests of `magfold lab`."""

import webbrowser
from pathlib import Path

import pytest

from magfold_env.browser import build
from tests.command_line import fails_in_one_line, run


@pytest.fixture
def page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    path = tmp_path / "laboratory.html"
    path.write_text("<!doctype html>", "utf-8")
    monkeypatch.setattr(build, "PACKED", path)
    monkeypatch.setattr(build, "is_of", lambda *_: True)
    return path


@pytest.mark.medium
def test_it_is_opened_or_written_to_a_folder(page, monkeypatch, tmp_path):
    opened: list[str] = []
    monkeypatch.setattr(webbrowser, "open", lambda url: opened.append(url) or True)
    run("lab", code=0)
    assert opened == [page.as_uri()]
    said = run("lab", "paper/sequence-3", "--out", tmp_path / "site", code=0)
    written = tmp_path / "site" / "index.html"
    assert written.read_bytes() == page.read_bytes()
    assert f"open {written.as_uri()}#" in said.output


def test_an_unknown_scene_is_refused():
    fails_in_one_line(run("lab", "paper/sequence-99"), "paper/sequence-99")


def test_what_is_missing_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    def kept() -> Path:
        raise RuntimeError("needs a linker for WebAssembly")

    monkeypatch.setattr(build, "PACKED", Path("nowhere"))
    monkeypatch.setattr(build, "kept", kept)
    fails_in_one_line(run("lab"), "needs a linker for WebAssembly")


@pytest.mark.medium
def test_a_packed_page_of_other_sources_is_not_taken(page, tmp_path, monkeypatch):
    monkeypatch.undo()
    monkeypatch.setattr(build, "PACKED", page)
    monkeypatch.setattr(build, "kept", lambda: tmp_path)
    assert build.page() == tmp_path / build.PAGE
    page.write_text(build.html(build._sources(), {}), "utf-8")
    assert build.page() == page


@pytest.mark.medium
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs Linux")
def test_a_full_disk_is_named_by_the_page_that_was_to_be_written(
    page: Path, tmp_path: Path
) -> None:
    target = tmp_path / "index.html"
    target.symlink_to("/dev/full")
    fails_in_one_line(run("lab", "--out", tmp_path), f"error: {target}: No space left on device")
