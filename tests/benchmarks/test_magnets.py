"""The magnets benchmark: what is measured, its parts and their report."""

import numpy as np
import pytest
from typer.testing import CliRunner

from magfold_bench import parts, scaling
from magfold_bench.laws import exact_magnets
from magfold_bench.magnets import (
    accuracy,
    chains,
    far,
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
from magfold_env.reporting.tables import Measurement, growth
from magfold_env.scene import Magnets
from magfold_env.shapes import centres
from tests.benchmarks.command import measuring
from tests.benchmarks.magnet_pairs import SIDE, alike
from tests.reference import magnet_field


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


FEW_GAPS = exact_magnets.GAPS[::5]


def test_point_charges_are_too_strong_near_and_right_far_away(monkeypatch):
    monkeypatch.setattr(exact_magnets, "GAPS", FEW_GAPS)
    rows = exact_magnets.force_rows()
    near = [float(row["magnets / exact"]) for row in exact_magnets.rows_at(rows, 0.001)]
    far = [float(row["magnets / exact"]) for row in exact_magnets.rows_at(rows, 0.03)]
    assert min(near) > 4
    np.testing.assert_allclose(far, 1.0, atol=0.06)
    # One charge a face: Coulomb's law by hand.
    lone = next(row for row in exact_magnets.rows_at(rows, 0.01) if row["h"] == 1)
    charge, t = Magnets().charge, 0.0025
    by_hand = 1e-7 * charge**2 * (1 / 0.01**2 - 2 / (0.01 + t) ** 2 + 1 / (0.01 + 2 * t) ** 2)
    found = float(lone["magnets / exact"]) * float(lone["exact [N]"])
    assert found == pytest.approx(by_hand)


def test_the_states_of_a_fold_are_as_many_as_its_evaluations():
    scene = next(iter(chains.fold_scenes(chains.Effort((3,), 1, 1)).values()))
    session = chains.RecordedSession(scene)
    session.run()
    states = chains.states_of(scene)
    assert states.first.size == session.evaluations
    np.testing.assert_array_equal(states.q[-1], session.path[-1])
    # Evaluations of a step lie between its ends.
    low, high = (f([path[: scene.n] for path in session.path], axis=0) for f in (np.min, np.max))
    assert (states.q[:, : scene.n] >= low - 1e-12).all()
    assert (states.q[:, : scene.n] <= high + 1e-12).all()


def test_the_slope_is_that_of_a_power_law():
    rows = [
        {"shape": "unfolded", "magnets": "m", "n": n, "time [µs]": 0.3 * n**1.7}
        for n in (2, 60, 450, 10_000)
    ]
    assert growth(rows, scaling.LONG) == pytest.approx(1.7)
    assert np.isnan(growth(rows[:2], scaling.LONG))


@pytest.mark.parametrize("shape", [samples.UNFOLDED, samples.FOLDED])
def test_the_far_field_errs_less_the_higher_its_order_and_the_farther_it_begins(shape):
    orders, radii = (1, 2, 3), (1.4, 2.8)
    settings = [far.Setting(order, radius, radius) for order in orders for radius in radii]
    found = far.errors_of(far.states_of(30, shape, 2), settings)
    errors = {(setting.order, setting.radius): error for setting, error in found.items()}
    for radius in radii:
        assert errors[1, radius] > 1.5 * errors[2, radius] > 3 * errors[3, radius] > 0
    # The first term left out falls faster with distance, the higher the order.
    for order in orders:
        assert errors[order, 1.4] > 2**order * errors[order, 2.8]


def test_the_engines_own_far_field_is_among_those_measured_and_keeps_its_bound():
    for effort in (far.QUICK, far.FULL):
        own = {far.Setting.of(far.own_rule(bound)) for bound in effort.bounds}
        assert own <= set(effort.settings)
        assert min(setting.groups for setting in effort.settings) > 4 / 3
    own = far.Setting.of(far.own_rule(1e-3))
    errors = far.errors_of(far.states_of(40, samples.FOLDED, 2), [own])
    assert errors[own] < 1e-3


def test_the_fastest_order_is_found_among_those_that_err_little_enough():
    def row(order, error, time, bound=1e-3):
        return {"nodes of accuracy": bound, "order": order, "error": error, "time [µs]": time}

    rows = [row(far.NONE, 0.0, 1.0), row(1, 2e-3, 2.0), row(1, 1e-3, 9.0)]
    rows += [row(3, 5e-4, 4.0), row(3, 1e-4, 5.0), row(3, 1e-4, 3.0, bound=1e-2), row(2, 0.1, 1.0)]
    assert far.fastest(rows, 1e-3) == {1: rows[2], 3: rows[3]}


def test_features_are_what_they_are_called():
    chosen = chains.features(6)
    assert set(chains.COSTLY) <= set(chosen)
    empty = {
        name: [faces.count("-") for faces in chosen[name].sequence]
        for name in chosen
        if any("-" in faces for faces in chosen[name].sequence)
    }
    assert empty == {
        "one face in four empty": [1] * 6,
        "two faces in four empty": [2] * 6,
        "every other component without magnets": [4, 0] * 3,
        "no component with magnets": [4] * 6,
    }
    assert np.ptp(np.abs(chosen["unequal strengths"].charges), axis=0).min() > 0


@pytest.mark.parametrize("name", ["an even field", "a fixed magnet", "unequal sizes"])
def test_features_act_on_the_chains_that_are_timed(name):
    """What the dynamics' kernel finds for them is what the reference says."""
    scene = chains.features(6)[name].replace(magnets={"accuracy": 1e-4})
    headings = samples.shapes(6)[samples.FOLDED]
    places, states = centres(headings, SIDE), pinned_states([headings], SIDE)
    force, torque = (
        one + other
        for one, other in zip(
            exact_magnets.forces(scene, places, headings),
            magnet_field.field_forces(scene, places, headings),
            strict=True,
        )
    )
    exact = joint_torques(Loads(force[None, :, 0], force[None, :, 1], torque[None]), states, SIDE)
    found = joint_torques(Chain(scene, states).loads(), states, SIDE)
    bound = 1e-4 * exact_magnets.flush_force(scene) * SIDE
    np.testing.assert_allclose(found, exact, rtol=0, atol=2 * bound)


def test_chains_without_magnets_feel_nothing():
    for name in ("no component with magnets", "no magnets in the scene"):
        scene = chains.features(6)[name]
        loads = Chain(scene, pinned_states([samples.folded(6)], SIDE)).loads()
        assert not any(each.any() for each in loads)


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
        patch.setattr(scaling, "QUICK_LENGTHS", (2, 60, 80))
        patch.setattr(scaling, "NODES_AT", 4)
        if not request.param:
            patch.setattr(samples.timing, "enough_repeats", lambda work: 1)
            patch.setattr(accuracy, "QUICK", LITTLE)
            patch.setattr(far, "QUICK", far.Effort((30,), 1, (1e-3,), (4.0,), 1))
            patch.setattr(chains, "QUICK", chains.Effort((3,), 2, 1))
            patch.setattr(exact_magnets, "GAPS", FEW_GAPS)
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
