"""The layout of a snapshot: what is where, at every size."""

from dataclasses import replace

import numpy as np
import pytest

import magfold_env as mf
from magfold_env.render import style
from magfold_env.render.canvas import Size
from magfold_env.render.snapshot import Snapshot, snapshot_picture, snapshot_view
from magfold_env.shapes import centres, headings, word_to_angles

SCENE = mf.load_scene("tube-feed")
WORD = "LRLLL"


def snapshot(word: str = "SSSSS", released: int = 6, direction: str = "forward") -> Snapshot:
    scene = SCENE.replace(feed={"direction": direction})
    return Snapshot(
        scene=scene,
        angles=headings(word_to_angles(word)),
        base=np.zeros(2),
        released=released,
        target=WORD,
        held=np.zeros(6, dtype=np.bool_),
        chosen=np.ones(6, dtype=np.bool_),
        title="fed 6 of 6",
        message="at rest",
        rows=(("word", word), ("energy", "1 mJ")),
        predicted="LLLSS",
    )


@pytest.mark.parametrize("size", [(400, 300), (800, 600), (1280, 720), (600, 900)])
def test_a_picture_has_the_asked_size_and_fills_it(size: Size) -> None:
    picture = np.asarray(snapshot_picture(snapshot(), size))
    assert picture.shape == (size[1], size[0], 3)
    for half in (picture[:, : size[0] // 2], picture[:, size[0] // 2 :]):
        assert (half.min(axis=-1) < 100).any()


@pytest.mark.parametrize("direction", ["forward", "backward"])
@pytest.mark.parametrize("word", ["SSSSS", "RLRRR", "LRLRL"])
def test_the_view_holds_the_chain(word: str, direction: str) -> None:
    shown = snapshot(word, direction=direction)
    view = snapshot_view(shown)
    for x, y in centres(shown.angles, side=SCENE.casing.side):
        assert view.left < x < view.right
        assert view.bottom < y < view.top


def test_nothing_of_the_ghost_is_shown_of_a_chain_in_the_tube() -> None:
    inside = snapshot(released=0)
    other = replace(inside, target="RRSSS")
    left = [np.asarray(snapshot_picture(each))[:, :540] for each in (inside, other)]
    np.testing.assert_array_equal(left[0], left[1])
    out = [replace(each, released=6) for each in (inside, other)]
    left = [np.asarray(snapshot_picture(each))[:, :540] for each in out]
    assert (left[0] != left[1]).any()


def test_words_lie_over_the_chain_and_nowhere_else() -> None:
    plain, covered = (
        np.asarray(snapshot_picture(each))
        for each in (snapshot(), replace(snapshot(), overlay=("key\twhat it does",)))
    )
    np.testing.assert_array_equal(plain[:, 544:], covered[:, 544:])
    assert (plain[:, :544] != covered[:, :544]).mean() > 0.1


def test_a_component_that_is_chosen_is_outlined_with_its_magnets() -> None:
    waiting = replace(snapshot(released=0), base=np.array([-6 * SCENE.casing.diagonal, 0.0]))
    chosen = np.asarray(snapshot_picture(replace(waiting, marked=5)))
    plain = np.asarray(snapshot_picture(waiting))

    def count(picture: np.ndarray, colour: style.Colour) -> int:
        return int((picture == np.array(colour[:3])).all(axis=-1).sum())

    for colour in (style.MARKED, style.NORTH):
        assert count(chosen, colour) > count(plain, colour) + 100
