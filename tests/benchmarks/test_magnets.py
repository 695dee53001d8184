"""Tests of the poses and errors of the magnets benchmark."""

import numpy as np
import pytest

from magfold_bench.laws import exact_magnets
from magfold_bench.laws.overlap import squares_apart
from magfold_bench.magnets.samples import Sums, folded, sample_of
from magfold_env.scene import Magnets
from magfold_env.shapes import angles_to_word, centres, is_fully_folded, overlaps
from tests.benchmarks.magnet_pairs import SIDE, alike


def test_errors_are_of_forces_and_of_torques_over_the_side():
    scene, pose = alike(1)
    sample = sample_of([scene], [pose])
    unit = exact_magnets.flush_force(scene)
    exact = sample.exact
    assert sample.errors(exact) == pytest.approx([0.0])
    second = np.array([[0.0, unit]])
    off = exact._replace(fx=exact.fx + 0.3 * second, fy=exact.fy + 0.4 * second)
    assert sample.errors(off) == pytest.approx([0.5])
    off = exact._replace(torque=exact.torque + 0.2 * SIDE * second)
    assert sample.errors(off) == pytest.approx([0.2])


def test_more_nodes_err_less_and_points_never_converge():
    drawn = [alike(seed) for seed in range(10)]
    sample = sample_of([scene for scene, _ in drawn], [pose for _, pose in drawn])
    strips = [sample.errors(Sums(sample, Magnets(nodes=k)).loads()).max() for k in (2, 6, 20)]
    assert strips[0] > 10 * strips[1] > 100 * strips[2]
    lines = Magnets(model="points", nodes=30)
    assert sample.errors(Sums(sample, lines).loads()).max() > 0.5


@pytest.mark.parametrize("seed", range(40))
def test_random_pairs_do_not_overlap(seed):
    _, (places, headings) = alike(seed)
    assert squares_apart(places, headings, SIDE) > -1e-12


@pytest.mark.parametrize("n", [2, 6, 20, 61, 1000])
def test_folded_chains_of_any_length_are_compact_and_do_not_overlap(n):
    headings = folded(n)
    word = angles_to_word(np.diff(headings))
    assert is_fully_folded(word)
    assert not overlaps(word)
    np.testing.assert_allclose(np.abs(np.diff(headings)), np.pi / 2, rtol=0, atol=1e-12)
    # A square of n casings is √n sides long; staircases lie at 45 degrees to their bounds.
    assert np.ptp(centres(headings, SIDE), axis=0).max() <= 2.5 * np.sqrt(n) * SIDE
