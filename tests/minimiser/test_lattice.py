"""Words as arrays: the enumeration and the poses, against positions in the plane."""

import numpy as np
import pytest

from magfold_env.minimiser.lattice import all_words, from_words
from magfold_env.shapes import folded_words
from tests.minimiser import reference


@pytest.mark.parametrize("n", [1, 2, 3, 5, 6, 7])
def test_all_words_without_overlap_in_the_order_slr(n: int) -> None:
    lattice = all_words(n)
    assert [lattice.word(row) for row in range(len(lattice))] == reference.words(n)


def test_the_paper_counts_229_words_of_which_26_are_fully_folded() -> None:
    lattice = all_words(6)
    folded = lattice[lattice.fully_folded()]
    assert len(lattice) == 229
    assert sorted(folded.word(row) for row in range(len(folded))) == folded_words(6)
    assert len(folded) == 26


def test_cells_and_poses_are_centres_and_headings() -> None:
    words = ["LRSLR", "LLLLL", "SSSSS", "RSLSR"]
    lattice = from_words(words)
    for row, word in enumerate(words):
        centres, headings = reference.centres_and_headings(word, side=np.sqrt(2.0))
        np.testing.assert_allclose(lattice.cells[row], centres - centres[0], atol=1e-12)
        for i, j, poses in lattice.pairs():
            cos, sin = np.cos(headings[i]), np.sin(headings[i])
            seen = np.array([[cos, sin], [-sin, cos]]) @ (centres[j] - centres[i])
            np.testing.assert_allclose(poses[row, :2], seen, atol=1e-12)
            turned = (headings[j] - headings[i]) / (np.pi / 2) - poses[row, 2]
            assert turned / 4 == pytest.approx(round(turned / 4))


def test_overlaps_are_those_of_the_3_mm_filter() -> None:
    words = ["LLL", "LLLL", "LLLR", "RRRRS", "LLSLL", "LSLSLS", "LLSLLSS"]
    for word in words:
        assert from_words([word]).overlapping()[0] == reference.overlaps(word, 1.0)
