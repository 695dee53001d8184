"""The parts of every benchmark: what measures each, and what draws it.

What is said about them stands in `descriptions.toml`.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from magfold_env.benchmarks import design, energy, predict, runner
from magfold_env.benchmarks.dynamics import contact, features, folds, scaling, smooth
from magfold_env.benchmarks.env import episodes, overhead
from magfold_env.benchmarks.env import peers as tasks
from magfold_env.benchmarks.magnets import accuracy, devices, far, fold, peers, points
from magfold_env.benchmarks.magnets import scaling as long_magnets
from magfold_env.benchmarks.runner import Part
from magfold_env.benchmarks.whole import skipping, work_precision
from magfold_env.laws import experiment, pinned_chain
from magfold_env.laws.integrators import dop853

BENCHMARKS: dict[str, dict[str, Part]] = {
    "whole": {
        "work-precision": Part(work_precision.run, work_precision.draw),
        "skipping": Part(skipping.run, skipping.draw),
    },
    "dynamics": {
        "scaling": Part(scaling.run, pinned_chain.draw),
        "smooth": Part(smooth.run, smooth.draw, check=dop853),
        "restarts": Part(smooth.restarts, check=dop853),
        "contact": Part(contact.run, contact.draw),
        "folds": Part(folds.run),
        "features": Part(features.run, features.draw),
        "first-use": Part(folds.first_use),
    },
    "magnets": {
        "accuracy": Part(accuracy.run, accuracy.draw),
        "points": Part(points.run, points.draw),
        "far": Part(far.run, far.draw),
        "scaling": Part(long_magnets.run, long_magnets.draw),
        "devices": Part(devices.run, devices.draw),
        "fold": Part(fold.run, fold.draw),
        "peers": Part(peers.run, peers.draw),
    },
    "energy": {
        "scan": Part(energy.scan),
        "ground-states": Part(energy.ground_states),
        "predictors": Part(energy.predictors),
    },
    "predict": {
        "experiment": Part(experiment.run, experiment.draw_experiment),
        "predictors": Part(predict.predictors),
        "scaling": Part(predict.scaling),
    },
    "design": {
        "targets": Part(design.targets),
        "searches": Part(design.searches),
        "lengths": Part(design.lengths),
        "friction": Part(design.friction),
    },
    "env": {
        "episodes": Part(episodes.run, episodes.draw),
        "quasistatic": Part(episodes.quasistatic, episodes.draw_quasistatic),
        "overhead": Part(overhead.run, overhead.draw),
        "peers": Part(tasks.run, tasks.draw),
    },
}
"""Parts by benchmark, in the order of the suite's report."""


def run(name: str, only: Sequence[str], quick: bool, out: Path | None) -> None:
    """Measure parts of a benchmark, print, and write tables and diagrams: see `runner.run`."""
    runner.run(name, BENCHMARKS[name], only, quick, out)
