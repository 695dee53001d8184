"""`magfold bench predict`: its parts, on few releases."""

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import magfold_env as mf
from magfold_bench import idealisations
from magfold_bench.laws import experiment
from magfold_env.cli import app


def _silent(share: float, what: str) -> None:
    pass


@pytest.mark.medium
def test_the_experiment_is_written_and_drawn(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("matplotlib.figure")
    monkeypatch.setattr(experiment, "QUICK_RUNS", 2)
    command = ["bench", "predict", "--quick", "--only", "experiment", "--out", str(tmp_path)]
    result = CliRunner().invoke(app.app, command)
    assert result.exit_code == 0, result.output
    rows = json.loads((tmp_path / "predict.json").read_text())["parts"]["experiment"]["rows"]
    cases = {(row["sequence"], row["mode"]) for row in rows}
    assert cases == {(k, mode) for k in experiment.SEQUENCES for mode in experiment.MODES}
    for case in cases:
        shares = [r["probability"] for r in rows if (r["sequence"], r["mode"]) == case]
        assert sum(shares) == pytest.approx(1.0)
    bars = [experiment.bar_of(row) for row in rows]
    assert all(mf.Scene(sequence=("NNNN",) * 6).n - 1 == len(bar.joints) for bar in bars)
    for name in ("experiment.png", "experiment.csv"):
        assert (tmp_path / name).stat().st_size > 0


def test_releases_by_hand_vary_in_all_that_is_stated() -> None:
    for mode in experiment.MODES:
        scene = experiment.paper_scene(2, mode)
        assert scene.spreads == experiment.SPREADS
        assert scene.start_angle_spread == experiment.ANGLE
        assert scene.sequence == mf.load_scene("paper/sequence-2").sequence
        assert scene.mount == ("free" if mode == "free" else "tube")


def test_each_change_is_of_one_part_of_a_scene() -> None:
    parts = ["gravity", "friction", "friction", "magnets", "magnets", "magnets", "casing", "casing"]
    for scene in idealisations.random_chains(3) + idealisations.designed_chains(3):
        start = "start_offsets" if scene.mount == "tube" else "start_angles"
        for change, part in zip(
            idealisations.CHANGES.values(), [*parts, start, "solver"], strict=True
        ):
            changed = change(scene, np.random.default_rng((1, 0)))
            assert changed.is_concrete
            assert changed != scene
            assert changed.replace(**{part: getattr(scene, part)}) == scene


@pytest.mark.medium
def test_ends_are_counted_by_change_and_kind_of_chain() -> None:
    found = idealisations.run(True, _silent)
    assert len(found.rows) == 2 * len(idealisations.CHANGES)
    assert all(0 <= row["others"] <= row["of"] == 3 for row in found.rows)  # pyright: ignore[reportOperatorIssue]
    same = [row["others"] for row in found.rows if row["change"] == "solver ten times as exact"]
    assert same == [0, 0]
