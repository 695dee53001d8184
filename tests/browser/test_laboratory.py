"""Tests of the laboratory in a headless Chromium: its folds are those of `mf.simulate`."""

from collections.abc import Generator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import magfold_env as mf
from magfold_env.browser import build
from magfold_env.cli.lab import link_of
from tests.browser import built
from tests.replay import chromium

BITS = "(values) => [...new BigUint64Array(new Float64Array(values).buffer)].map(String)"


@pytest.fixture(scope="module")
def file() -> Path:
    return built.folder() / build.PAGE


@pytest.fixture
def page(browser: chromium.Page, file: Path) -> Generator[chromium.Page]:
    browser.resize(1400, 900)
    browser.call("Page.navigate", url="about:blank")
    browser.open(file)
    browser.until("window.laboratory !== undefined")
    yield browser
    assert browser.complaints() == []
    assert browser.requests() == [file.as_uri()]


def text(page: chromium.Page, name: str) -> str:
    return page.value(f"byId('{name}').textContent")


def end(page: chromium.Page) -> None:
    """Wait for the end of a fold."""
    page.until("byId('status').dataset.status !== ''")


def same_fold(page: chromium.Page, path: Path) -> mf.Fold:
    """Check that Python and the page simulate the page's scene to identical ends."""
    end(page)
    path.write_text(page.value("toYaml(laboratory.scene)"), encoding="utf-8")
    fold = mf.simulate(mf.load_scene(path))
    headings = page.value(f"({BITS})(laboratory.chain.headings())")
    assert headings == [str(int(each)) for each in fold.angles.view(np.uint64)]
    assert text(page, "word") == fold.word
    assert text(page, "status") == fold.status
    return fold


@pytest.mark.medium
def test_it_opens_with_a_fold_that_python_repeats(page: chromium.Page, tmp_path: Path) -> None:
    fold = same_fold(page, tmp_path / "mine.yaml")
    assert fold.word == "LRLLL"
    assert text(page, "reached") == "✓ folded"
    assert page.value("document.querySelectorAll('.ghost').length") == 6


@pytest.mark.medium
def test_what_is_set_folds_anew(page: chromium.Page, tmp_path: Path) -> None:
    page.value('document.querySelector(\'#poles [data-component="2"][data-face="1"]\').click()')
    assert page.value("laboratory.scene.sequence[2]") == "S-SN"
    for name, value, kind in (
        ("mount", "free", "change"),
        ("friction", "0.1", "input"),
        ("remanence", "1.2", "input"),
    ):
        page.value(
            f"byId('{name}').value = '{value}'; byId('{name}').dispatchEvent(new Event('{kind}'))"
        )
    page.value("document.querySelector('[data-length=\"1\"]').click()")
    page.value("byId('wall').click()")
    scene = page.value("laboratory.scene")
    assert scene["mount"] == "free"
    assert scene["friction"] == 0.1
    assert scene["magnets"] == {"remanence": 1.2}
    assert len(scene["sequence"]) == 7
    assert len(scene["obstacles"]) == 1
    same_fold(page, tmp_path / "mine.yaml")


def resize(page: chromium.Page, key: str, value: str) -> None:
    page.value(
        f"(() => {{ const field = document.querySelector('[data-size=\"{key}\"]'); "
        f"field.value = '{value}'; field.dispatchEvent(new Event('change')); }})()"
    )
    page.until("byId('status').textContent !== 'computing tables'")


@pytest.mark.medium
def test_other_sizes_fold_as_python_says(page: chromium.Page, tmp_path: Path) -> None:
    page.value("location.hash = ''")
    end(page)
    for key, value in (("magnets.width", "4"), ("casing.side", "16"), ("casing.mass", "5")):
        resize(page, key, value)
    scene = same_fold(page, tmp_path / "mine.yaml").scene
    assert scene.magnets is not None
    assert (scene.magnets.width, scene.casing.side, scene.casing.mass) == (0.004, 0.016, 0.005)
    page.until("byId('states').ariaBusy === 'false'")
    best = page.value("byId('states').rows[0].innerText.split(/\\s*\\t\\s*/)")
    (found,) = mf.minimise(scene, top=1).states
    assert best[:2] == [found.word, f"{1e3 * found.energy:.3f}".replace("-", "−")]
    page.value("dispatchEvent(new Event('beforeprint'))")
    assert "side 16 mm, 5 g each" in text(page, "pieces")
    assert "4 × 6 × 2.5 mm" in text(page, "pieces")
    resize(page, "magnets.width", "40")
    assert text(page, "problem").startswith("magnets.width: 0.04 is not allowed; the magnets of")
    assert page.value("laboratory.scene.magnets.width") == 0.004
    page.value("location.hash = ''; laboratory.scene = USUAL; laboratory.change({})")
    end(page)
    assert text(page, "word") == "LRLLL"


