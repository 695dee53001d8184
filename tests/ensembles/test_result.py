"""Tests of Ensemble: its probabilities, columns and files, for invented runs."""

import csv
import math
from pathlib import Path

import numpy as np
import pytest

import magfold_env as mf
from magfold_env.ensembles.releases import Run
from magfold_env.reporting.intervals import share

SCENE = mf.Scene(sequence=("NSNS", "SNSN", "NNSS"))
FOLDED, MISFOLDED, FAILED = mf.FoldStatus.FOLDED, mf.FoldStatus.MISFOLDED, mf.FoldStatus.FAILED
ENDS = [("LR", FOLDED), ("LL", FOLDED), ("LR", MISFOLDED), ("SL", MISFOLDED), ("LR", FOLDED)]


def made_of(ends: list[tuple[str, mf.FoldStatus]], *, broken: bool = False) -> mf.Ensemble:
    rng = np.random.default_rng(0)
    runs = [
        Run(k, word, status.value, rng.normal(), rng.random(), tuple(rng.normal(size=3)))
        for k, (word, status) in enumerate(ends)
    ]
    if broken:
        angles = (math.nan, 0.1, math.inf)
        runs.append(Run(len(runs), "SS", FAILED.value, math.nan, 0.5, angles))
    return mf.Ensemble.of(SCENE, 7, runs)


def test_probabilities_are_shares_of_the_runs_most_frequent_first() -> None:
    made = made_of(ENDS)
    assert list(made.words.items()) == [
        ("LR", share(3, 5)),
        ("LL", share(1, 5)),
        ("SL", share(1, 5)),
    ]
    assert made.statuses == {FOLDED: share(3, 5), MISFOLDED: share(2, 5)}
    assert list(made.outcomes.items()) == [
        (("LR", FOLDED), share(2, 5)),
        (("LL", FOLDED), share(1, 5)),
        (("LR", MISFOLDED), share(1, 5)),
        (("SL", MISFOLDED), share(1, 5)),
    ]


def test_any_word_and_status_has_a_probability() -> None:
    made = made_of(ENDS)
    assert made.probability("LR") == share(3, 5)
    assert made.probability("LR", "folded") == made.probability("LR", FOLDED) == share(2, 5)
    assert made.probability(status=FOLDED) == share(3, 5)
    assert made.probability() == share(5, 5)
    unseen = made.probability("RR")
    assert (unseen.rate, unseen.low) == (0.0, 0.0)
    assert 0.0 < unseen.high < 1.0
    with pytest.raises(ValueError, match="status: 'gone' is not allowed; must be one of folded, "):
        made.probability(status="gone")


def test_what_did_not_occur_has_a_share_of_0() -> None:
    made = made_of(ENDS)
    never = share(0, 5)
    assert made.words["RR"] == made.statuses[FAILED] == made.outcomes["RR", FOLDED] == never
    assert made.outcomes["LL", MISFOLDED] == never
    assert "RR" not in made.words
    assert made.words.get("RR") is None
    assert len(made.words) == 3
    with pytest.raises(ValueError, match="'RRR'"):
        _ = made.words["RRR"]


@pytest.mark.parametrize("broken", [False, True])
def test_a_written_ensemble_is_read_bit_for_bit(broken: bool, tmp_path: Path) -> None:
    made = made_of(ENDS, broken=broken)
    made.to_json(tmp_path / "ensemble.json")
    read = mf.Ensemble.from_json(tmp_path / "ensemble.json")
    assert (read.scene, read.seed) == (made.scene, made.seed)
    for name in ("word", "status", "energy", "time"):
        np.testing.assert_array_equal(getattr(read, name), getattr(made, name))
    finite = np.isfinite(made.angles)
    np.testing.assert_array_equal(read.angles[finite], made.angles[finite])
    assert np.isnan(read.angles[~finite]).all()
    assert read.outcomes == made.outcomes


def test_the_csv_has_a_line_a_run(tmp_path: Path) -> None:
    made = made_of(ENDS)
    made.to_csv(tmp_path / "runs.csv")
    with (tmp_path / "runs.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [(row["word"], row["status"]) for row in rows] == ENDS
    assert [float(row["energy"]) for row in rows] == made.energy.tolist()
    assert [float(row["angle_3"]) for row in rows] == made.angles[:, 2].tolist()


def test_what_each_run_drew_is_a_column() -> None:
    spreads = {"friction": 0.2, "magnet": 0.1, "mass": 0.1, "tilt": 2.0, "obstacle_offset": 0.001}
    wall = mf.Rectangle(position=(0.1, 0.0), size=(0.01, 0.01))
    scene = SCENE.replace(spreads=spreads, obstacles=[wall])
    made = mf.Ensemble.of(scene, 7, list(made_of(ENDS)._runs()))
    columns = made.columns()
    for k in range(len(made)):
        drawn = scene.draw(made.generator(k))
        magnets = drawn.magnets
        assert magnets is not None
        assert isinstance(magnets.remanence, tuple)
        assert columns["friction"][k] == drawn.friction
        assert columns["casing.mass_3"][k] == drawn.masses[2]
        strengths = [columns[f"magnets.remanence_2_{f}"][k] for f in range(1, 5)]
        assert tuple(strengths) == magnets.remanence[1]
        assert drawn.start_angles is not None
        assert columns["start_angles_2"][k] == drawn.start_angles[1]
        assert columns["gravity.in_plane_1"][k] == drawn.gravity.in_plane[0]
        assert columns["obstacles_1.position_2"][k] == drawn.obstacles[0].position[1]
    # What does not vary is not told again.
    assert not {"duration", "spreads.friction", "obstacles_1.position_1"} & columns.keys()
