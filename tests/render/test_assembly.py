"""Assembly sheets and parts lists: what stands on them, where, and the files."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import magfold_env as mf
from magfold_env.minimiser import minimise
from magfold_env.render import save_sheet, style
from magfold_env.render.assembly import (
    CARD,
    LONGEST,
    card_scale,
    draw_card,
    predicted,
    simulated,
)  # fmt: skip
from magfold_env.render.parts import (
    GRADES,
    grade_text,
    kind_text,
    kinds,
    nearest_grade,
    release_text,
)
from magfold_env.reporting.plotting import figure_class
from magfold_env.shapes import headings, word_to_angles

pytest.importorskip("matplotlib.figure")

FREE = mf.load_scene("paper/sequence-3")
ANCHOR = mf.load_scene("anchor")


def _fold(scene: mf.Scene, word: str) -> mf.Fold:
    return mf.Fold(
        scene=scene,
        status=mf.FoldStatus.FOLDED,
        message="folded at t = 0.1 s",
        word=word,
        angles=headings(word_to_angles(word), first=0.3),
        base=np.zeros(2),
        energy=-1e-3,
        time=0.1,
        steps=1,
        evaluations=1,
    )


def _axis() -> Any:
    return figure_class()().add_axes((0.0, 0.0, 1.0, 1.0))


def _colour(colour: style.Colour) -> tuple[float, ...]:
    return tuple(channel / 255 for channel in colour)


def _pages(path: Path) -> int:
    return path.read_bytes().count(b"/Type /Page ")


@pytest.mark.parametrize("k", range(ANCHOR.n))
def test_a_card_tells_which_pole_faces_out_on_which_face(k: int) -> None:
    axis = _axis()
    draw_card(axis, (0.0, CARD[1]), ANCHOR, k, ["A", "B", "B", "A"])
    places = {"N": style.NORTH, "S": style.SOUTH, "–": style.FAINT}
    signs = [text for text in axis.texts if text.get_text() in places]
    middle = np.array(CARD) / 2
    # Heading to the right: front is right, left is up.
    for pole, (x, y) in zip(ANCHOR.sequence[k], [(1, 1), (-1, 1), (-1, -1), (1, -1)], strict=True):
        (sign,) = [
            t for t in signs if (np.sign(np.subtract(t.get_position(), middle)) == (x, y)).all()
        ]
        assert sign.get_text() == pole.replace("-", "–")
        assert sign.get_color() == _colour(places[sign.get_text()])
    fills = [patch.get_facecolor()[:3] for patch in axis.patches]
    for pole, colour in (("N", style.NORTH), ("S", style.SOUTH)):
        assert fills.count(_colour(colour)) == ANCHOR.sequence[k].count(pole)
    words = {text.get_text() for text in axis.texts}
    assert {str(k + 1), ANCHOR.sequence[k], "feed"} <= words
    assert ("empty" in words) == ("-" in ANCHOR.sequence[k])
    assert ("hinge\nto 1" in words) == (k == 1)


@pytest.mark.parametrize("scene", [ANCHOR, FREE.replace(mount="pinned")], ids=["tube", "pinned"])
@pytest.mark.parametrize("k", [0, 3])
def test_the_text_of_a_card_is_large_enough_and_apart(scene: mf.Scene, k: int) -> None:
    figure = figure_class()(figsize=np.array(CARD) / 25.4)
    axis = figure.add_axes((0.0, 0.0, 1.0, 1.0), xlim=(0.0, CARD[0]), ylim=(0.0, CARD[1]))
    draw_card(axis, (0.0, CARD[1]), scene, k, ["A", "B", "B", "A"])
    figure.draw_without_rendering()
    texts = [text for text in axis.texts if text.get_text()]
    boxes = [text.get_window_extent() for text in texts]
    assert min(text.get_fontsize() for text in texts) >= 8.0
    for text, box in zip(texts, boxes, strict=True):
        assert figure.bbox.x0 <= box.x0, text
        assert box.x1 <= figure.bbox.x1, text
        # Of two texts below each other not even the rows of pixels at their edges.
        near = [other for other in boxes if other is not box and box.overlaps(other.padded(-2.0))]
        assert not near, text


def test_magnets_and_casings_are_true_to_scale() -> None:
    axis = _axis()
    draw_card(axis, (0.0, CARD[1]), ANCHOR, 0, [""] * 4)
    scale = 1e3 * card_scale(ANCHOR)
    assert card_scale(ANCHOR) == 2.0
    casing, *magnets = [patch for patch in axis.patches if hasattr(patch, "get_closed")]
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


def test_predictions_stand_beside_the_simulation() -> None:
    tube = FREE.replace(mount="tube", feed={"direction": "backward"})
    free, one_by_one = predicted(tube, "LRLLL")
    assert free.word == minimise(tube, "free").best.word
    assert one_by_one.word == minimise(tube, "backward").best.word
    assert free.note.startswith("as simulated; −11.")
    assert predicted(FREE, "LLLLL")[0].note.startswith("not what was simulated")
    assert len(predicted(FREE, "LRLLL")) == 1
    for outcome in predicted(ANCHOR, "LRRLL"):
        assert outcome.joints is None
        assert "field" in outcome.note
    long = FREE.replace(sequence=("NSNS",) * (LONGEST + 1))
    assert "more than 24 components" in predicted(long, "")[0].note


def test_a_fold_that_broke_down_is_told_and_not_drawn() -> None:
    broken = replace(_fold(FREE, "LRLLL"), status=mf.FoldStatus.FAILED, angles=np.full(6, np.nan))
    outcome = simulated(broken)
    assert outcome.joints is None
    assert outcome.note.startswith("failed: ")


@pytest.mark.medium
@pytest.mark.parametrize(
    ("count", "pages"), [(1, 1), pytest.param(6, 1, marks=pytest.mark.slow), (14, 2)]
)
def test_long_chains_flow_onto_more_pages(count: int, pages: int, tmp_path: Path) -> None:
    scene = ANCHOR.replace(sequence=(ANCHOR.sequence * 3)[:count])
    fold = _fold(scene, "LR" * 7 if count > 14 else ("LR" * 7)[: count - 1])
    pdf, png = tmp_path / "sheet.pdf", tmp_path / "sheet.PNG"
    save_sheet(scene, fold, pdf, "anchor")
    assert _pages(pdf) == pages
    once = pdf.read_bytes()
    save_sheet(scene, fold, pdf, "anchor")
    assert pdf.read_bytes() == once
    save_sheet(scene, fold, png)
    with Image.open(png) as image:
        width, height = image.size
        assert height == pytest.approx(pages * width * 297 / 210, abs=2 * pages)
        assert np.asarray(image)[-10:].min() > 200  # a margin
    assert {entry.name for entry in tmp_path.iterdir()} == {"sheet.pdf", "sheet.PNG"}


def test_every_magnet_is_counted_once_and_where_it_is() -> None:
    found, where = kinds(ANCHOR)
    empty = np.array([[pole == "-" for pole in faces] for faces in ANCHOR.sequence])
    np.testing.assert_array_equal(where == -1, empty)
    assert [kind.name for kind in found] == ["A", "B"]
    for index, kind in enumerate(found):
        assert kind.pieces == (where == index).sum()
    assert sum(kind.pieces for kind in found) == "".join(ANCHOR.sequence).count("N") + "".join(
        ANCHOR.sequence
    ).count("S")
    # Front faces have the small strong blocks.
    assert (where[:, [0, 3]] == 0).all()
    assert found[0].width == found[0].height == 0.004
    assert kind_text(found[0]) == (
        "12 pieces, 4 × 4 × 2 mm, inset 0.5 mm: remanence 1.2 T (NdFeB N35, 1.17–1.22 T)"
    )


@pytest.mark.parametrize(("direction", "first"), [("forward", 1), ("backward", 6)])
def test_who_leaves_the_tube_first_is_told(direction: str, first: int) -> None:
    scene = mf.load_scene("tube-feed").replace(feed={"direction": direction, "speed": 0.08})
    text = release_text(scene)
    assert f"component {first} leaves first, at 80 mm/s" in text
    assert "magnets are set at the mouth" in text
    assert release_text(scene.replace(mount="free")) == "Free release."
    assert "pinned" in release_text(scene.replace(mount="pinned"))


def test_the_nearest_grade_is_named_and_where_there_is_none_it_is_said() -> None:
    for grade in GRADES:
        assert nearest_grade((grade.low + grade.high) / 2) is grade
    assert grade_text(1.3) == "NdFeB N42, 1.28–1.32 T"
    for remanence, nearest in ((0.9, "N30"), (0.8, "BN10"), (0.1, "BN2"), (1.6, "N52")):
        text = grade_text(remanence)
        assert text.startswith("no common grade; nearest ")
        assert nearest in text
