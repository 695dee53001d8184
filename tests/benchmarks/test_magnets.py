"""The magnets benchmark: what is measured, its parts and their report."""

import numpy as np
import pytest

from magfold_bench.laws import exact_magnets
from magfold_bench.magnets.samples import (
    Sums,
    sample_of,
)
from magfold_env.scene import Magnets
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
