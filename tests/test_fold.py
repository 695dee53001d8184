"""Tests of folds: geometry, files, and one-line texts of results."""

import csv
import json
import re
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import magfold_env as mf
from tests.folds import lying, recorded


def _fold(word: str, **changes: Any) -> mf.Fold:
    scene = mf.Scene(sequence=("NSNS",) * (len(word) + 1))
    return lying(scene, word, 0.3, base=np.array([0.01, 0.02]), **changes)


def test_hinges_of_neighbours_meet_halfway_between_their_headings() -> None:
    fold = _fold("LSR")
    half = 0.0125 * np.sqrt(0.5) * np.stack([np.cos(fold.angles), np.sin(fold.angles)], axis=1)
    centres = fold.centres()
    np.testing.assert_allclose(centres[0] - half[0], fold.base, atol=1e-15)
    np.testing.assert_allclose((centres + half)[:-1], (centres - half)[1:], atol=1e-15)


def test_a_fold_is_read_back(tmp_path: Path) -> None:
    fold = replace(_fold("LR", energy=np.nan), in_tube=1)
    fold.to_json(tmp_path / "fold.json")
    read = mf.Fold.from_json(tmp_path / "fold.json")
    assert read.angles.tobytes() == fold.angles.tobytes()
    assert read.base.tobytes() == fold.base.tobytes()
    assert np.isnan(read.energy)
    same = ("scene", "status", "message", "word", "time", "steps", "evaluations", "in_tube")
    assert [getattr(read, name) for name in same] == [getattr(fold, name) for name in same]


@pytest.mark.parametrize(("change", "message"), [
    ({"format": "x"}, "format: 'x' is not allowed; must be 'magfold_env fold 1'"),
    ({"angles": [0.0]}, "angles and base must have shapes (3,) and (2,)"),
    ({"status": "gone"}, "'gone' is not a valid FoldStatus"),
    ({"word": "LX"}, "word: 'LX' is not allowed"),
])  # fmt: skip
def test_what_is_no_fold_is_told(change: dict[str, object], message: str, tmp_path: Path) -> None:
    path = tmp_path / "fold.json"
    path.write_text(json.dumps(_fold("LR").to_dict() | change), encoding="utf-8")
    with pytest.raises(ValueError, match=re.escape(f"{path}: is not a fold; {message}")):
        mf.Fold.from_json(path)


def test_a_motion_is_finite_up_to_where_numbers_broke_down() -> None:
    angles = np.zeros((4, 3))
    places, rates, out = np.zeros((4, 2)), np.zeros((4, 3)), np.full(4, 3)
    arrays = (np.arange(4.0), angles, places, rates, out, 0.0 * places, np.zeros(4), 0.0125)
    assert len(mf.Trajectory(*arrays).finite()) == 4
    angles[2, 1] = np.nan
    assert mf.Trajectory(*arrays).finite().time.tolist() == [0.0, 1.0]
    angles[0, 0] = np.inf
    with pytest.raises(ValueError, match="without a finite frame"):
        mf.Trajectory(*arrays).finite()


def test_a_motion_has_a_line_a_frame(tmp_path: Path) -> None:
    fold = recorded("LR", mf.Scene(sequence=("NSNS",) * 3))
    motion = fold.trajectory
    assert motion is not None
    assert motion.centres.shape == (len(motion), 3, 2)
    np.testing.assert_allclose(motion.centres[-1], fold.centres(), atol=1e-15)
    np.testing.assert_array_equal(motion.finite().centres, motion.centres)
    motion.to_csv(tmp_path / "motion.csv")
    with (tmp_path / "motion.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(motion)
    expected = {
        "time": motion.time[7], "released": motion.released[7], "push": motion.push[7],
        "base_y": motion.base[7, 1], "base_vx": motion.base_velocity[7, 0],
        "x_3": motion.centres[7, 2, 0], "y_1": motion.centres[7, 0, 1],
        "angle_2": motion.angles[7, 1], "rate_3": motion.rates[7, 2],
    }  # fmt: skip
    assert {name: float(rows[7][name]) for name in expected} == expected


def test_a_motion_is_a_data_frame() -> None:
    pandas = pytest.importorskip("pandas")
    motion = recorded("LR", mf.Scene(sequence=("NSNS",) * 3)).trajectory
    assert motion is not None
    frame = motion.to_dataframe()
    assert isinstance(frame, pandas.DataFrame)
    assert frame["x_2"].tolist() == motion.centres[:, 1, 0].tolist()


def test_data_frames_say_what_they_need(monkeypatch: pytest.MonkeyPatch) -> None:
    motion = recorded("LR", mf.Scene(sequence=("NSNS",) * 3)).trajectory
    assert motion is not None
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(ImportError, match=r"^data frames need pandas: pip install pandas$"):
        motion.to_dataframe()


def test_notebooks_play_what_was_recorded() -> None:
    fold = mf.simulate(mf.load_scene("paper/sequence-3"), seed=0, frame_rate=60.0)
    assert repr(fold.trajectory).startswith(
        f"<Trajectory: {len(fold.trajectory or ())} frames of 6"
    )
    assert repr(fold).endswith(f"{len(fold.trajectory or ())} frames>")
    shown = fold._repr_html_()
    assert shown.startswith('<iframe title="Playable fold"')
    assert 'srcdoc="&lt;!doctype html&gt;' in shown
    none, two, out = np.zeros(0), np.zeros((0, 2)), np.zeros(0, dtype=np.int64)
    nothing = mf.Trajectory(none, np.zeros((0, 6)), two, np.zeros((0, 6)), out, two, none, 0.01)
    assert "0 frames" in repr(nothing)


SCENE = mf.load_scene("paper/sequence-3")


@pytest.mark.parametrize(
    ("result", "begin"),
    [
        (mf.minimise(SCENE), "<Minimum: LRLLL -11.39 mJ, SRLLL"),
        (mf.ground_state(SCENE), "<Minimum: LRLLL -11.39 mJ>"),
        (mf.ensemble(SCENE, 3), "<Ensemble, runs=3: LRLLL folded 100 % (44–100)>"),
        (mf.sweep(SCENE, {"friction": [0.1, 0.2]}, runs=1),
         "<Sweep over friction (2 values), runs=1>"),
        (mf.design("L", budget=10, runs=2), "<Design of L, forward: "),
    ],
    ids=lambda value: type(value).__name__,
)  # fmt: skip
def test_results_fit_into_a_line(result: object, begin: str) -> None:
    assert repr(result).startswith(begin)
    assert len(repr(result)) < 200
