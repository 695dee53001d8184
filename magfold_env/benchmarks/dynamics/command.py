"""The parts of the dynamics benchmark."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from magfold_env.benchmarks import runner
from magfold_env.benchmarks.dynamics import (
    chain_scaling,
    contact_scenes,
    features,
    figures,
    first_use,
    fold_cost,
    restarts,
    smooth,
)
from magfold_env.benchmarks.dynamics.about import ABOUT
from magfold_env.benchmarks.runner import Runner
from magfold_env.laws.integrators import dop853

PARTS: dict[str, Runner] = {
    "scaling": chain_scaling.run,
    "smooth": smooth.run,
    "restarts": restarts.run,
    "contact": contact_scenes.run,
    "folds": fold_cost.run,
    "features": features.run,
    "first-use": first_use.run,
}


def benchmark() -> runner.Benchmark:
    """Return the parts, their diagrams and what is said about them."""
    return runner.Benchmark("dynamics", PARTS, figures.DRAWINGS, about=ABOUT, check=_check)


def run(only: Sequence[str], quick: bool, out: Path | None) -> None:
    """Measure, print, and write tables and diagrams, as `runner.run` says."""
    runner.run(benchmark(), only, quick, out)


def _check(chosen: Sequence[str]) -> None:
    """Raise ImportError if a chosen part needs an integrator that is not installed."""
    if {"smooth", "restarts"} & set(chosen):
        dop853()
