"""Tests of the display of scenes and results in notebooks."""

import re
import subprocess
import sys
from dataclasses import replace
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

import magfold_env as mf
from magfold_env.reporting.notebook import MOST_ROWS
from tests.folds import FREE, lying, recorded

ANCHOR = mf.load_scene("anchor")
FOLD = lying(FREE, "LRLLL")
_SVG = "{http://www.w3.org/2000/svg}"


def pictures(html: str) -> list[ElementTree.Element]:
    """Return the pictures in an HTML text."""
    return [ElementTree.fromstring(each) for each in re.findall(r"<svg.*?</svg>", html, re.DOTALL)]


def rows(html: str) -> list[list[str]]:
    """Return the texts of the cells of a table, row by row."""
    found = re.findall(r"<tr>(.*?)</tr>", html, re.DOTALL)
    return [re.findall(r"<td[^>]*>([^<]*)</td>", row) for row in found[1:]]


def corners(polygon: ElementTree.Element) -> Any:
    points = [each.split(",") for each in polygon.attrib["points"].split()]
    return np.array(points, dtype=np.float64)


def test_a_scene_is_drawn_in_millimetres_with_all_its_magnets() -> None:
    html = ANCHOR._repr_html_()
    (picture,) = pictures(html)
    magnets = ANCHOR.magnets
    assert magnets is not None
    left, top, width, height = map(float, picture.attrib["viewBox"].split())
    assert picture.attrib["width"] == f"{width:.4f}mm"
    assert width == pytest.approx(6e3 * ANCHOR.casing.diagonal + 1.0, abs=1e-3)
    shapes = iter(picture.findall(f"{_SVG}polygon"))
    for faces in ANCHOR.sequence:
        casing = corners(next(shapes))
        edges = np.linalg.norm(np.diff(casing, axis=0), axis=1)
        np.testing.assert_allclose(edges, 1e3 * ANCHOR.casing.side, atol=1e-3)
        assert (casing >= [left, top]).all()
        assert (casing <= [left + width, top + height]).all()
        # y is down in a picture, and the chain heads right.
        ways = zip(((1, -1), (-1, -1), (-1, 1), (1, 1)), faces, range(4), strict=True)
        for way, pole, f in ways:
            if pole == "-":
                continue
            magnet = next(shapes)
            block = corners(magnet)
            sizes = np.linalg.norm(np.diff(block, axis=0), axis=1)[:2]
            wanted = [1e3 * magnets.by_face(name)[f] for name in ("width", "thickness")]
            np.testing.assert_allclose(sizes, wanted, atol=1e-3)
            normal = np.array(way) / np.sqrt(2.0)
            outer = ((block - casing.mean(axis=0)) @ normal).max()
            inset = 1e3 * magnets.by_face("inset")[f]
            assert outer == pytest.approx(0.5e3 * ANCHOR.casing.side - inset, abs=1e-3)
            assert (magnet.attrib["fill"] > "#8") == (pole == "N")  # red or blue
    assert next(shapes, None) is None
    assert ["magnets.remanence", "(1.2, 0.6, 0.6, 1.2)"] in rows(html)
    assert ["mount", "tube"] in rows(html)


def test_words_are_drawn_beside_their_energies() -> None:
    found = mf.minimise(FREE, top=MOST_ROWS + 2)
    html = found._repr_html_()
    assert len(pictures(html)) == len(rows(html)) == MOST_ROWS
    assert "; 2 more" in html
    assert rows(html)[0][:3] == ["LRLLL", f"{1e3 * found.best.energy:.3g}", "yes"]
    # L turns left: upwards in the picture.
    first, *_, last = map(
        corners,
        pictures(mf.minimise(FREE.replace(sequence=["NNNN", "SSSS"]))._repr_html_())[0].findall(
            f"{_SVG}polygon"
        ),
    )
    assert last.mean(axis=0)[1] < first.mean(axis=0)[1]


def test_outcomes_stand_with_their_shares() -> None:
    made = mf.ensemble(FREE, 3)
    assert rows(made._repr_html_())[0][:3] == ["LRLLL", "folded", "3"]
    swept = mf.sweep(FREE, {"friction": [0.1, 0.2]}, runs=1)
    assert [row[:2] for row in rows(swept._repr_html_())] == [
        ["0.1", "LRLLL folded"],
        ["0.2", "LRLLL folded"],
    ]


def test_a_design_is_drawn_as_its_target() -> None:
    found = mf.design("L", budget=10, runs=2)
    html = found._repr_html_()
    assert ["sequence", " ".join(found.sequence)] in rows(html)
    assert len(pictures(html)) == 1
    none = replace(found, scene=None, certificate="<no> sequence")
    assert "&lt;no&gt; sequence" in none._repr_html_()


def test_limit_loads_stand_with_the_fold() -> None:
    found = mf.holding(mf.simulate(FREE))
    html = found._repr_html_()
    assert len(pictures(html)) == 1
    assert str(found) in html
    assert rows(html)[0] == [
        "1",
        "L",
        "never",
        f"{1e3 * found.opening[0, 1]:.3g}",
        f"{1e3 * found.stiffness[0]:.3g}",
    ]


def test_folds_that_cannot_be_played_are_drawn_if_they_lie_somewhere() -> None:
    assert len(pictures(FOLD._repr_html_())) == 1
    nowhere = replace(FOLD, angles=np.full(6, np.nan))
    assert nowhere._repr_html_().startswith("<p>Fold LRLLL")
    assert not pictures(nowhere._repr_html_())


def test_ipython_shows_them() -> None:
    formatters = pytest.importorskip("IPython.core.formatters")
    for each in (ANCHOR, FOLD, recorded("LR", FREE.replace(sequence=["NSNS"] * 3))):
        data, _ = formatters.DisplayFormatter().format(each)
        assert data["text/html"] == each._repr_html_()


@pytest.mark.medium
def test_showing_needs_no_extra() -> None:
    code = """
import sys, magfold_env as mf
scene = mf.load_scene("paper/sequence-3")
for each in (scene, mf.minimise(scene), mf.ensemble(scene, 2)):
    each._repr_html_()
print(*sys.modules.keys() & {"matplotlib", "PIL", "torch", "IPython", "pandas"})
"""
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True, text=True)
    assert run.stdout.strip() == ""
