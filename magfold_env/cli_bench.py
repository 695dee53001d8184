"""The `magfold bench` commands: one for every benchmark, all with the same options."""

# Without postponed annotations: an option's help below is made where the command is.

from importlib import import_module
from pathlib import Path
from typing import Annotated, NamedTuple

import typer

from magfold_env.cli_errors import errors_in_one_line

bench = typer.Typer(help="Measure this machine and this version.", no_args_is_help=True)

Quick = Annotated[bool, typer.Option("--quick", help="Measure less: only to try it.")]
Out = Annotated[
    Path | None, typer.Option(help="Folder for CSV, JSON and PNG files; made if need be.")
]


class Benchmark(NamedTuple):
    """What is said about a benchmark before its modules, of which there are many, are imported."""

    name: str
    """Its command, and its package in `magfold_env.benchmarks`."""
    measures: str
    parts: str
    """Names of its parts, as its module `command` has them."""


BENCHMARKS = (
    Benchmark(
        "dynamics",
        "Measure the engine: run time against error, and what each feature costs.",
        "scaling, smooth, restarts, contact, folds, features, first-use",
    ),
    Benchmark(
        "magnets",
        "Measure the magnets: time against error, growth with length, folds, magpylib beside them.",
        "accuracy, points, far, scaling, devices, fold, peers",
    ),
    Benchmark(
        "energy",
        "Measure the predictors by energy: scans, proofs of ground states, how often they agree.",
        "scan, ground-states, predictors",
    ),
    Benchmark(
        "predict",
        "Repeat the paper's experiment, and count how often each predictor names its result.",
        "experiment, predictors, scaling",
    ),
    Benchmark(
        "design",
        "Measure design: successes by target and mode, searches side by side, longer chains.",
        "targets, searches, lengths, friction",
    ),
    Benchmark(
        "env",
        "Measure the environments: episodes and steps a second, Python's share, other tasks.",
        "episodes, quasistatic, overhead, peers",
    ),
)


def _add(benchmark: Benchmark) -> None:
    """Add the command of one benchmark."""

    @bench.command(benchmark.name, help=benchmark.measures)
    def measure(  # pyright: ignore[reportUnusedFunction] - typer holds it
        *,
        quick: Quick = False,
        only: Annotated[
            list[str] | None, typer.Option(help=f"A part: {benchmark.parts}; may repeat.")
        ] = None,
        out: Out = None,
    ) -> None:
        command = import_module(f"magfold_env.benchmarks.{benchmark.name}.command")
        with errors_in_one_line():
            command.run(only or [], quick, out)


for _benchmark in BENCHMARKS:
    _add(_benchmark)
