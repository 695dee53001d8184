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
    Chain,
    Loads,
    Sums,
    joint_torques,
    pinned_states,
    sample_of,
)
from magfold_bench.parts import BENCHMARKS
from magfold_env.cli import app
from magfold_env.reporting.tables import Measurement
from magfold_env.scene import Magnets
from magfold_env.shapes import centres
from tests.benchmarks.command import measuring
from tests.benchmarks.magnet_pairs import SIDE, alike


def silent(share, what):
    pass


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


def test_joint_torques_are_moments_of_what_lies_beyond_a_joint():
    rng = np.random.default_rng(3)
    headings = rng.normal(size=4)
    states = pinned_states([headings], SIDE)
    loads = Loads(*rng.normal(size=(3, 1, 4)))
    places = centres(headings, SIDE)
    reach = SIDE / np.sqrt(2)
    for joint in (1, 2, 3):
        hinge = places[joint] - reach * np.array([np.cos(headings[joint]), np.sin(headings[joint])])
        expected = 0.0
        for i in range(joint, 4):
            arm = places[i] - hinge
            expected += loads.torque[0, i] + arm[0] * loads.fy[0, i] - arm[1] * loads.fx[0, i]
        assert joint_torques(loads, states, SIDE)[0, joint - 1] == pytest.approx(expected)


def test_a_chain_turns_its_joints_as_the_reference_says():
    rng = np.random.default_rng(5)
    scene = samples.random_scene(rng, 5).replace(magnets={"accuracy": 1e-4})
    headings = samples.random_shape(rng, 5, SIDE)
    states = pinned_states([headings], SIDE)
    force, torque = exact_magnets.forces(scene, centres(headings, SIDE), headings)
    exact = joint_torques(Loads(force[None, :, 0], force[None, :, 1], torque[None]), states, SIDE)
    found = joint_torques(Chain(scene, states).loads(), states, SIDE)
    bound = 1e-4 * exact_magnets.flush_force(scene) * SIDE
    np.testing.assert_allclose(found, exact, rtol=0, atol=bound)


# Python takes less time for what little is summed here than it takes to compile the loops.
@pytest.fixture(
    scope="module",
    autouse=True,
    params=["interpreted", pytest.param("compiled", marks=pytest.mark.slow)],
)
def loops(request):
    with pytest.MonkeyPatch.context() as patch:
        for name in ("sum_forces", "chain_forces"):
            kernel = getattr(samples, name)
            if request.param == "interpreted":
                patch.setattr(samples, name, getattr(kernel, "py_func", kernel))
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
