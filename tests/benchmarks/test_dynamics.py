"""The parts of the dynamics benchmark, their report and their command."""

import csv
import json
import sys
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from magfold_bench import folds, parts, runs
from magfold_bench.folds import ContactEffort, moreau_only, recorded_fold
from magfold_bench.laws import smooth_motion
from magfold_bench.laws.smooth_motion import EULER, SmoothProblem, pendulum, prepare_engine
from magfold_bench.parts import Part
from magfold_bench.runs import CLOSE
from magfold_bench.smooth import needed, same_error
from magfold_env.cli import app
from magfold_env.reporting import tables
from magfold_env.reporting.tables import Measurement, Table


def drawn(name, found, folder):
    return parts.draw(name, parts.BENCHMARKS["dynamics"][name], found, folder)


def smooth_row(error, time, evaluations, method="engine"):
    return {
        "problem": "pendulum",
        "method": method,
        "setting": 1e-3,
        "error [rad]": error,
        "evaluations": evaluations,
        "time [µs]": time,
        "lower quartile [µs]": time,
        "upper quartile [µs]": time,
        "call overhead [µs]": 5.0,
    }


def test_cost_of_an_error_follows_the_power_law_between_settings():
    # Second order: twice the work, a quarter of the error.
    rows = [smooth_row(0.1 / 4**k, 5.0 + 10.0 * 2**k, 100 * 2**k) for k in range(8)]
    assert needed(rows, "evaluations", 1e-3) == pytest.approx(100 * np.sqrt(100.0))
    assert needed(rows, "time [µs]", 1e-3) == pytest.approx(10 * np.sqrt(100.0))
    assert np.isnan(needed(rows, "evaluations", 1e-9))


def test_double_euler_is_given_the_steps_for_the_same_error(monkeypatch):
    # Interpreted: compiling takes longer.
    euler = replace(EULER, fixed=getattr(EULER.fixed, "py_func", EULER.fixed))
    monkeypatch.setattr(smooth_motion, "EULER", euler)
    problem = SmoothProblem("short", pendulum(3).scene.replace(duration=0.1))
    exact = [prepare_engine(problem, 1e-10, (k + 1) / 6)().angles for k in range(6)]
    found = same_error(problem, 2e-3, exact)
    assert 0.95 * 2e-3 < found.error <= 2e-3
    assert euler.prepare(problem, found.setting)().evaluations == found.setting


@pytest.mark.slow  # compiles the engine's loop once more
def test_moreau_alone_takes_more_steps_to_the_same_word():
    _, _, scene = folds.contact_scenes(ContactEffort((3,), 1, (1e-3,), (), 1))[1]
    events = recorded_fold(scene, 1e-3)
    with moreau_only():
        steps = recorded_fold(scene, 1e-3)
    assert recorded_fold(scene, 1e-3).steps == events.steps
    assert (steps.word, steps.status) == (events.word, events.status)
    assert steps.steps > 2 * events.steps
    # Moreau's steps take two evaluations and a bit, Dormand and Prince's six.
    assert steps.evaluations < 4 * steps.steps
    assert runs.difference(steps, events) < 0.1
    assert runs.difference(events, events) == 0.0


@pytest.mark.slow
def test_located_events_are_more_exact_at_the_same_tolerance(tmp_path):
    effort = ContactEffort((3,), 1, (1e-2, 1e-3), (), 1)
    name, kind, scene = folds.contact_scenes(effort)[1]
    rows = folds.measure(name, kind, scene, effort)
    error = {(row["method"], row["tolerance [rad]"]): float(row["error [rad]"]) for row in rows}
    assert error[folds.ENGINE, 1e-3] < 0.2 * error[folds.ENGINE, 1e-2]
    assert error[folds.ENGINE, 1e-3] < 0.2 * error[folds.MOREAU, 1e-3]
    assert all(float(row["sensitivity [rad]"]) < CLOSE for row in rows)
    assert folds.clear(rows) == rows
    assert [path.name for path in drawn("contact", Measurement(rows), tmp_path)] == ["contact.png"]


def test_a_motion_is_close_only_if_it_stays_so_at_tighter_tolerances():
    rows = [
        {"scene": "a", "method": "m", "tolerance [rad]": t, "error [rad]": e, "time [ms]": c}
        for t, e, c in ((1e-2, 0.001, 1.0), (1e-3, 0.5, 3.0), (1e-4, 0.01, 9.0))
    ]
    assert folds.cost_of_close(rows, "m") == [9.0]
    assert folds.cost_of_close(rows[:2], "m") == [np.inf]


def example():
    rows = [smooth_row(0.1 / 4**k, 10.0 * 2**k, 100 * 2**k) for k in range(4)]
    rows.append(smooth_row(float("nan"), 1.0, 1, "DOP853"))
    return Measurement(rows, [Table("Errors [rad]", rows)], ["it [holds]"])


def test_files_hold_what_was_measured(tmp_path):
    found = example()
    paths = tables.write(tmp_path, "dynamics", {"processor": "µ"}, {"smooth": found})
    paths += drawn("smooth", found, tmp_path)
    assert [path.name for path in paths] == ["smooth.csv", "dynamics.json", "smooth.png"]
    with paths[0].open(encoding="utf-8", newline="") as file:
        read = list(csv.DictReader(file))
    assert [float(row["error [rad]"]) for row in read[:4]] == [0.1 / 4**k for k in range(4)]
    data = json.loads(paths[1].read_text(encoding="utf-8"))
    assert data["machine"] == {"processor": "µ"}
    assert data["parts"]["smooth"]["findings"] == ["it [holds]"]
    assert data["parts"]["smooth"]["rows"][-1]["error [rad]"] is None
    assert paths[2].read_bytes().startswith(b"\x89PNG")
    assert {path.name for path in tmp_path.iterdir()} == {path.name for path in paths}


def test_the_command_measures_the_parts_it_is_asked_for(tmp_path, monkeypatch):
    asked = []

    def part(quick, progress):
        progress(0.5, "half")
        asked.append(quick)
        return example()

    chosen = {"smooth": Part(part), "contact": Part(part)}
    monkeypatch.setitem(parts.BENCHMARKS, "dynamics", chosen)
    out = tmp_path / "new" / "folder"
    arguments = ["bench", "dynamics", "--quick", "--only", "smooth", "--out", str(out)]
    result = CliRunner().invoke(app.app, arguments)
    assert result.exit_code == 0, result.stderr
    assert asked == [True]
    assert "it [holds]" in result.stdout
    assert "Errors [rad]" in result.stdout
    assert (out / "smooth.csv").is_file()
    wrong = CliRunner().invoke(app.app, ["bench", "dynamics", "--only", "rest"])
    assert wrong.exit_code == 2
    assert "'rest' is not allowed; must be one of smooth, contact" in wrong.stderr


def test_missing_extras_are_told_before_the_work(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    chosen = {"contact": Part(lambda *_: pytest.fail("measured"))}
    monkeypatch.setitem(parts.BENCHMARKS, "dynamics", chosen)
    result = CliRunner().invoke(app.app, ["bench", "dynamics", "--out", str(tmp_path)])
    assert result.exit_code == 2
    assert "diagrams need matplotlib" in result.stderr
