"""The parts of the benchmark of whole runs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from magfold_env.benchmarks import runner
from magfold_env.benchmarks.runner import Runner
from magfold_env.benchmarks.whole import figures, skipping, work_precision
from magfold_env.benchmarks.whole.about import ABOUT

PARTS: dict[str, Runner] = {
    work_precision.NAME: work_precision.run,
    skipping.NAME: skipping.run,
}


def benchmark() -> runner.Benchmark:
    """Return the parts, their diagrams and what is said about them."""
    return runner.Benchmark("whole", PARTS, figures.DRAWINGS, about=ABOUT)


def run(only: Sequence[str], quick: bool, out: Path | None) -> None:
    """Measure, print, and write tables and diagrams, as `runner.run` says."""
    runner.run(benchmark(), only, quick, out)
