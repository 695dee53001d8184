"""Frames: what is drawn, and where."""

import importlib
import sys
from typing import Any

import numpy as np
import pytest

import magfold_env as mf
from magfold_env import shapes
from magfold_env.render import frame, style
from magfold_env.render.canvas import Canvas, View
from magfold_env.render.frames import chain_view, usual_view, with_magnets

FREE = mf.load_scene("paper/sequence-3")
TUBE = mf.load_scene("tube-feed")
DIAGONAL = FREE.casing.diagonal


def _count(picture: np.ndarray, colour: style.Colour) -> int:
    return int((picture == np.array(colour[:3])).all(axis=-1).sum())


def test_a_canvas_is_true_to_scale_and_points_up() -> None:
    canvas = Canvas(View(-1.0, 1.0, -1.0, 1.0), (300, 200))
    assert canvas.scale == 100.0  # the smaller extent decides
    canvas.polygon([(0, 0), (0.5, 0), (0.5, 0.5), (0, 0.5)], fill=(0, 0, 0))
    dark = np.asarray(canvas.image()).max(axis=-1) < 128
    rows, columns = np.nonzero(dark)
    assert dark.sum() == pytest.approx(50 * 50, rel=0.05)
    assert (rows.min(), rows.max()) == pytest.approx((50, 100), abs=1)
    assert (columns.min(), columns.max()) == pytest.approx((150, 200), abs=1)


def test_a_frame_is_an_rgb_array_of_the_asked_size() -> None:
    picture = frame(FREE, np.zeros(6), np.zeros(2), 6, target="LRLLL", caption="x", size=(320, 200))
    assert picture.shape == (200, 320, 3)
    assert picture.dtype == np.uint8
    again = frame(FREE, np.zeros(6), np.zeros(2), 6, target="LRLLL", caption="x", size=(320, 200))
    np.testing.assert_array_equal(picture, again)


def test_poles_have_their_colours() -> None:
    def colours(letters: str) -> tuple[int, int]:
        scene = FREE.replace(sequence=(letters,) * 6)
        picture = frame(scene, np.zeros(6), np.zeros(2), 6)
        return _count(picture, style.NORTH), _count(picture, style.SOUTH)

    north, south = colours("NNNN")
    assert north > 1000
    assert south == 0
    assert colours("SSSS") == (0, pytest.approx(north, rel=0.1))
    half = colours("NNSS")
    assert half[0] == pytest.approx(north / 2, rel=0.05)
    assert half[1] == pytest.approx(half[0], rel=0.1)
    bare = frame(FREE.replace(magnets=None), np.zeros(6), np.zeros(2), 6)
    assert _count(bare, style.NORTH) == _count(bare, style.SOUTH) == 0


def test_a_face_without_a_magnet_stays_bare() -> None:
    def colours(letters: str) -> list[int]:
        picture = frame(FREE.replace(sequence=(letters,) * 6), np.zeros(6), np.zeros(2), 6)
        return [_count(picture, c) for c in (style.NORTH, style.SOUTH, style.EMPTY)]

    whole, some, none = colours("NNNN"), colours("N-N-"), colours("----")
    assert some[0] == pytest.approx(whole[0] / 2, rel=0.05)
    assert none == [0, 0, 0]


def test_magnets_have_the_size_of_their_face() -> None:
    def areas(**magnets: object) -> tuple[int, int]:
        scene = mf.Scene(sequence=("NSSS",)).replace(magnets=magnets)
        picture = frame(scene, [0.0], [0.0, 0.0], 1)
        return _count(picture, style.NORTH), _count(picture, style.SOUTH)

    even = areas(width=0.005, thickness=0.002)
    small = areas(width=(0.0025, 0.005, 0.005, 0.005), thickness=0.002)
    thick = areas(width=0.005, thickness=(0.003, 0.002, 0.002, 0.002))
    assert small[0] == pytest.approx(even[0] / 2, rel=0.1)
    assert thick[0] == pytest.approx(even[0] * 1.5, rel=0.1)
    assert small[1] == thick[1] == even[1]


MAGNET: dict[str, Any] = {
    "position": (0.05, 0.06),
    "width": 0.03,
    "height": 0.03,
    "thickness": 0.02,
}


def test_a_fixed_magnet_is_a_bar_of_two_poles() -> None:
    bare = mf.Scene(sequence=("----",) * 6)
    for heading in (0.0, np.pi):
        scene = bare.replace(field={"magnet": {**MAGNET, "heading": heading}})
        picture = frame(scene, np.zeros(6), [0.0, 0.0], 6)
        north, south = (
            np.argwhere((picture == np.array(c[:3])).all(axis=-1))
            for c in (style.NORTH, style.SOUTH)
        )
        assert len(north) == pytest.approx(len(south), rel=0.1)
        ahead = north[:, 1].mean() > south[:, 1].mean()
        assert ahead == (heading == 0.0)
    assert _count(frame(bare, np.zeros(6), [0.0, 0.0], 6), style.NORTH) == 0


