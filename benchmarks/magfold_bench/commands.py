"""The commands of `python -m magfold_bench`: each benchmark, all as one suite, stress, paper."""

# No postponed annotations, because an option's help below is made with the command.

from importlib import import_module
from pathlib import Path
from typing import Annotated

import typer

from magfold_bench.paper.command import paper
from magfold_bench.presentation import Summary, descriptions
from magfold_bench.stress.command import stress
from magfold_env.cli import options

bench = options.application(no_args_is_help=True)


@bench.callback(invoke_without_command=True)
def suite(
    context: typer.Context,
    *,
    quick: Annotated[
        bool,
        typer.Option("--quick", help="Run all benchmarks with small efforts, in some minutes."),
    ] = False,
    full: Annotated[
        bool, typer.Option("--full", help="Run all benchmarks as the documentation quotes them.")
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder of the suite's report; runs/bench-quick or -full by default."),
    ] = None,
) -> None:
    """Measure this machine and this version with all benchmarks, or with one by name.

    The results of all benchmarks are on one page, report.html, beside tables and diagrams. An
    interrupted run continues in its folder.
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
    command = import_module("magfold_bench.suite")
    with options.errors_in_one_line():
        complete = command.run(effort, out or Path("runs") / f"bench-{effort}")
    if not complete:
        raise typer.Exit(1)


def _add(name: str, summary: Summary) -> None:
    """Add the command of one benchmark."""

    @bench.command(name, help=summary.measures)
    def measure(  # pyright: ignore[reportUnusedFunction] - typer holds it
        *,
        quick: options.Quick = False,
        only: Annotated[
            list[str] | None,
            typer.Option(help=f"A part: {', '.join(summary.parts)}; may repeat."),
        ] = None,
        out: Annotated[
            Path | None, typer.Option(help="Folder for CSV, JSON and PNG files, created if needed.")
        ] = None,
    ) -> None:
        with options.errors_in_one_line():
            import_module("magfold_bench.parts").run(name, only or [], quick, out)


for _name, _summary in descriptions().items():
    _add(_name, _summary)
bench.command()(stress)
bench.command()(paper)
