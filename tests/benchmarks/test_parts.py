"""Tests that every benchmark runs at a small size and writes its rows and its diagram."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from magfold_bench import ground_states, idealisations, scaling, work_precision
from magfold_bench.laws import experiment
from magfold_bench.magnets import accuracy, peers, samples
from magfold_bench.parts import BENCHMARKS
from tests.command_line import run

pytest.importorskip("matplotlib.figure")

SCENES = work_precision.named_scenes()
FEW = {name: SCENES[name] for name in ("sequence 1, free", work_precision.PENDULUM)}
LITTLE: list[tuple[Any, str, Any]] = [
    (work_precision, "named_scenes", lambda: FEW),
    (work_precision, "QUICK",
     work_precision.Effort(2, (1e-2, 1e-4), (1e-2, 1e-3), (1 / 1200,), (1e-7, 1e-6), 2)),
    (scaling, "QUICK_LENGTHS", (1, 3)),
    (samples.timing, "enough_repeats", lambda _: 1),
    # Python takes less time for what little is summed here than it takes to compile the loops.
    (samples, "sum_forces", getattr(samples.sum_forces, "py_func", samples.sum_forces)),
    (accuracy, "QUICK", accuracy.Effort(12, 2, 1, (1, 3), (3,), (1e-2, 1e-4), 1)),
    (ground_states, "QUICK_PROVED", {8: 2, 10: 1}),
    (experiment, "QUICK_RUNS", 2),
    (idealisations, "QUICK_CHAINS", 2),
]  # fmt: skip
SLOW = {"skipping", "first-use"}
PARTS = [
    pytest.param(benchmark, name, marks=pytest.mark.slow if name in SLOW else pytest.mark.medium)
    for benchmark, parts in BENCHMARKS.items()
    for name in parts
]


@pytest.fixture(autouse=True)
def _little(monkeypatch: pytest.MonkeyPatch) -> None:
    for module, name, value in LITTLE:
        monkeypatch.setattr(module, name, value)


@pytest.mark.parametrize(("benchmark", "name"), PARTS)
def test_every_part_runs_and_draws(benchmark: str, name: str, tmp_path: Path) -> None:
    if name == "peers":
        pytest.importorskip({"magnets": peers.MAGPYLIB, "dynamics": "pymunk"}[benchmark])
    run("bench", benchmark, "--quick", "--only", name, "--out", tmp_path / "out", code=0)
    part = json.loads((tmp_path / f"out/{benchmark}.json").read_text("utf-8"))["parts"][name]
    assert part["rows"]
    files = {f"{benchmark}.json", f"{name}.csv"}
    if BENCHMARKS[benchmark][name].draw:
        files.add(f"{name}.png")
    assert {path.name for path in (tmp_path / "out").iterdir()} == files


@pytest.mark.medium
def test_bounds_hold_in_the_quick_measurement() -> None:
    rows = accuracy.run(True, lambda *_: None).rows
    bounded = [row for row in rows if row["model"] == accuracy.BOUND]
    assert {row["states"] for row in bounded} == {accuracy.PAIRS, accuracy.FOLDS, accuracy.LONG}
    for row in bounded:
        assert float(row["worst error"]) <= float(row["setting"])


@pytest.mark.bench
def test_proofs_keep_within_their_time() -> None:
    findings = ground_states.run(False, lambda *_: None).findings
    assert findings
    assert not [finding for finding in findings if "NOT within" in finding]


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
