"""`magfold sweep`: what it prints, what it writes, and what it refuses."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

import magfold_env as mf
from magfold_env.cli.sweep import grid_of
from magfold_env.ensembles import sweeps
from magfold_env.ensembles.releases import release
from tests.command_line import fails_in_one_line, rows, run
from tests.killed import records_in

SCENE = "paper/sequence-1"


def test_it_shows_and_writes_what_sweep_returns(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "120")
    out, png = tmp_path / "out", tmp_path / "map.png"
    grid = ("--over", "friction=0.1:0.5:2", "--over", "magnets.remanence=0.6,1")
    options = ("--mode", "backward", "--speed", 0.1, "--spread", "friction=0.3")
    files = ("--outcome", "RRLLR folded", "--out", out, "--png", png)
    result = run("sweep", SCENE, *grid, "--runs", 3, "--seed", 2, *options, *files)
    assert result.exit_code == 0, result.stderr
    scene = release(mf.load_scene(SCENE), "backward", 0.1).replace(spreads={"friction": 0.3})
    made = mf.sweep(scene, {"friction": [0.1, 0.5], "magnets.remanence": [0.6, 1.0]}, 3, seed=2)
    assert "4 points of 3 releases, seed 2, the same draws at each" in result.stdout
    table = rows(result.stdout)
    for row, point, each in zip(table, made.points, made.ensembles, strict=True):
        assert [float(cell) for cell in row[:2]] == list(point.values())
        (first, count), *_ = sweeps.outcomes(each).items()
        assert row[2:4] == [str(first), str(count)]
        assert row[-1] == str(each.probability("RRLLR", "folded"))
    assert mf.Sweep.from_json(out / "sweep.json").to_dict() == made.to_dict()
    made.to_csv(tmp_path / "outcomes.csv")
    assert (out / "outcomes.csv").read_text() == (tmp_path / "outcomes.csv").read_text()
    for path in (png, out / "sweep.png"):
        assert f"written: {path}" in result.stdout
        with Image.open(path) as image:
            assert image.format == "PNG"


def test_the_same_command_goes_on_where_it_was(tmp_path: Path) -> None:
    command = ("sweep", SCENE, "--out", tmp_path, "--over")
    for runs in (1, 3):
        assert run(*command, "friction=0.1:0.2:2", "--runs", runs).exit_code == 0
    assert list(records_in(tmp_path / "state")) == list(range(6))
    result = run(*command, "friction=0.1:0.3:2", "--runs", 3)
    fails_in_one_line(result, "records.sqlite: was written by another run, whose over is [['fr")


# --- grids ----------------------------------------------------------------------------------------

ENDS = st.tuples(*2 * [st.floats(-1e6, 1e6).map(lambda x: float(f"{x:.6g}"))])


@given(ENDS, st.integers(2, sweeps.MOST))
def test_a_range_is_even_from_end_to_end(ends: tuple[float, float], count: int) -> None:
    low, high = min(ends), max(ends)
    if high - low < 1e-3 * max(abs(low), abs(high), 1.0):
        low, high = 1.0, 2.0
    (values,) = grid_of([f"a.b={low}:{high}:{count}"]).values()
    assert (len(values), values[0], values[-1]) == (count, low, high)
    size = max(abs(low), abs(high))
    np.testing.assert_allclose(values, np.linspace(low, high, count), rtol=1e-11, atol=1e-11 * size)
    assert grid_of([f"a.b={low}:{high}"])["a.b"] == grid_of([f"a.b={low}:{high}:9"])["a.b"]


@given(st.floats(1e-6, 1e6), st.floats(1.01, 1e6), st.integers(2, sweeps.MOST))
def test_a_range_grows_by_equal_factors_if_wanted(low: float, ratio: float, count: int) -> None:
    (values,) = grid_of([f"key={low!r}:{low * ratio!r}:{count}:log"]).values()
    assert (len(values), values[0], values[-1]) == (count, low, low * ratio)
    factors = np.divide(values[1:], values[:-1])
    np.testing.assert_allclose(factors, ratio ** (1.0 / (count - 1)), rtol=1e-10)


@given(st.lists(st.floats(allow_nan=False), min_size=1, max_size=5))
def test_listed_values_are_taken_as_they_are(values: list[float]) -> None:
    assert grid_of([f"key={','.join(map(repr, values))}"]) == {"key": values}


@given(st.text(max_size=8) | st.text("=:,.0123456789-elogni", max_size=12))
def test_any_text_is_taken_or_told(text: str) -> None:
    try:
        grid = grid_of([text])
    except mf.SceneError as error:
        assert [(each.key, each.value) for each in error.problems] == [("--over", text)]  # noqa: PT017
    else:
        assert len(grid) == 1


def test_inner_values_look_as_one_would_write_them() -> None:
    assert grid_of(["a=0.6:1.4", "b=0.05:0.5:4"]) == {
        "a": [0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.3, 1.4],
        "b": [0.05, 0.2, 0.35, 0.5],
    }


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--over", "friktion=0:1"), "over: 'friktion' is not allowed; must be the key of a numb"),
        (("--over", "friction"), "--over: 'friction' is not allowed; must be KEY=LOW:HIGH, "),
        (("--over", "friction=1:0"), "--over: 'friction=1:0' is not allowed; "),
        (("--over", "friction=1:0"), "LOW must be less than HIGH"),
        (("--over", "friction=1:1"), "LOW must be less than HIGH"),
        (("--over", "friction=0:inf"), "LOW must be less than HIGH"),
        (("--over", "friction=0:1:1"), "COUNT must be 2 to 100"),
        (("--over", "friction=0:1:9:log"), "LOW must be greater than 0 for log"),
        (("--over", "friction=0:1:9:even"), "nothing but 'log' may follow COUNT"),
        (("--over", "friction=-1e308:1e308"), "each larger than the one before"),
        (("--over", "friction=-1:1"), "at friction=-1: friction: -1 is not allowed; must be grea"),
        (("--over", "mount=0:1"), "over: 'mount' is not allowed; must be the key of a number"),
        (2 * ("--over", "friction=0:1"), "--over: 'friction=0:1' is not allowed; must not name"),
        (("--over", "friction=0:1", "--over", "duration=1:2", "--over", "feed.bore=1:2"), "one o"),
        (("--over", "friction=0:1", "--outcome", "LR"), "outcome: 'LR' is not allowed; must be a"),
        (
            ("--over", "friction=0:1", "--runs", 0),
            "runs: 0 is not allowed; must be from 1 to 10000000",
        ),
        (("--over", "friction=0:1", "--mode", "up"), "mode: 'up' is not allowed; must be one of"),
        (("--over", "friction=0:1", "--png", "/nowhere/x.png"), "--png: '/nowhere/x.png' is not"),
    ],
)
def test_wrong_options_are_told_in_one_line(options: tuple[object, ...], message: str) -> None:
    fails_in_one_line(run("sweep", SCENE, *options), message)
