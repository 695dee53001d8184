"""Tests of sweeps: each point equals a separate ensemble."""

import csv
import json
import math
from typing import Any

import pytest

import magfold_env as mf
from magfold_env.ensembles import sweeps
from magfold_env.ensembles.releases import release

SCENE = release(mf.load_scene("paper/sequence-1"), "backward", 0.1).replace(
    spreads={"friction": 0.3, "magnet": 0.1}
)
OVER = {"friction": [0.1, 0.5], "magnets.remanence": (0.6, 1.0, 1.4)}
RUNS = 4


@pytest.fixture(scope="module")
def made() -> mf.Sweep:
    return mf.sweep(SCENE, OVER, RUNS, seed=3, workers=1)


def test_every_point_is_the_ensemble_of_its_scene(made: mf.Sweep) -> None:
    assert (len(made), made.shape) == (6, (2, 3))
    for point, each in zip(made.points, made.ensembles, strict=True):
        strength = {"remanence": point["magnets.remanence"]}
        scene = SCENE.replace(friction=point["friction"], magnets=strength)
        alone = mf.ensemble(scene, RUNS, seed=3)
        assert (each.scene, each.seed) == (scene, 3)
        for column, values in alone.columns().items():
            assert values.tobytes() == each.columns()[column].tobytes()
    assert [tuple(point.values()) for point in made.points[:3]] == [
        (0.1, 0.6),
        (0.1, 1),
        (0.1, 1.4),
    ]


@pytest.mark.medium
@pytest.mark.parametrize("backend", ["threads", "processes"])
def test_a_sweep_does_not_depend_on_who_makes_it(made: mf.Sweep, backend: Any) -> None:
    again = mf.sweep(SCENE, OVER, RUNS, seed=3, workers=2, backend=backend)
    assert again.to_dict() == made.to_dict()


def test_progress_is_told_and_more_runs_add_to_what_is_there(made, tmp_path):
    told: list[tuple[int, int]] = []
    for runs in (3, RUNS):
        again = mf.sweep(
            SCENE, OVER, runs, seed=3, state=tmp_path, progress=lambda *count: told.append(count)
        )
    assert told == [(k, 18) for k in range(1, 19)] + [(k, 24) for k in range(19, 25)]
    assert again.to_dict() == made.to_dict()


# --- what may be swept ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    "key", ["duration", "casing.side", "magnets.nodes", "solver.max_steps", "field.magnet.width"]
)
def test_a_key_is_of_a_number_that_replace_takes(key: str) -> None:
    magnet = {"position": (0.3, 0.3), "width": 0.01, "height": 0.01, "thickness": 0.01}
    scene = SCENE.replace(field={"magnet": magnet})
    value = 3.0 if key in {"magnets.nodes", "solver.max_steps"} else 0.02
    (found, _) = sweeps.scenes(scene, {key: (value, value)})
    for name in key.split("."):
        found = getattr(found, name)
    assert found == value


@pytest.mark.parametrize(("over", "message"), [
    ({}, r"over: \[\] is not allowed; must name one or two numbers of the scene"),
    ({"friction": [1, 2], "duration": [1, 2], "feed.speed": [1, 2]}, "must name one or two"),
    ({"frictoin": [0, 1]}, "at frictoin=0: frictoin: 0 .*; did you mean friction"),
    ({"mount": [0, 1]}, "at mount=0: mount: 0 is not allowed; must be 'pinned', 'free' or"),
    ({"friction": [0.2]}, r"friction: \[0.2\] is not allowed; must be 2 to 100 numbers"),
    ({"friction": [0.2, 0.2]}, "each larger than the one before"),
    ({"friction": range(101)}, "must be 2 to 100 numbers"),
    ({"friction": [0.1, math.nan]}, "must be 2 to 100 numbers"),
    ({"friction": [False, True]}, "must be 2 to 100 numbers"),
    ({"friction": [0.1, 10**400]}, "must be 2 to 100 numbers"),
    ({"friction": [-1, 1]}, "at friction=-1: friction: -1 is not allowed; must be greater"),
    ({"casing.side": [0.01, 0.02]}, "at casing.side=0.01: magnets.width: 0.006 is not all"),
    ({"solver.max_steps": [1.5, 2]}, "at solver.max_steps=1.5: solver.max_steps: 1.5 is not"),
    ({"bumps.rate": [1, 2]}, "at bumps.rate=1: bumps.speed: None is not allowed; must be gi"),
])  # fmt: skip
def test_what_cannot_be_swept_is_told(over: Any, message: str) -> None:
    with pytest.raises(mf.SceneError, match=message):
        mf.sweep(SCENE, over, 1)


# --- outcomes -------------------------------------------------------------------------------------


def test_full_folds_count_by_word_and_others_by_status(made: mf.Sweep) -> None:
    for each in made.ensembles:
        counts = sweeps.outcomes(each)
        assert counts.total() == RUNS
        assert list(counts.values()) == sorted(counts.values(), reverse=True)
        for outcome, count in counts.items():
            assert (outcome.word is not None) == (outcome.status is mf.FoldStatus.FOLDED)
            assert each.probability(*outcome).successes == count
    assert made.leading.total() == RUNS * len(made)
    for outcome, count in made.leading.items():
        assert sum(share.successes for share in made.probability(*outcome)) == count


# --- files ----------------------------------------------------------------------------------------


def test_a_written_sweep_is_read_bit_for_bit_and_its_csv_has_a_line_an_outcome(made, tmp_path):
    made.to_json(tmp_path / "sweep.json")
    read = mf.Sweep.from_json(tmp_path / "sweep.json")
    assert json.loads((tmp_path / "sweep.json").read_text()) == made.to_dict() == read.to_dict()
    assert (read.scene, read.over) == (made.scene, made.over)
    for a, b in zip(read.ensembles, made.ensembles, strict=True):
        assert a.scene == b.scene
        assert a.angles.tobytes() == b.angles.tobytes()
    made.to_csv(tmp_path / "outcomes.csv")
    with (tmp_path / "outcomes.csv").open(newline="") as file:
        lines = list(csv.DictReader(file))
    occurred = {ends for each in made.ensembles for ends in each.outcomes}
    assert len(lines) == len(made) * len(occurred)
    for place, line in enumerate(lines):
        k = place // len(occurred)
        share = made.ensembles[k].probability(line["word"], line["status"])
        assert {key: float(line[key]) for key in made.over} == made.points[k]
        assert int(line["runs"]) == share.successes
        assert [float(line[key]) for key in ("low", "high")] == [share.low, share.high]
    assert sum(int(line["runs"]) for line in lines) == RUNS * len(made)