@pytest.mark.medium
def test_the_page_does_not_wait_for_long_folds(page: chromium.Page, tmp_path: Path) -> None:
    page.value("laboratory.change({ feed: { ...laboratory.scene.feed, speed: 1e-6 } })")
    assert page.value("laboratory.chain.status") is None
    page.until("byId('status').textContent.startsWith('folding: ')")
    page.value("byId('wall').click()")
    assert page.value("laboratory.scene.obstacles.length") == 1
    page.value("laboratory.change({ obstacles: [] })")
    open_game(page, "tube_feed")
    page.value("new Promise((goOn) => setTimeout(goOn, 200))")
    assert page.value("document.body.dataset.mode") == "tube_feed"
    assert text(page, "status") == "in your hands"  # what was folding is not shown here
    open_game(page, "")
    page.value("laboratory.change({ feed: { ...laboratory.scene.feed, speed: 0.1 } })")
    same_fold(page, tmp_path / "mine.yaml")
    page.value("location.hash = ''")
    page.until("laboratory.chain.word === 'LRLLL'")


@pytest.mark.medium
def test_a_link_gives_the_same_bits(page: chromium.Page) -> None:
    page.value("byId('random').click()")
    page.value("byId('link').click()")
    end(page)
    link, headings = page.value("[location.hash, laboratory.chain.headings()]")
    page.value(f"byId('random').click(); laboratory.read('{link[1:]}')")
    end(page)
    assert page.value("laboratory.chain.headings()") == headings


@pytest.mark.medium
@pytest.mark.parametrize("mount", ["free", "tube"])
def test_a_scene_of_the_command_opens(page: chromium.Page, tmp_path: Path, mount: Any) -> None:
    scene = mf.load_scene("paper/sequence-2").replace(mount=mount)
    page.value(f"laboratory.read('{link_of(scene)[1:]}')")
    assert same_fold(page, tmp_path / "mine.yaml").scene.sequence == scene.sequence


@pytest.mark.medium
def test_extreme_scenes_end_with_a_status(page: chromium.Page) -> None:
    for entries in (
        "casing: { mass: 1e-300 }", "casing: { mass: 1.7e308 }", "feed: { wall: 1000, bore: 1000 }",
        "friction: 1e308", "gravity: { normal: 1e308 }", "duration: 5e-324", "duration: 1e308",
        "obstacles: [{ position: [1000, -1000], size: [1e-320, 1000], heading: 1e6 }]",
    ):  # fmt: skip
        page.value(f"laboratory.read(toLink({{ ...USUAL, {entries} }}, ''))")
        end(page)


@pytest.mark.medium
@pytest.mark.parametrize("width", [1400, 390])
def test_the_scene_as_code_keeps_the_page_as_wide_as_its_window(
    page: chromium.Page, width: int
) -> None:
    page.resize(width, 900)
    page.value("byId('python').click()")
    wide = page.value("[byId('code').hidden, document.documentElement.scrollWidth]")
    page.resize(1400, 900)
    page.value("byId('python').click()")
    assert wide[0] is False
    assert wide[1] <= width


