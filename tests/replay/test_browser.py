"""Tests of the replay page in a browser: it plays and shows its fold."""

from pathlib import Path

import numpy as np
import pytest

import magfold_env as mf
from magfold_env.shapes import angles_to_word, centres
from tests.folds import FREE, recorded
from tests.replay import chromium

FOLD = recorded("LRLLL")
PLACES = (
    "[...document.querySelectorAll('.casing')].map(c => c.parentElement.getAttribute('transform'))"
)


@pytest.fixture
def page(browser: chromium.Page, tmp_path: Path) -> chromium.Page:
    return _opened(browser, FOLD, tmp_path)


def _opened(browser: chromium.Page, fold: mf.Fold, folder: Path) -> chromium.Page:
    fold.to_html(folder / "fold.html")
    browser.resize(1280, 800)
    browser.open(folder / "fold.html")
    return browser


def _seek(page: chromium.Page, frame: int) -> None:
    page.value(f"byTest = document.getElementById('time'); byTest.value = {frame}")
    page.value("byTest.dispatchEvent(new Event('input'))")


def _drawn(page: chromium.Page) -> np.ndarray:
    """Return centres [mm] and headings [°] of the drawn casings, with y upwards."""
    numbers = (text.replace("translate(", "").split(") rotate(") for text in page.value(PLACES))
    rows = [[*map(float, place.split()), float(turn.rstrip(")"))] for place, turn in numbers]
    return np.array(rows) * [1.0, -1.0, -1.0]


def _view(page: chromium.Page) -> list[float]:
    return list(
        map(float, page.value("document.getElementById('drawing').getAttribute('viewBox')").split())
    )


def test_it_loads_in_silence_from_nowhere_else_and_names_all_to_press(page, tmp_path):
    assert page.complaints() == []
    assert page.requests() == [(tmp_path / "fold.html").as_uri()]
    tree = page.call("Accessibility.getFullAXTree")["nodes"]
    pressed = [
        n
        for n in tree
        if n.get("role", {}).get("value") in ("button", "slider", "combobox", "image")
    ]
    assert len(pressed) >= 8
    assert all(node["name"]["value"] for node in pressed if not node["ignored"])


def test_word_status_and_scene_are_the_folds(page: chromium.Page) -> None:
    texts = [
        page.value(f"document.getElementById('{name}').textContent")
        for name in ("word", "status", "message")
    ]
    assert texts == ["LRLLL", "folded", FOLD.message]
    facts = page.value("document.getElementById('facts').textContent")
    assert " ".join(FREE.sequence) in facts
    letters = page.value(
        "[...document.querySelectorAll('.magnet text')].map(t => t.textContent).join('')"
    )
    assert letters == "".join(FREE.sequence)


@pytest.mark.parametrize("frame", [0, 13, 29])
def test_scrubbing_shows_the_frame(page: chromium.Page, frame: int) -> None:
    motion = FOLD.trajectory
    assert motion is not None
    _seek(page, frame)
    drawn = _drawn(page)
    expected = centres(motion.angles[frame], side=FREE.casing.side, base=motion.base[frame])
    np.testing.assert_allclose(drawn[:, :2], 1e3 * expected, atol=1e-2)
    np.testing.assert_allclose(drawn[:, 2], np.rad2deg(motion.angles[frame]), atol=0.01)
    clock = page.value("document.getElementById('clock').textContent")
    assert clock == f"{motion.time[frame]:.3f} / 0.500 s"
    now = page.value("document.getElementById('now').textContent")
    assert angles_to_word(np.diff(motion.angles[frame])) in now


@pytest.mark.medium
def test_it_plays_to_the_end_and_again(page: chromium.Page) -> None:
    start = page.value(PLACES)
    page.value("document.getElementById('speed').value = 0.5")
    page.value("document.getElementById('play').click()")
    page.until("document.getElementById('time').value > 2")
    assert page.value(PLACES) != start
    page.until("document.getElementById('time').value == 29")
    page.until("document.getElementById('play').getAttribute('aria-label') == 'Play'")
    page.value("document.getElementById('play').click()")
    page.until("document.getElementById('time').value < 29")
    page.value("document.getElementById('play').click()")
    assert page.complaints() == []


def test_keys_do_what_the_page_says(page: chromium.Page) -> None:
    def frame() -> int:
        return int(page.value("document.getElementById('time').value"))

    page.key("ArrowRight")
    page.key("ArrowRight")
    assert frame() == 2
    page.key("ArrowRight", modifiers=8)  # shift
    assert frame() == 12
    page.key("ArrowLeft")
    assert frame() == 11
    page.key("End")
    assert frame() == 29
    page.key("Home")
    assert frame() == 0
    page.key(" ")
    page.until("document.getElementById('time').value > 0")
    page.key(" ")
    assert page.value("document.getElementById('play').getAttribute('aria-label')") == "Play"
    speed = float(page.value("document.getElementById('speed').value"))
    page.key("[")
    assert float(page.value("document.getElementById('speed').value")) < speed
    width = _view(page)[2]
    page.key("+")
    assert _view(page)[2] < width
    page.key("0")
    assert _view(page)[2] == width


@pytest.mark.parametrize("size", [(360, 740), (820, 1180), (1600, 900)])
@pytest.mark.parametrize("dark", [False, True])
def test_nothing_sticks_out_sideways(page, size, dark):
    page.resize(*size, dark=dark)
    page.until(f"innerWidth == {size[0]}")
    assert page.value("document.documentElement.scrollWidth <= innerWidth")
    floor = page.value("getComputedStyle(document.body).backgroundColor")
    light = sum(map(int, floor.removeprefix("rgb(").removesuffix(")").split(",")))
    assert (light < 384) == dark


def test_a_tube_a_fixed_magnet_and_a_field_are_drawn(browser, tmp_path):
    tube = recorded("LRRLL", mf.load_scene("anchor"))
    page = _opened(browser, tube, tmp_path)
    assert page.complaints() == []
    counts = {
        name: page.value(f"document.querySelectorAll('#drawing .{name}').length")
        for name in ("tube", "block")
    }
    assert counts == {"tube": 2, "block": 1}
    assert "0.02 mT" in page.value("document.getElementById('arrow').textContent")
    # Component 4 has no magnets behind: two letters fewer.
    assert page.value("document.querySelectorAll('.magnet').length") == 22
