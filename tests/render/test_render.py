"""Tests of frames: their contents and layout, and contacts between faces."""

import numpy as np
import pytest
from numpy.typing import ArrayLike

import magfold_env as mf
from magfold_env.render import style
from magfold_env.render.canvas import Canvas, View
from magfold_env.render.chain import touches
from magfold_env.render.frames import chain_view, picture, with_magnets
from magfold_env.shapes import centres, headings, word_to_angles

FREE = mf.load_scene("paper/sequence-3")
TUBE = mf.load_scene("tube-feed")
DIAGONAL = FREE.casing.diagonal


def frame(scene: mf.Scene, angles: ArrayLike, base: ArrayLike, released: int) -> np.ndarray:
    at = np.asarray(angles, dtype=np.float64), np.asarray(base, dtype=np.float64)
    whole = View(-1.2 * DIAGONAL, (scene.n + 1.2) * DIAGONAL, -DIAGONAL, DIAGONAL)
    view = chain_view(scene, *at, released).joined(whole)
    return np.asarray(picture(scene, *at, released, view, None, "", (640, 480)))


def count_of(picture: np.ndarray, colour: style.Colour) -> int:
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


def test_poles_have_their_colours_and_the_size_of_their_face() -> None:
    def colours(letters: str) -> tuple[int, int]:
        scene = FREE.replace(sequence=(letters,) * 6)
        picture = frame(scene, np.zeros(6), np.zeros(2), 6)
        return count_of(picture, style.NORTH), count_of(picture, style.SOUTH)

    north, south = colours("NNNN")
    assert north > 1000
    assert south == 0
    assert colours("SSSS") == (0, pytest.approx(north, rel=0.1))
    half = colours("NNSS")
    assert half[0] == pytest.approx(north / 2, rel=0.05)
    assert half[1] == pytest.approx(half[0], rel=0.1)
    bare = frame(FREE.replace(magnets=None), np.zeros(6), np.zeros(2), 6)
    assert count_of(bare, style.NORTH) == count_of(bare, style.SOUTH) == 0

    def areas(**magnets: object) -> tuple[int, int]:
        scene = mf.Scene(sequence=("NSSS",)).replace(magnets=magnets)
        picture = frame(scene, [0.0], [0.0, 0.0], 1)
        return count_of(picture, style.NORTH), count_of(picture, style.SOUTH)

    even = areas(width=0.005, thickness=0.002)
    small = areas(width=(0.0025, 0.005, 0.005, 0.005), thickness=0.002)
    thick = areas(width=0.005, thickness=(0.003, 0.002, 0.002, 0.002))
    assert small[0] == pytest.approx(even[0] / 2, rel=0.1)
    assert thick[0] == pytest.approx(even[0] * 1.5, rel=0.1)
    assert small[1] == thick[1] == even[1]


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
    assert count_of(some, style.TUBE) > 500
    assert count_of(some, style.NORTH) < count_of(every, style.NORTH)


SIDE = 0.0125
ORIGIN = np.zeros(2)


def _pairs(word: str, turn: float = 0.0) -> list[tuple[int, int]]:
    angles = headings(word_to_angles(word)) + turn
    return [(t.first[0] + 1, t.second[0] + 1) for t in touches(angles, ORIGIN, SIDE)]


@pytest.mark.parametrize("word", ["L", "R", "LRLLL", "LLL", "SLS", "LRLRL", "LLRRL"])
def test_on_the_lattice_neighbouring_cells_touch(word: str) -> None:
    angles = headings(word_to_angles(word))
    middles = centres(angles, side=SIDE)
    apart = np.hypot(*(middles[:, None] - middles[None]).transpose(2, 0, 1))
    first, second = np.nonzero(np.triu(np.abs(apart - SIDE) < 1e-6 * SIDE))
    expected = sorted(zip((first + 1).tolist(), (second + 1).tolist(), strict=True))
    assert sorted(_pairs(word)) == expected


def test_faces_that_open_do_not_touch() -> None:
    joint = np.array([np.pi / 2 - 0.1])
    assert touches(headings(joint), ORIGIN, SIDE) == []
