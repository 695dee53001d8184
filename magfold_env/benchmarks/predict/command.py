"""The parts of the prediction benchmark."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from magfold_env.benchmarks import runner
from magfold_env.benchmarks.predict import predictors, scaling
from magfold_env.benchmarks.predict.about import ABOUT
from magfold_env.benchmarks.runner import Runner
from magfold_env.laws import experiment

PARTS: dict[str, Runner] = {
    "experiment": experiment.run,
    "predictors": predictors.run,
    "scaling": scaling.run,
}


def benchmark() -> runner.Benchmark:
    """Return the parts, their diagrams and what is said about them."""
    return runner.Benchmark(
        "predict", PARTS, {"experiment": experiment.draw_experiment}, about=ABOUT
    )


def run(only: Sequence[str], quick: bool, out: Path | None) -> None:
    """Measure, print, and write tables and diagrams, as `runner.run` says."""
    runner.run(benchmark(), only, quick, out)
