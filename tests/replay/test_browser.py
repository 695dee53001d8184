"""The replay page in a browser: it plays, and shows the fold that it was made of."""

import os
from collections.abc import Generator
from pathlib import Path

import numpy as np
import pytest

import magfold_env as mf
from magfold_env.shapes import angles_to_word, centres
from tests.folds import FREE, recorded

if os.name != "posix":
    pytest.skip("the browser is driven over POSIX pipes", allow_module_level=True)

from tests.replay import chromium

pytestmark = pytest.mark.skipif(
    chromium.found() is None,
    reason=f"needs a Chromium or Chrome: none of {', '.join(chromium.NAMES)} is on the PATH",
)

FOLD = recorded("LRLLL")
PLACES = (
    "[...document.querySelectorAll('.casing')].map(c => c.parentElement.getAttribute('transform'))"
)


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Generator[chromium.Page]:
    with chromium.page(tmp_path_factory.mktemp("profile")) as page:
        yield page


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
    """Centres [mm] and headings [°] of the casings as they are drawn, y upwards."""
    numbers = (text.replace("translate(", "").split(") rotate(") for text in page.value(PLACES))
    rows = [[*map(float, place.split()), float(turn.rstrip(")"))] for place, turn in numbers]
    return np.array(rows) * [1.0, -1.0, -1.0]


def _middle(page: chromium.Page, selector: str) -> tuple[float, float, float, float]:
    """Left, top, width and height of an element [px]."""
    box = page.value(f"document.querySelector('{selector}').getBoundingClientRect().toJSON()")
    return box["x"], box["y"], box["width"], box["height"]


def _view(page: chromium.Page) -> list[float]:
    return list(
        map(float, page.value("document.getElementById('drawing').getAttribute('viewBox')").split())
    )


def test_it_loads_in_silence_and_from_nowhere_else(page: chromium.Page, tmp_path: Path) -> None:
    assert page.complaints() == []
    assert page.requests() == [(tmp_path / "fold.html").as_uri()]


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


def test_zoom_keeps_the_place_under_the_pointer_and_a_drag_moves_it(page: chromium.Page) -> None:
    left, top, width, height = _middle(page, "#drawing")
    x, y = round(left + 0.3 * width), round(top + 0.7 * height)
    place = (
        f"(() => {{ const m = document.getElementById('drawing').getScreenCTM().inverse();"
        f" const p = new DOMPoint({x}, {y}).matrixTransform(m); return [p.x, p.y]; }})()"
    )
    before, view = page.value(place), _view(page)
    page.wheel(x, y, -200)
    page.until(f"document.getElementById('drawing').viewBox.baseVal.width < {view[2] - 1}")
    np.testing.assert_allclose(page.value(place), before, atol=1e-3)
    zoomed = _view(page)
    assert zoomed[2] < view[2]
    page.drag((x, y), (x + 50, y), (x + 100, y - 30))
    moved = _view(page)
    assert moved[0] < zoomed[0]
    assert moved[1] > zoomed[1]
    assert moved[2:] == zoomed[2:]
    page.value("document.querySelector('[data-zoom=fit]').click()")
    assert _view(page) == view


def test_a_click_on_a_diagram_seeks(page: chromium.Page) -> None:
    for figure in ("#energies", "#joints"):
        left, top, width, height = _middle(page, f"{figure} .plot")
        places = [left + share * width for share in (0.3, 0.8)]
        frames = []
        for x in places:
            page.drag((x, top + height / 2))
            # The page draws when its next frame is due.
            cursor = f"document.querySelector('{figure} .cursor').getBoundingClientRect().x"
            page.until(f"Math.abs({cursor} - {x}) <= 2")
            frames.append(int(page.value("document.getElementById('time').value")))
        assert 3 < frames[0] < frames[1] < 28


@pytest.mark.parametrize("size", [(360, 740), (820, 1180), (1600, 900)])
@pytest.mark.parametrize("dark", [False, True])
def test_nothing_sticks_out_sideways(
    page: chromium.Page, size: tuple[int, int], dark: bool
) -> None:
    page.resize(*size, dark=dark)
    page.until(f"innerWidth == {size[0]}")
    assert page.value("document.documentElement.scrollWidth <= innerWidth")
    floor = page.value("getComputedStyle(document.body).backgroundColor")
    light = sum(map(int, floor.removeprefix("rgb(").removesuffix(")").split(",")))
    assert (light < 384) == dark


def test_everything_to_press_has_a_name(page: chromium.Page) -> None:
    tree = page.call("Accessibility.getFullAXTree")["nodes"]
    pressed = [
        n
        for n in tree
        if n.get("role", {}).get("value") in ("button", "slider", "combobox", "image")
    ]
    assert len(pressed) >= 8
    assert all(node["name"]["value"] for node in pressed if not node["ignored"])


def test_a_tube_a_fixed_magnet_and_a_field_are_drawn(
    browser: chromium.Page, tmp_path: Path
) -> None:
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
