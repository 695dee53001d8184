"""Tests of pages of reports, and of their intervals and diagrams."""

import math
from pathlib import Path

import pytest
from PIL import Image

from magfold_env.reporting.intervals import share
from magfold_env.reporting.page import (
    Details,
    Entries,
    Frame,
    Page,
    Picture,
    Points,
    Section,
    Verdict,
    render,
    write_page,
)
from magfold_env.reporting.tables import Table
from tests.markup import Markup


def read(text: str) -> Markup:
    found = Markup(text)
    assert found.whole
    return found


@pytest.fixture
def picture(tmp_path: Path) -> Path:
    path = tmp_path / "picture.png"
    Image.new("RGB", (4, 3), "white").save(path)
    return path


def test_everything_given_is_on_the_page_and_nothing_comes_from_elsewhere(picture: Path) -> None:
    blocks = [
        "A paragraph.",
        Picture(picture, "A caption."),
        Entries({"Label": "An entry."}),
        Points(["A point."]),
        Verdict("agrees", "A reason.", "good", ["Another reason."]),
        Details("Folded away", ["A detail."]),
        Table(
            "A table", [{"name": "first", "time [s]": 0.12345}, {"name": "second", "time [s]": 2}]
        ),
    ]
    page = Page("A title", [Section("One", blocks), Section("Two", [])], ["A lead."], {"os": "any"})
    found = read(render(page))
    said = "A title|A lead.|A paragraph.|A caption.|Label|An entry.|A point.|agrees|A reason."
    said += "|Another reason.|Folded away|A detail.|A table|time [s]|first|0.123|One|Two|any"
    assert [each for each in said.split("|") if each not in found.text] == []
    assert all(each.startswith(("data:", "#")) for each in found.addresses)


def test_text_stays_text() -> None:
    nasty = '</title><script>alert("1")</script> & {{ page }}'
    table = Table(nasty, [{nasty: nasty}])
    blocks = [nasty, Entries({nasty: nasty}), Points([nasty]), Verdict(nasty, nasty, more=[nasty])]
    blocks += [table, Details(nasty, [nasty])]
    text = render(Page(nasty, [Section(nasty, blocks)], [nasty], {nasty: nasty}))
    assert "<script" not in text
    assert read(text).text.count(nasty) == 18


def test_pages_within_the_page_are_bound_to_its_policy() -> None:
    inner = '<p title="a">1 &amp; 2</p><script>play()</script>'
    plain = render(Page("T", [Section("S", ["text"])]))
    frames = [Details(name, [Frame(name, inner)], "folds") for name in ("one", "two")]
    text = render(Page("T", [Section("S", frames)]))
    assert "script-src" not in plain
    assert "script-src 'unsafe-inline'; frame-src 'self'" in text
    assert "<script" not in text
    assert read(text).frames == [inner, inner]


def test_a_page_is_one_file_with_pictures_that_are_png(picture: Path, tmp_path: Path) -> None:
    write_page(Page("T", [Section("S", [Picture(picture)])]), tmp_path / "page.html")
    picture.unlink()
    found = read((tmp_path / "page.html").read_text(encoding="utf-8"))
    assert any(each.startswith("data:image/png;base64,") for each in found.addresses)
    path = tmp_path / "picture.png"
    path.write_text("no picture")
    with pytest.raises(ValueError, match=r"picture\.png: is not a picture; must be a PNG file"):
        write_page(Page("T", [Section("S", [Picture(path)])]), tmp_path / "other.html")
    assert not (tmp_path / "other.html").exists()


Z = 1.959963984540054


@pytest.mark.parametrize(("successes", "trials"), [(0, 10), (10, 10), (3, 7), (200, 520)])
def test_the_interval_is_wilsons(successes: int, trials: int) -> None:
    result = share(successes, trials)
    # The ends solve (p - rate)² = z² p (1 - p) / trials.
    for p in (result.low, result.high):
        assert (p - result.rate) ** 2 == pytest.approx(Z**2 * p * (1 - p) / trials, abs=1e-12)
    assert 0 <= result.low <= result.rate <= result.high <= 1
    assert not math.isclose(result.low, result.high)