def test_views_hold_a_fixed_magnet_that_is_not_too_far() -> None:
    straight = np.zeros(6), np.zeros(2), 6
    near = FREE.replace(field={"magnet": MAGNET})
    far = FREE.replace(field={"magnet": {**MAGNET, "position": (3.0, 0.0)}})
    corners = mf.FixedMagnet(**MAGNET).outline.corners
    view = chain_view(near, *straight)
    assert view.top > corners[:, 1].max()
    assert view.right > corners[:, 0].max()
    assert chain_view(far, *straight) == chain_view(FREE, *straight)
    assert usual_view(far, (640, 480)) == usual_view(FREE, (640, 480))


@pytest.mark.parametrize("field", [(0.0, 0.02), (0.02, 0.0), (-0.02, 0.0), (0.0, -0.02)])
def test_an_even_field_is_an_arrow_along_it(field: tuple[float, float]) -> None:
    scene = FREE.replace(magnets=None, field={"uniform": field})
    picture = frame(scene, np.zeros(6), [0.0, 0.0], 6)
    rows, columns = np.nonzero((picture == np.array(style.FIELD[:3])).all(axis=-1))
    arrow = rows < 450  # the number stands below it
    y, x = -rows[arrow], columns[arrow]
    extent = np.array([np.ptp(x), np.ptp(y)])
    assert extent @ np.abs(np.sign(field)) > 3.0 * extent @ np.abs(np.sign(field[::-1]))
    # The head is wide: the mean lies beyond the middle of the extent.
    lean = np.array([x.mean() - (x.min() + x.max()) / 2, y.mean() - (y.min() + y.max()) / 2])
    assert lean @ np.sign(field) > 0.02 * extent.max()
    still = FREE.replace(magnets=None, field={})
    assert _count(frame(still, np.zeros(6), [0.0, 0.0], 6), style.FIELD) == 0


def test_front_left_lies_to_the_left_of_the_heading() -> None:
    scene = mf.Scene(sequence=("NSSS",))
    picture = frame(scene, [0.0], [0.0, 0.0], 1)
    red = (picture == np.array(style.NORTH[:3])).all(axis=-1)
    blue = (picture == np.array(style.SOUTH[:3])).all(axis=-1)
    rows, columns = np.nonzero(red)
    all_rows, all_columns = np.nonzero(red | blue)
    assert rows.mean() < all_rows.mean()  # above: the heading is to the right, left is up
    assert columns.mean() > all_columns.mean()  # and ahead


@pytest.mark.parametrize("direction", ["forward", "backward"])
def test_components_in_the_tube_show_no_poles_until_they_are_loaded(direction: str) -> None:
    scene = TUBE.replace(feed={"direction": direction})
    heading = np.pi if direction == "forward" else 0.0
    # Straight, two components out and a third halfway.
    out = 2.5 * DIAGONAL
    base = [out, 0.0] if direction == "forward" else [out - 6 * DIAGONAL, 0.0]
    angles = np.full(6, heading)
    expected = np.array([True] * 3 + [False] * 3)
    if direction == "backward":
        expected = expected[::-1]
    np.testing.assert_array_equal(with_magnets(scene, angles, np.array(base), 2), expected)
    preloaded = scene.replace(feed={"loading": "preloaded"})
    assert with_magnets(preloaded, angles, np.array(base), 2).all()
    some = frame(scene, angles, base, 2)
    every = frame(preloaded, angles, base, 2)
    assert _count(some, style.TUBE) > 500
    assert _count(some, style.NORTH) < _count(every, style.NORTH)


def test_a_component_at_the_mouth_is_not_yet_loaded() -> None:
    at_mouth = with_magnets(TUBE, np.full(6, np.pi), np.zeros(2), 0)
    assert not at_mouth.any()


def test_the_view_stands_still_unless_the_chain_leaves_it() -> None:
    def ruler(base: list[float]) -> int:
        picture = frame(FREE.replace(magnets=None), np.zeros(6), base, 6)
        return _count(picture[-20:, -300:], style.FAINT)

    assert ruler([0.0, 0.0]) == ruler([0.005, 0.01])
    assert ruler([0.5, 0.0]) < ruler([0.0, 0.0])  # zoomed out: a centimetre is shorter


def test_a_chain_view_holds_every_casing() -> None:
    angles = shapes.headings(shapes.word_to_angles("LRRLS"), first=0.4)
    view = chain_view(FREE, angles, np.array([0.1, -0.2]), 6)
    place = shapes.centres(angles, side=FREE.casing.side, base=[0.1, -0.2])
    half = DIAGONAL / 2
    assert view.left < place[:, 0].min() - half
    assert view.right > place[:, 0].max() + half
    assert view.bottom < place[:, 1].min() - half
    assert view.top > place[:, 1].max() + half


def test_a_target_of_the_wrong_length_is_an_error() -> None:
    with pytest.raises(ValueError, match="must have 5 letters for 6 components"):
        frame(FREE, np.zeros(6), np.zeros(2), 6, target="LR")


def test_without_pillow_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [name for name in sys.modules if name.startswith("magfold_env.render")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "PIL", None)
    with pytest.raises(ImportError, match=r"pip install -e '\.\[render\]'"):
        importlib.import_module("magfold_env.render")
