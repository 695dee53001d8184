"""Sweeps: every point is an ensemble of its own, however and whenever it is made."""

import csv
import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import magfold_env as mf
from magfold_env.checkpoint import CheckpointError
from magfold_env.ensembles import sweeps
from magfold_env.ensembles.releases import release
from magfold_env.ensembles.sweeps import Outcome
from magfold_env.simulation import pack
from tests.killed import run_until_killed

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


def test_one_number_does_not_stand_for_the_strengths_of_single_magnets() -> None:
    rows = [[0.6] * 4] * 5 + [[0.3] * 4]
    uneven = SCENE.replace(magnets={"remanence": rows})
    allowed = r"magnets\.remanence: .* must not stand for the several that the scene has"
    with pytest.raises(mf.SceneError, match=allowed):
        mf.sweep(uneven, OVER, RUNS)


def test_all_points_draw_the_same(made: mf.Sweep) -> None:
    drawn = [each.scene.draw(each.generator(2)) for each in made.ensembles]
    for scene, point in zip(drawn, made.points, strict=True):
        assert scene.start_offsets == drawn[0].start_offsets
        assert scene.frictions[0] / point["friction"] == pytest.approx(drawn[0].frictions[0] / 0.1)


@pytest.mark.medium
@pytest.mark.parametrize("backend", ["threads", "processes"])
def test_a_sweep_does_not_depend_on_who_makes_it(made: mf.Sweep, backend: Any) -> None:
    again = mf.sweep(SCENE, OVER, RUNS, seed=3, workers=2, backend=backend)
    assert again.to_dict() == made.to_dict()


def test_progress_is_told_and_more_runs_add_to_what_is_there(
    made: mf.Sweep, tmp_path: Path
) -> None:
    told: list[tuple[int, int]] = []
    for runs in (3, RUNS):
        again = mf.sweep(
            SCENE, OVER, runs, seed=3, state=tmp_path, progress=lambda *count: told.append(count)
        )
    assert told == [(k, 18) for k in range(1, 19)] + [(k, 24) for k in range(19, 25)]
    assert again.to_dict() == made.to_dict()


KILLED = """
import json, sys
from magfold_env import Scene, sweep
scene, over, state = sys.argv[1:]
sweep(Scene.model_validate_json(scene), json.loads(over), 4, seed=3, workers=2, state=state)
"""


@pytest.mark.medium
def test_a_killed_sweep_goes_on_and_ends_in_the_same_file(made: mf.Sweep, tmp_path: Path) -> None:
    state = tmp_path / "state"
    run_until_killed(9, KILLED, SCENE.model_dump_json(), json.dumps(OVER), str(state))
    told: list[int] = []
    again = mf.sweep(SCENE, OVER, RUNS, seed=3, state=state, progress=lambda k, _: told.append(k))
    assert told == list(range(10, 25))
    for name, each in (("again", again), ("made", made)):
        each.to_json(tmp_path / name)
    assert (tmp_path / "again").read_bytes() == (tmp_path / "made").read_bytes()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"seed": 4}, "whose seed is 0 where this one's is 4"),
        ({"over": {"friction": [0.1, 0.3]}}, r"whose over is \[\['friction', \[0.1, 0.2\]\]\] w"),
        ({"scene": SCENE.replace(duration=1.0)}, "whose scene.duration is 5.0 where this one's"),
    ],
)
def test_a_state_of_another_sweep_is_refused(
    changes: dict[str, Any], message: str, tmp_path: Path
) -> None:
    given: dict[str, Any] = {"scene": SCENE, "over": {"friction": [0.1, 0.2]}, "runs": 1}
    mf.sweep(**given, state=tmp_path)
    with pytest.raises(CheckpointError, match=message):
        mf.sweep(**given | changes, state=tmp_path)
    with pytest.raises(CheckpointError, match="whose kind is 'sweep' where this one's is 'ensem"):
        mf.ensemble(SCENE, 1, state=tmp_path)


# --- tables of magnets ----------------------------------------------------------------------------


