"""Poses of the magnets benchmark: random pairs, folded chains and random shapes."""

import numpy as np
import pytest

from magfold_bench.laws.overlap import squares_apart
from magfold_bench.magnets import samples
from magfold_env.shapes import angles_to_word, centres, is_fully_folded, overlaps
from tests.benchmarks.magnet_pairs import SIDE, alike


@pytest.mark.parametrize("seed", range(40))
def test_random_pairs_do_not_overlap(seed):
    _, (places, headings) = alike(seed)
    assert squares_apart(places, headings, SIDE) > -1e-12


@pytest.mark.parametrize("n", [2, 6, 20, 61, 1000])
def test_folded_chains_of_any_length_are_compact_and_do_not_overlap(n):
    headings = samples.folded(n)
    word = angles_to_word(np.diff(headings))
    assert is_fully_folded(word)
    assert not overlaps(word)
    np.testing.assert_allclose(np.abs(np.diff(headings)), np.pi / 2, rtol=0, atol=1e-12)
    # A square of n casings is √n sides long; staircases lie at 45 degrees to their bounds.
    assert np.ptp(centres(headings, SIDE), axis=0).max() <= 2.5 * np.sqrt(n) * SIDE
