"""The magnets benchmark: what is measured, its parts and their report."""

import numpy as np
import pytest
from typer.testing import CliRunner

from magfold_bench import parts
from magfold_bench.laws import exact_magnets
from magfold_bench.magnets import (
    accuracy,
    samples,
)
from magfold_bench.magnets.peers import MAGPYLIB, installed
from magfold_bench.magnets.samples import (
    Sums,
    sample_of,
)
from magfold_bench.parts import BENCHMARKS
from magfold_bench.tables import Measurement
from magfold_env.cli import app
from magfold_env.scene import Magnets
from tests.benchmarks.command import measuring
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


# Python takes less time for what little is summed here than it takes to compile the loops.
@pytest.fixture(
    scope="module",
    autouse=True,
    params=["interpreted", pytest.param("compiled", marks=pytest.mark.slow)],
)
def loops(request):
    with pytest.MonkeyPatch.context() as patch:
        if request.param == "interpreted":
            plain = getattr(samples.sum_forces, "py_func", samples.sum_forces)
            patch.setattr(samples, "sum_forces", plain)
        yield


LITTLE = accuracy.Effort(12, 2, 1, (1, 3), (3,), (1e-2, 1e-4), 1)


@pytest.fixture(
    scope="module",
    params=[
        pytest.param(False, id="little"),
        pytest.param(True, id="quick", marks=pytest.mark.slow),
    ],
)
def measured(request, tmp_path_factory):
    measure = measuring("magnets", tmp_path_factory)
    with pytest.MonkeyPatch.context() as patch:
        if not request.param:
            patch.setattr(samples.timing, "enough_repeats", lambda work: 1)
            patch.setattr(accuracy, "QUICK", LITTLE)
        yield measure


@pytest.mark.medium
@pytest.mark.parametrize("name", list(BENCHMARKS["magnets"]))
def test_every_part_runs_and_draws(name, measured):
    if name == "peers" and not installed():
        pytest.skip(f"{MAGPYLIB} is not installed")
    part, files = measured(name)
    assert part["rows"]
    assert part["findings"]
    assert files == {"magnets.json", f"{name}.csv", f"{name}.png"}


@pytest.mark.medium
def test_bounds_hold_in_the_quick_measurement(measured):
    part, _ = measured("accuracy")
    bounded = [row for row in part["rows"] if row["model"] == accuracy.BOUND]
    assert {row["states"] for row in bounded} == {accuracy.PAIRS, accuracy.FOLDS, accuracy.LONG}
    for row in bounded:
        assert float(row["worst error"]) <= float(row["setting"])


def test_parts_without_rows_have_no_diagram(tmp_path):
    assert parts.draw("peers", BENCHMARKS["magnets"]["peers"], Measurement(), tmp_path) == []


def test_unknown_parts_are_told():
    wrong = CliRunner().invoke(app.app, ["bench", "magnets", "--only", "rest"])
    assert wrong.exit_code == 2
    assert f"must be one of {', '.join(BENCHMARKS['magnets'])}" in wrong.stderr
