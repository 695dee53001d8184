"""The laboratory in a headless Firefox: the same bits, without a complaint."""

import json
from collections.abc import Generator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import magfold_env as mf
from magfold_env.browser import build
from tests.browser import built
from tests.browser.scenes import MOUNTS, random_scene, told
from tests.replay import firefox

pytestmark = [
    pytest.mark.medium,
    pytest.mark.skipif(firefox.found() is None, reason="needs a Firefox on the PATH"),
]
BITS = "((values) => [...new BigUint64Array(new Float64Array(values).buffer)].map(String))"


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Generator[firefox.Page]:
    file = built.folder() / build.PAGE
    with firefox.page(tmp_path_factory.mktemp("profile")) as page:
        page.resize(1400, 900)
        page.open(file)
        page.until("window.laboratory !== undefined")
        yield page


@pytest.fixture
def page(browser: firefox.Page) -> Generator[firefox.Page]:
    yield browser
    assert browser.complaints() == []


def test_what_it_complains_of_is_noticed(browser: firefox.Page, tmp_path: Path) -> None:
    script = "<!doctype html><title>wrong</title><script>throw new Error('on purpose')</script>"
    path = tmp_path / "wrong.html"
    path.write_text(script, encoding="utf-8")
    browser.open(path)
    browser.until("document.title === 'wrong'")
    assert any("on purpose" in line for line in browser.complaints())
    browser.open(built.folder() / build.PAGE)
    browser.until("window.laboratory !== undefined")


def test_it_opens_with_a_fold_that_python_repeats(page: firefox.Page) -> None:
    fold = mf.simulate(mf.Scene.model_validate(page.value("laboratory.scene")))
    headings = page.value(f"{BITS}(laboratory.chain.headings())")
    assert headings == [str(int(each)) for each in fold.angles.view(np.uint64)]
    assert page.value("document.getElementById('word').textContent") == fold.word == "LRLLL"


def test_feeding_by_keys(page: firefox.Page) -> None:
    page.key("d", "keyDown")
    page.until("laboratory.chain.released >= 1")
    page.key("d", "keyUp")
    page.value("laboratory.letGo()")
    assert page.value("laboratory.chain.status") == "held"


def test_a_policy_plays(page: firefox.Page) -> None:
    page.value("laboratory.play.open('tube_feed')")
    page.value("laboratory.play.watch()")
    assert page.value("laboratory.play.rows['the policy'].score") == 1.0
    page.value("laboratory.play.open('')")
    page.value("laboratory.fold()")


def test_nothing_is_cut_off_where_it_is_narrow(page: firefox.Page) -> None:
    page.resize(390, 844)
    assert page.value("document.documentElement.scrollWidth <= innerWidth")
    page.resize(1400, 900)


def compare(page: firefox.Page, scenes: list[mf.Scene]) -> None:
    for scene in scenes:
        found: Any = page.value(
            f"""(() => {{
                const chain = laboratory.engine.chain({json.dumps(told(scene))});
                const status = chain.run(), headings = {BITS}(chain.headings());
                const found = {{ headings, status, word: chain.word, steps: chain.steps }};
                chain.free();
                return found;
            }})()"""
        )
        fold = mf.simulate(scene)
        assert found == {
            "headings": [str(int(each)) for each in fold.angles.view(np.uint64)],
            "status": fold.status.value,
            "word": fold.word,
            "steps": fold.steps,
        }, told(scene)


def test_scenes_end_in_the_same_bits(page: firefox.Page) -> None:
    rng = np.random.default_rng(40)
    compare(page, [random_scene(rng, MOUNTS[k % 3]) for k in range(12)])


@pytest.mark.slow
def test_hundreds_of_scenes_end_in_the_same_bits(page: firefox.Page) -> None:
    rng = np.random.default_rng(400)
    compare(page, [random_scene(rng, MOUNTS[k % 3]) for k in range(300)])
