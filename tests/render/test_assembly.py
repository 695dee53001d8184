"""Tests of assembly sheets: their contents, layout and files."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import magfold_env as mf
from magfold_env.render import save_sheet, style
from magfold_env.render.assembly import CARD, LONGEST, card_scale, draw_card, predicted
from magfold_env.render.sheet_parts import kinds
from magfold_env.reporting.plotting import figure_class
from tests.folds import lying

pytest.importorskip("matplotlib.figure")

FREE = mf.load_scene("paper/sequence-3")
ANCHOR = mf.load_scene("anchor")


def card(k: int) -> Any:
    """Return an axis with the card of a component."""
    axis = figure_class()().add_axes((0.0, 0.0, 1.0, 1.0))
    draw_card(axis, (0.0, CARD), ANCHOR, k, ["A", "B", "B", "A"])
    return axis


@pytest.mark.parametrize("k", range(ANCHOR.n))
def test_a_card_has_the_pole_of_each_face_outside_it(k: int) -> None:
    axis = card(k)
    colours = {"N": style.NORTH, "S": style.SOUTH, "–": style.FAINT}
    signs = [text for text in axis.texts if text.get_text() in colours]
    # Heading to the right: front is right, left is up.
    for pole, (x, y) in zip(ANCHOR.sequence[k], [(1, 1), (-1, 1), (-1, -1), (1, -1)], strict=True):
        (sign,) = [
            t for t in signs if (np.sign(np.subtract(t.get_position(), CARD / 2)) == (x, y)).all()
        ]
        assert sign.get_text() == pole.replace("-", "–")
        assert sign.get_color() == style.shares(colours[sign.get_text()])
    fills = [patch.get_facecolor()[:3] for patch in axis.patches]
    for pole in "NS":
        assert fills.count(style.shares(colours[pole])) == ANCHOR.sequence[k].count(pole)
    words = {text.get_text() for text in axis.texts}
    assert {str(k + 1), ANCHOR.sequence[k]} <= words
    assert ("hinge\nto 1" in words) == (k == 1)


def test_magnets_are_true_to_scale_and_counted_once_where_they_are() -> None:
    scale = 1e3 * card_scale(ANCHOR)
    assert card_scale(ANCHOR) == 2.0
    casing, *magnets = [patch for patch in card(0).patches if hasattr(patch, "get_closed")]
    edges = np.linalg.norm(np.diff(casing.get_xy(), axis=0), axis=1)
    np.testing.assert_allclose(edges, scale * ANCHOR.casing.side)
    assert ANCHOR.magnets is not None
    for f, magnet in enumerate(magnets):
        sides = np.linalg.norm(np.diff(magnet.get_xy(), axis=0), axis=1)[:2]
        expected = [ANCHOR.magnets.by_face(name)[f] for name in ("width", "thickness")]
        np.testing.assert_allclose(sides, scale * np.array(expected))
    for side in (0.001, 0.3):
        small = mf.Scene(sequence=("----",)).replace(casing={"side": side}, magnets=None)
        assert 1e3 * small.casing.diagonal * card_scale(small) <= 36.0
    found, where = kinds(ANCHOR)
    empty = np.array([[pole == "-" for pole in faces] for faces in ANCHOR.sequence])
    np.testing.assert_array_equal(where == -1, empty)
    assert [(each.name, each.pieces) for each in found] == [
        (name, (where == k).sum()) for k, name in enumerate("AB")
    ]
    # Front faces have the small strong blocks.
    assert (where[:, [0, 3]] == 0).all()
    assert found[0].text == "4 × 4 × 2 mm, inset 0.5 mm: remanence 1.2 T (NdFeB N35, 1.17–1.22 T)"


def test_predictions_stand_beside_the_simulation() -> None:
    tube = FREE.replace(mount="tube", feed={"direction": "backward"})
    free, one_by_one = predicted(tube, "LRLLL")
    assert free.word == mf.minimise(tube, "free").best.word
    assert one_by_one.word == mf.minimise(tube, "backward").best.word
    assert free.note.startswith("as simulated; −11.")
    (only,) = predicted(FREE, "LLLLL")
    assert only.note.startswith("not what was simulated")
    long = FREE.replace(sequence=("NSNS",) * (LONGEST + 1))
    for scene, reason in ((ANCHOR, "external field"), (long, "more than 24 components")):
        missing = predicted(scene, "")[0]
        assert missing.joints is None
        assert missing.note.startswith("not searched: ")
        assert reason in missing.note


@pytest.mark.medium
@pytest.mark.parametrize(
    ("count", "pages"), [(1, 1), pytest.param(6, 1, marks=pytest.mark.slow), (14, 2)]
)
def test_long_chains_flow_onto_more_pages(count: int, pages: int, tmp_path: Path) -> None:
    scene = ANCHOR.replace(sequence=(ANCHOR.sequence * 3)[:count])
    fold = lying(scene, ("LR" * 7)[: count - 1])
    pdf, png = tmp_path / "sheet.pdf", tmp_path / "sheet.PNG"
    save_sheet(scene, fold, pdf, "anchor")
    once = pdf.read_bytes()
    assert once.count(b"/Type /Page ") == pages
    save_sheet(scene, fold, pdf, "anchor")
    assert pdf.read_bytes() == once
    save_sheet(scene, fold, png)
    with Image.open(png) as image:
        width, height = image.size
        assert height == pytest.approx(pages * width * 297 / 210, abs=2 * pages)
        assert np.asarray(image)[-10:].min() > 200  # a margin
    assert {entry.name for entry in tmp_path.iterdir()} == {"sheet.pdf", "sheet.PNG"}
