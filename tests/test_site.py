"""Tests of the built site in a browser: links, overflow, outside requests and accessibility.

They need the site built by `.ci/site`, a Chromium, and axe-core, which the extra `docs` installs.
"""

from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

from tests.markup import Markup

SITE = Path(__file__).parents[1] / "runs" / "site"
PAGES = sorted(
    path
    for path in SITE.rglob("*.html")
    # Sources, and pages that play folds, which have tests of their own.
    if path.relative_to(SITE).parts[0] not in {"_modules", "_moving", "_static"}
)
WIDTHS = (390, 1400)  # [px] a phone's, a desk's

if not PAGES:
    pytest.skip("no site is built; .ci/site does so", allow_module_level=True)


@pytest.fixture(scope="module")
def contents() -> dict[Path, Markup]:
    return {path: Markup(path.read_text("utf-8")) for path in SITE.rglob("*.html")}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(SITE).as_posix())
def test_links_inside_lead_somewhere(page: Path, contents: dict[Path, Markup]) -> None:
    for link in contents[page].addresses:
        parts = urlsplit(link)
        if parts.scheme or parts.netloc:
            assert parts.scheme in {"https", "mailto", "data"}, link
            continue
        target = (page.parent / unquote(parts.path)).resolve() if parts.path else page
        assert target.is_file(), link
        if parts.fragment and target in contents:
            assert unquote(parts.fragment) in contents[target].places, link


@pytest.fixture(scope="module")
def axe() -> str:
    base = pytest.importorskip("axe_core_python.base")
    return (Path(base.__file__).parent / "axe.min.js").read_text("utf-8")


@pytest.mark.slow
@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(SITE).as_posix())
def test_pages_are_whole_and_open_to_all(browser, axe, page, dark):
    for width in WIDTHS:
        browser.resize(width, 900, dark=dark)
        browser.open(page)
        assert browser.value("document.documentElement.scrollWidth") <= width
    assert browser.complaints() == []
    assert [each for each in browser.requests() if not each.startswith("file:")] == []
    browser.value(f"{axe}; 0")
    # Pages that play folds, in frames, have tests of their own.
    browser.value(
        "window.found = null; axe.run({resultTypes: ['violations'], iframes: false}).then("
        "result => { window.found = result.violations; },"
        "error => { window.found = [{ id: String(error), impact: 'critical', nodes: [{}] }]; }); 0"
    )
    browser.until("window.found !== null")
    serious = browser.value(
        "found.filter(each => ['serious', 'critical'].includes(each.impact))"
        ".map(each => [each.id, each.nodes.length, each.nodes[0].html?.slice(0, 200)])"
    )
    assert serious == []
