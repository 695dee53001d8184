"""Curves are what runs have written, averaged over parts and spread over seeds."""

import json
from pathlib import Path

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from agents.curves import PARTS, main, series, training_curve, validation_curve
from agents.training.run import train
from tests.agents.training import records, tiny


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    folder = tmp_path_factory.mktemp("runs")
    paths = [folder / str(seed) for seed in range(2)]
    for seed, path in enumerate(paths):
        train(tiny(seed=seed, timesteps=480), path)
    return paths


@pytest.mark.medium
def test_series_are_those_of_the_run(runs: list[Path]) -> None:
    written = records(runs[0])
    for name, found in series(runs[0]).items():
        np.testing.assert_allclose(found, written[name], rtol=1e-6)


def test_a_part_is_the_mean_of_its_records() -> None:
    steps = np.arange(1.0, 10 * PARTS + 1.0)
    rising = np.stack([steps, steps], axis=1)
    curve = training_curve([rising, np.stack([steps, -steps], axis=1)])
    for k in range(PARTS):
        inside = steps[10 * k : 10 * k + 10]
        # The value at its end counts once more.
        mean = (inside.sum() + inside[-1]) / 11
        assert curve.success[:, k] == pytest.approx([mean, -mean])
    low, middle, high = curve.spread
    np.testing.assert_allclose((low, high), (-high, -low))
    np.testing.assert_allclose(middle, 0.0, atol=1e-9)


def test_parts_without_a_record_have_the_one_before() -> None:
    curve = training_curve([np.array([[3.0, 0.2], [30.0, 0.8]])])
    assert set(np.round(curve.success[0, 3:-1], 12)) == {0.2}
    assert curve.success[0, -1] == pytest.approx(0.8)


def test_validations_are_those_that_all_runs_have() -> None:
    long, short = np.array([[1.0, 0.1], [2.0, 0.2]]), np.array([[1.0, 0.3]])
    curve = validation_curve([long, short])
    np.testing.assert_array_equal(curve.steps, [1.0])
    np.testing.assert_array_equal(curve.success, [[0.1], [0.3]])


def test_the_command_writes_numbers_and_a_picture(runs: list[Path], tmp_path: Path) -> None:
    app = typer.Typer()
    app.command()(main)
    both = ",".join(map(str, runs))
    path = tmp_path / "curves.png"
    result = CliRunner().invoke(app, [f"tiny={both}", "--output", str(path)])
    assert result.exit_code == 0, result.output
    content = json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))
    assert np.shape(content["tiny"]["training"]["success"]) == (2, PARTS)
    assert path.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("given", "said"),
    [("a/b", "NAME=RUN"), ("x=", "NAME=RUN"), ("x=a,,b", "NAME=RUN"), ("x=no", "no: is not")],
)
def test_what_is_no_run_is_named(given: str, said: str) -> None:
    app = typer.Typer()
    app.command()(main)
    result = CliRunner().invoke(app, [given])
    assert result.exit_code == 2
    assert said in result.output
