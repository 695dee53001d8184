"""The parts of the design benchmark."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from magfold_env.benchmarks import runner
from magfold_env.benchmarks.design import friction, lengths, searches, targets
from magfold_env.benchmarks.design.about import ABOUT
from magfold_env.benchmarks.runner import Runner

PARTS: dict[str, Runner] = {
    "targets": targets.run,
    "searches": searches.run,
    "lengths": lengths.run,
    "friction": friction.run,
}


def benchmark() -> runner.Benchmark:
    """Return the parts, their diagrams and what is said about them."""
    return runner.Benchmark("design", PARTS, {}, about=ABOUT)


def run(only: Sequence[str], quick: bool, out: Path | None) -> None:
    """Measure, print, and write tables, as `runner.run` says."""
    runner.run(benchmark(), only, quick, out)