DEEP = "'{0}'.repeat(10000) + '{1}'.repeat(10000)"
FAR, OUT = "{ position: [1e300, 0], size: [1, 1] }", "{ position: [1, 1], size: [1, 1e300] }"
MARKUP = "<img src=x onerror=alert(1)>"
NOT_LINKS = {
    "'xyz'": 'link: "xyz" is not allowed; must be one that this page made, unbroken',
    "toLink({ sequence: 'NSNS NSNS', feed: { speed: [0.1, 0.2] } }, '')": "must be one number here",
    "btoa('[]')": "hold a scene", "'%'": "link: ", "'%E0%A4%A'": "link: ", "'äöü'": "link: ",
    "'<b>x</b>'": "link: ",
    "'__proto__'": "link: ", "btoa('x'.repeat(1e5))": "link: ", "btoa('null')": "hold a scene",
    "btoa('5')": "hold a scene", "btoa('{}')": "hold a scene", "btoa('\\xff')": "link: ",
    'btoa(\'{"scene": {"friction": NaN}}\')': "link: ",
    'btoa(\'{"__proto__": {"scene": {}}}\')': "hold a scene",
    'btoa(\'{"scene": {"__proto__": {"mount": "free"}}}\')': "__proto__: ",
    f"btoa({DEEP.format('[', ']')})": "hold a scene",
    f"btoa('{{\"scene\":' + {DEEP.format('[', ']')} + '}}')": "scene: [[",
    "btoa('{\"scene\":' + '{\"a\":'.repeat(10000) + '1' + '}'.repeat(10001))": 'a: {"a"',
    **{f"toLink({each}, '')": "scene: " for each in ("5", "true", "[1, 2]", f"'{MARKUP}'")},
    "toLink(null, '')": "sequence: nothing",
    **{f"toLink(USUAL, {each})": "wanted: " for each in ("5", "{}", "'XXXXX'", f"'{MARKUP}'")},
}  # fmt: skip
NOT_SCENES = {
    "sequence: null": "sequence: null", "sequence: ['NSNS']": "2 to 12 components",
    "sequence: Array(1e3).fill('NNNN')": "2 to 12 components", "sequence: {}": "sequence: {}",
    "sequence: ['NXNX', 'Q']": 'sequence[0]: "NXNX"', f"sequence: ['{MARKUP}', 'NSNS']": MARKUP,
    "mount: '__proto__'": "mount: ", "mount: null": "mount: ", "feed: 5": "feed: 5",
    "feed: { speed: -1 }": "feed.speed: -1", "feed: { speed: '1' }": "feed.speed: ",
    "feed: { bore: 1e308 }": "1e+308 is not allowed; must be from the casing's diagonal",
    "feed: { bore: 0 }": "feed.bore: 0", "feed: { wall: 1e300 }": "must be at most 1000 m",
    "magnets: { remanence: [[]] }": "magnets.remanence: [[]]",
    "casing: { mass: [1] }": "mass: [1]", "friction: 'much'": "friction: ",
    "friction: true": "friction: ", "friction: -1e-300": "must be a number of at least 0",
    "friction: [0, 0, 0, 0, 0, 1]": "must be one number here", "duration: 0": "duration: 0",
    "start_offsets: Array(7).fill(1e300)": "start_offsets: ", "start_offsets: [0]": "7 numbers",
    "solver: { max_steps: 1.5 }": "solver.max_steps: ", "solver: { tolerance: 0 }": "tolerance: 0",
    f"obstacles: [{FAR}]": "position[0]: 1e+300 is not allowed; must be a number from -1000",
    f"obstacles: [{OUT}]": "obstacles[0].size[1]: 1e+300 is not allowed; must be at most 1000 m",
    "obstacles: [{ position: [1, 1], size: [-1, 1] }]": "obstacles[0].size[0]: -1",
    "obstacles: [{ position: [1, 1], size: [1, 1], heading: 1e308 }]": "heading: 1e+308 is not",
    "obstacles: [null]": "obstacles[0].position: nothing", "obstacles: 'abc'": "obstacles: ",
    "obstacles: Array(1e3).fill({})": "at most 8", "frictoin: 1": "frictoin: 1",
    "constructor: { prototype: {} }": "constructor: ", f"'{MARKUP}': 1": f"{MARKUP}: 1",
    "'a\\nb': 1": "a b: 1", "['x'.repeat(1e5)]: 1": "xxx…: 1",
    "...Object.fromEntries(Array.from({ length: 1e4 }, (_, k) => [`k${k}`, 1]))": "k0: 1",
}  # fmt: skip


