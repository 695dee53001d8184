"""The parts of the magnets benchmark."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from magfold_env.benchmarks import runner
from magfold_env.benchmarks.magnets import (
    accuracy,
    devices,
    far,
    figures,
    fold,
    peers,
    points,
    scaling,
)
from magfold_env.benchmarks.magnets.about import ABOUT
from magfold_env.benchmarks.runner import Runner

PARTS: dict[str, Runner] = {
    "accuracy": accuracy.run,
    "points": points.run,
    "far": far.run,
    "scaling": scaling.run,
    "devices": devices.run,
    "fold": fold.run,
    "peers": peers.run,
}


def benchmark() -> runner.Benchmark:
    """Return the parts, their diagrams and what is said about them."""
    return runner.Benchmark("magnets", PARTS, figures.DRAWINGS, about=ABOUT)


def run(only: Sequence[str], quick: bool, out: Path | None) -> None:
    """Measure, print, and write tables and diagrams, as `runner.run` says."""
    runner.run(benchmark(), only, quick, out)
