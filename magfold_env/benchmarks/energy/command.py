"""The parts of the energy benchmark."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from magfold_env.benchmarks import runner
from magfold_env.benchmarks.energy import ground_states, predictors, scan
from magfold_env.benchmarks.energy.about import ABOUT
from magfold_env.benchmarks.runner import Runner

PARTS: dict[str, Runner] = {
    scan.NAME: scan.run,
    ground_states.NAME: ground_states.run,
    predictors.NAME: predictors.run,
}


def benchmark() -> runner.Benchmark:
    """Return the parts, their diagrams and what is said about them."""
    return runner.Benchmark("energy", PARTS, {}, about=ABOUT)


def run(only: Sequence[str], quick: bool, out: Path | None) -> None:
    """Measure, print, and write tables, as `runner.run` says."""
    runner.run(benchmark(), only, quick, out)
