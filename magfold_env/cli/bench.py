"""The `magfold bench` commands: one for every benchmark, and all of them as one suite."""

# Without postponed annotations: an option's help below is made where the command is.

from importlib import import_module
from pathlib import Path
from typing import Annotated, NamedTuple

import typer

from magfold_env.cli.options import errors_in_one_line

bench = typer.Typer(no_args_is_help=True)

Quick = Annotated[bool, typer.Option("--quick", help="Measure less: only to try it.")]
Out = Annotated[
    Path | None, typer.Option(help="Folder for CSV, JSON and PNG files; made if need be.")
]


@bench.callback(invoke_without_command=True)
def suite(
    context: typer.Context,
    *,
    quick: Annotated[
        bool, typer.Option("--quick", help="Run all benchmarks, each on little: three minutes.")
    ] = False,
    full: Annotated[
        bool, typer.Option("--full", help="Run all benchmarks as the documentation quotes them.")
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder of the suite's report; runs/bench-quick or -full if left out."),
    ] = None,
) -> None:
    """Measure this machine and this version: all of it, or one benchmark by its name.

    All benchmarks end in one page, report.html, beside tables and diagrams. A run that was killed
    goes on in its folder with what is left.
    """
    if context.invoked_subcommand is not None:
        if quick or full or out is not None:
            name = context.invoked_subcommand
            raise typer.BadParameter(
                f"--quick, --full and --out before {name!r} are the suite's; put its own after it"
            )
        return
    if quick == full:
        raise typer.BadParameter("one of --quick and --full must be given, or a benchmark's name")
    effort = "quick" if quick else "full"
    command = import_module("magfold_env.benchmarks.suite.command")
    with errors_in_one_line():
        complete = command.run(effort, out or Path("runs") / f"bench-{effort}")
    if not complete:
        raise typer.Exit(1)


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
        "whole",
        "Measure whole folds: run time against error by setting, and what a scene doesn't need.",
        "work-precision, skipping",
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