@pytest.mark.medium
@pytest.mark.parametrize(
    ("side", "over", "most"),  # sides that no other test has
    [
        (0.0126, {"friction": [0.1, 0.2, 0.3], "magnets.remanence": [0.6, 0.8]}, 1),
        (0.0127, {"feed.speed": [0.1, 0.2, 0.3], "casing.corner_radius": [1e-5, 1e-4]}, 1),
        (0.0128, {"magnets.inset": [0.0003, 0.0005, 0.0007], "friction": [0.1, 0.2]}, 3),
    ],
)
def test_tables_are_made_once_a_geometry(
    side: float, over: dict[str, list[float]], most: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    built: list[object] = []
    real = pack.build_tables
    monkeypatch.setattr(pack, "build_tables", lambda *given: built.append(given) or real(*given))
    mf.sweep(SCENE.replace(casing={"side": side}), over, 2, workers=2)
    assert len(built) == most


# --- what may be swept ----------------------------------------------------------------------------


def test_every_number_of_a_scene_has_a_key() -> None:
    keys = set(sweeps.keys())
    assert keys >= {
        *("friction", "start_angle_spread", "duration", "feed.speed", "casing.corner_radius"),
        *("magnets.remanence", "magnets.nodes", "spreads.friction", "field.magnet.remanence"),
    }
    assert not keys & {"mount", "contact", "sequence", "magnets", "magnets.model", "start_angles"}


@pytest.mark.parametrize("key", sorted(sweeps.keys()))
def test_a_key_is_of_a_number_that_replace_takes(key: str) -> None:
    magnet = {"position": (0.3, 0.3), "width": 0.01, "height": 0.01, "thickness": 0.01}
    group = {"field": {"magnet": magnet}, "bumps": {"rate": 1.0, "speed": 0.1}}
    scene = SCENE.replace(**group)
    for value in (2.0, 1.0, 0.1, 0.02, 1e-3, 1e-4):
        try:
            (found, _) = sweeps.scenes(scene, {key: (value, value)})
        except mf.SceneError:
            continue
        for name in key.split("."):
            found = getattr(found, name)
        assert found == value
        return
    pytest.fail("no value was taken")


@pytest.mark.parametrize(
    ("over", "message"),
    [
        ({}, r"over: \[\] is not allowed; must name one or two numbers of the scene"),
        ({"friction": [1, 2], "duration": [1, 2], "feed.speed": [1, 2]}, "must name one or two"),
        ({"frictoin": [0, 1]}, "over: 'frictoin' is not allowed; .*; did you mean friction"),
        ({"bore": [0, 1]}, "over: 'bore' is not allowed; .*; did you mean feed.bore?"),
        ({"mount": [0, 1]}, "over: 'mount' is not allowed; must be the key of a number"),
        ({"friction": [0.2]}, r"friction: \[0.2\] is not allowed; must be 2 to 100 numbers"),
        ({"friction": [0.2, 0.1]}, "must be 2 to 100 numbers, each larger than the one before"),
        ({"friction": [0.2, 0.2]}, "each larger than the one before"),
        ({"friction": range(101)}, "must be 2 to 100 numbers"),
        ({"friction": [0.1, math.nan]}, "must be 2 to 100 numbers"),
        ({"friction": [0.1, 10**400]}, "must be 2 to 100 numbers"),
        ({"friction": [False, True]}, "must be 2 to 100 numbers"),
        ({"friction": "12"}, "friction: '12' is not allowed; must be 2 to 100 numbers"),
        ({"friction": 0.3}, "friction: 0.3 is not allowed; must be 2 to 100 numbers"),
        ({"friction": [-1, 1]}, "at friction=-1: friction: -1 is not allowed; must be greater"),
        ({"casing.side": [0.01, 0.02]}, "at casing.side=0.01: magnets.width: 0.006 is not all"),
        ({"solver.max_steps": [1.5, 2]}, "at solver.max_steps=1.5: solver.max_steps: 1.5 is not"),
        ({"bumps.rate": [1, 2]}, "at bumps.rate=1: bumps.speed: None is not allowed; must be gi"),
    ],
)
def test_what_cannot_be_swept_is_told(over: Any, message: str) -> None:
    with pytest.raises(mf.SceneError, match=message):
        mf.sweep(SCENE, over, 1)


@pytest.mark.medium
@given(
    st.dictionaries(
        st.sampled_from(["friction", "feed.speed", "solver.max_steps", "x", ""]),
        st.lists(st.floats() | st.integers() | st.text(max_size=2), max_size=3) | st.none(),
        max_size=3,
    )
)
def test_any_grid_is_taken_or_refused(over: Any) -> None:
    try:
        values = sweeps._checked(over)
    except mf.SceneError:
        return
    assert list(values) == list(over)
    assert all(np.diff(each).min() > 0.0 for each in values.values())


# --- outcomes -------------------------------------------------------------------------------------


@given(st.lists(st.sampled_from(["LRLLL", "LSL", "folded", "misfolded", "x"]), max_size=3))
def test_an_outcome_is_what_its_text_says(parts: list[str]) -> None:
    text = " ".join(parts)
    allowed = parts in (["LRLLL"], ["folded"], ["misfolded"], ["LRLLL", "folded"])
    if allowed or parts == ["LRLLL", "misfolded"]:
        assert str(Outcome.parse(text, 6)) == text
    else:
        with pytest.raises(mf.SceneError, match="is not allowed; must be a word of 5 letters"):
            Outcome.parse(text, 6)


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


def test_a_written_sweep_is_read_bit_for_bit(made: mf.Sweep, tmp_path: Path) -> None:
    made.to_json(tmp_path / "sweep.json")
    read = mf.Sweep.from_json(tmp_path / "sweep.json")
    assert json.loads((tmp_path / "sweep.json").read_text()) == made.to_dict() == read.to_dict()
    assert (read.scene, read.over) == (made.scene, made.over)
    for a, b in zip(read.ensembles, made.ensembles, strict=True):
        assert a.scene == b.scene
        assert a.angles.tobytes() == b.angles.tobytes()


def test_the_csv_has_a_line_a_point_and_outcome(made: mf.Sweep, tmp_path: Path) -> None:
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


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda data: data.pop("points"), "is not a sweep; 'points'"),
        (lambda data: data["points"].pop(), r"is not a sweep; zip\(\) argument 2 is shorter"),
        (lambda data: data.update(over={"friction": [2, 1]}), "each larger than the one before"),
        (lambda data: data.update(over=[]), "is not a sweep; over:"),
        (lambda data: data["points"][0]["runs"][0].pop(), "a run of 6 components is not"),
    ],
)
def test_a_file_that_is_no_sweep_is_refused(
    change: Callable[[dict[str, Any]], Any], message: str, made: mf.Sweep, tmp_path: Path
) -> None:
    data = made.to_dict()
    change(data)
    (tmp_path / "sweep.json").write_text(json.dumps(data))
    with pytest.raises(ValueError, match=message):
        mf.Sweep.from_json(tmp_path / "sweep.json")
