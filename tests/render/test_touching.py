"""Which faces touch, against the folds on the lattice where this is known."""

import numpy as np
import pytest

from magfold_env.render.chain import touches
from magfold_env.shapes import centres, headings, word_to_angles

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


def test_a_straight_chain_touches_nowhere() -> None:
    assert _pairs("SSSS") == []


def test_turning_a_chain_changes_nothing() -> None:
    assert _pairs("LRLLL", turn=0.7) == _pairs("LRLLL")


def test_faces_that_open_do_not_touch() -> None:
    joint = np.array([np.pi / 2 - 0.1])
    assert touches(headings(joint), ORIGIN, SIDE) == []


def test_the_stretch_is_the_shared_side() -> None:
    (touch,) = touches(headings(word_to_angles("L")), ORIGIN, SIDE)
    assert np.hypot(*(touch.ends[1] - touch.ends[0])) == pytest.approx(SIDE)
    # A joint to the left brings the left faces together: front of 1, back of 2.
    assert touch.first == (0, 0)
    assert touch.second == (1, 1)
    middle = centres(headings(word_to_angles("L")), side=SIDE).mean(axis=0)
    np.testing.assert_allclose(touch.ends.mean(axis=0), middle, atol=1e-12)