@pytest.mark.medium
def test_what_is_no_link_of_the_page_is_told_in_one_line(page: chromium.Page) -> None:
    scenes = {f"toLink({{ ...USUAL, {each} }}, '')": said for each, said in NOT_SCENES.items()}
    for link, said in (NOT_LINKS | scenes).items():
        # The page may not write its own address first.
        page.value(
            f"byId('problem').textContent = ''; clearTimeout(laboratory.writing); "
            f"void (location.hash = {link})"
        )
        page.until("byId('problem').textContent !== ''")
        told = text(page, "problem")
        assert said in told, (link, told)
        assert " is not allowed; " in told
        assert "\n" not in told
        assert len(told) < 450
        assert page.value("byId('problem').childElementCount") == 0
    page.value("byId('again').click()")
    assert page.value("byId('problem').hidden")
    end(page)
    assert text(page, "word") == "LRLLL"


@pytest.mark.medium
def test_states_of_least_energy_stand_beside_the_fold(page: chromium.Page) -> None:
    page.value("location.hash = ''")
    page.until("byId('states').ariaBusy === 'false'")
    rows = page.value("[...byId('states').rows].map((row) => row.innerText.split(/\\s*\\t\\s*/))")
    scene = mf.load_scene("paper/sequence-3")
    found = mf.minimise(scene.replace(sequence=page.value("laboratory.scene.sequence"))).states
    assert [row[0] for row in rows[: len(found)]] == [state.word for state in found]
    assert rows[0][1] == f"{1e3 * found[0].energy:.3f}".replace("-", "−")
    assert rows[0][2] == "stable · this fold"
    page.value("byId('states').rows[2].querySelector('button').click()")
    assert page.value("laboratory.wanted") == found[2].word == page.value("byId('wanted').value")
    assert page.value("document.querySelectorAll('.ghost').length") == 6
    assert text(page, "reached") == "not this"
    # Other magnets, other states.
    page.value("byId('random').click()")
    page.until("byId('states').ariaBusy === 'false'")
    assert page.value("byId('states').rows.length") == 8


def open_game(page: chromium.Page, name: str) -> None:
    page.value(f"byId('mode').value = '{name}'; byId('mode').dispatchEvent(new Event('change'))")


def scores(page: chromium.Page) -> Any:
    return page.value(
        "[...byId('scores').rows].map((row) => [...row.cells].map((c) => c.innerText))"
    )


@pytest.mark.medium
def test_tube_feed_is_played_against_a_policy(page: chromium.Page) -> None:
    open_game(page, "tube_feed")
    assert not page.value("byId('poles').checkVisibility()")
    page.value("document.querySelector('#next [data-face=\"2\"]').click()")
    for left in range(6, 0, -1):
        assert page.value("laboratory.play.game.n - laboratory.play.game.fed") == left
        page.value("byId('feed-next').click()")
    assert page.value("laboratory.play.game.chain.told.sequence[0]") == "NNSN"
    page.value("byId('watch').click()")
    page.until("byId('scores').rows.length === 2")
    you, policy = scores(page)
    assert you[0] == "you"
    assert policy[:4] == ["the policy", page.value("laboratory.play.game.target"), "folded", "1.00"]
    # The same draw once more is another try against the same target.
    target = page.value("laboratory.play.game.target")
    page.value("byId('retry').click()")
    assert page.value("laboratory.play.game.target") == target
    assert page.value("laboratory.play.game.fed") == 0
    open_game(page, "")
    end(page)
    assert text(page, "word") == "LRLLL"


@pytest.mark.medium
def test_feeding_by_hand(page: chromium.Page) -> None:
    page.call("Input.dispatchKeyEvent", type="keyDown", key="d", text="d")
    page.until("laboratory.chain.released >= 1")
    page.call("Input.dispatchKeyEvent", type="keyUp", key="d")
    page.until("byId('now').textContent.includes('1 of 6 out')")
    page.value("byId('let-go').click()")
    end(page)
    assert text(page, "status") == "held"
    assert page.value("laboratory.player.motion.last") > 10  # it was recorded
