"""The parts of the environments' benchmark."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from magfold_env.benchmarks import runner
from magfold_env.benchmarks.env import episodes, figures, overhead, peers, quasistatic
from magfold_env.benchmarks.env.about import ABOUT
from magfold_env.benchmarks.runner import Runner

PARTS: dict[str, Runner] = {
    episodes.NAME: episodes.run,
    quasistatic.NAME: quasistatic.run,
    overhead.NAME: overhead.run,
    peers.NAME: peers.run,
}


def benchmark() -> runner.Benchmark:
    """Return the parts, their diagrams and what is said about them."""
    return runner.Benchmark("env", PARTS, figures.DRAWINGS, about=ABOUT)


def run(only: Sequence[str], quick: bool, out: Path | None) -> None:
    """Measure, print, and write tables and diagrams, as `runner.run` says."""
    runner.run(benchmark(), only, quick, out)
